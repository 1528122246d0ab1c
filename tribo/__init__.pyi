from . import plot as plot
from .berardo2019.published_tables import (
    contradictions as contradictions,
    load_table1 as load_table1,
    load_table2 as load_table2,
)
from .campaign import load_campaign as load_campaign, open_campaign as open_campaign, write_template as write_template
from .diagnostics import plan_design as plan_design
from .errors import Problem as Problem, TriboError as TriboError
from .files import data_dir as data_dir
from .ingestion.exports import read_pull as read_pull
from .mechanisms_in_model import simulate_with as simulate_with
from .readers import inspect_export as inspect_export, read_export as read_export
from .records import (
    Campaign as Campaign,
    Ingested as Ingested,
    LawFit as LawFit,
    Pattern as Pattern,
    Pull as Pull,
    Run as Run,
    Study as Study,
    Trace as Trace,
)
from .report import verify as verify, write_report as write_report
from .slider import SliderConfig as SliderConfig, SliderRun as SliderRun, simulate_slider as simulate_slider
from .springblock import (
    SimConfig as SimConfig,
    calibrate as calibrate,
    run_ensemble as run_ensemble,
    simulate as simulate,
    stratified_design as stratified_design,
)
from .stages import (
    StudyOptions as StudyOptions,
    assess as assess,
    compare as compare,
    diagnose as diagnose,
    diagnosis as diagnosis,
    fit as fit,
    ingest as ingest,
    study as study,
)

__version__: str
