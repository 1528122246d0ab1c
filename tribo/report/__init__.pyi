from .campaign_nc import write_store as write_store
from .drawings import write_figures as write_figures
from .provenance import (
    Provenance as Provenance,
    Verification as Verification,
    gather_provenance as gather_provenance,
    verify as verify,
)
from .tables import write_tables as write_tables
from .write import write_report as write_report, write_until as write_until, write_verdict as write_verdict
