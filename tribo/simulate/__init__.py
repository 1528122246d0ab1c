"""The two-dimensional spring-block model of Berardo et al. 2019: one run, ensembles, calibration, files.

Names are imported from their modules on first use, so that importing the package stays cheap.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribo.simulate.calibration import calibrate
    from tribo.simulate.config import PAPER, FrictionTerms, LocalFriction, SimConfig
    from tribo.simulate.ensemble import angle_range_deg, run_ensemble, stratified_design
    from tribo.simulate.masks import PAPER_PATTERNS, contact_mask
    from tribo.simulate.resume import read_stored, run_stored
    from tribo.simulate.run import simulate
    from tribo.simulate.store import write_ensemble, write_run
    from tribo.simulate.tables import table2

_MODULES = {
    "FrictionTerms": "config", "PAPER": "config",
    "PAPER_PATTERNS": "masks", "LocalFriction": "config", "SimConfig": "config",
    "angle_range_deg": "ensemble", "calibrate": "calibration", "contact_mask": "masks", "read_stored": "resume",
    "run_ensemble": "ensemble", "run_stored": "resume", "table2": "tables",
    "simulate": "run", "stratified_design": "ensemble", "write_ensemble": "store", "write_run": "store",
}  # fmt: skip

__all__ = [
    "PAPER",
    "PAPER_PATTERNS",
    "FrictionTerms",
    "LocalFriction",
    "SimConfig",
    "angle_range_deg",
    "calibrate",
    "contact_mask",
    "read_stored",
    "run_ensemble",
    "run_stored",
    "simulate",
    "stratified_design",
    "table2",
    "write_ensemble",
    "write_run",
]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
