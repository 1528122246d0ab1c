from .alternatives import fit_three_term as fit_three_term, mixed_model as mixed_model
from .assessment import outlying_pulls as outlying_pulls, outlying_specimens as outlying_specimens
from .both_variables import fit_errors_in_both as fit_errors_in_both
from .budget import campaign_budgets as campaign_budgets, uncertainty_budget as uncertainty_budget
from .curves import fit_power_law as fit_power_law
from .differences import (
    PairedDifference as PairedDifference,
    paired_differences as paired_differences,
    power_of_campaign as power_of_campaign,
)
from .linear import repeat_scatter as repeat_scatter
from .pooled_scatter import pool_specimen_scatter as pool_specimen_scatter
from .samples import fit_samples as fit_samples
