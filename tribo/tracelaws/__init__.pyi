from .of_campaign import trace_laws_of as trace_laws_of
from .slip_fits import fit_slips as fit_slips
from .step_fits import fit_steps as fit_steps
