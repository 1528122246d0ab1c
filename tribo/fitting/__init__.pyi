from .alternatives import fit_three_term as fit_three_term, mixed_model as mixed_model
from .assessment import (
    outlying_pulls as outlying_pulls,
    outlying_specimens as outlying_specimens,
    paired_differences as paired_differences,
    power_of_campaign as power_of_campaign,
)
from .budget import campaign_budgets as campaign_budgets, uncertainty_budget as uncertainty_budget
from .linear import repeat_scatter as repeat_scatter
from .samples import fit_samples as fit_samples
