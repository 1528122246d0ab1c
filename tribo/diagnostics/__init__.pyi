from .diagnosis import (
    Diagnosis as Diagnosis,
    contrast_table as contrast_table,
    examine as examine,
    misfit_map as misfit_map,
    residual_table as residual_table,
    weighing_table as weighing_table,
)
from .planning import Plan as Plan, plan_design as plan_design
from .predictor import (
    simulated_predictor as simulated_predictor,
    tabled_predictor as tabled_predictor,
)
from .simulated_extension import with_simulation as with_simulation
from .verdict import Verdict as Verdict
