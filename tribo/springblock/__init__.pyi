from .calibration import CalibrationRuns as CalibrationRuns, calibrate as calibrate
from .config import (
    PAPER as PAPER,
    FrictionTerms as FrictionTerms,
    LocalFriction as LocalFriction,
    SimConfig as SimConfig,
)
from .ensemble import (
    angle_range_deg as angle_range_deg,
    run_ensemble as run_ensemble,
    stratified_design as stratified_design,
)
from .kept_runs import (
    read_stored as read_stored,
    run_stored as run_stored,
    write_ensemble as write_ensemble,
    write_run as write_run,
)
from .lattice import PAPER_PATTERNS as PAPER_PATTERNS, contact_mask as contact_mask
from .run import simulate as simulate
