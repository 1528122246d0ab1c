"""The only writer: tables, figures, HDF5 store and page of a study. Names load on first use."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribo.report.diagnosis import write_verdict
    from tribo.report.drawings import write_figures
    from tribo.report.page import write_html
    from tribo.report.provenance import Provenance, gather_provenance
    from tribo.report.store import write_store
    from tribo.report.tables import write_tables
    from tribo.report.text import set_aside_text, summary_text, table2_text
    from tribo.report.write import write_report, write_until

__all__ = [
    "Provenance",
    "gather_provenance",
    "set_aside_text",
    "summary_text",
    "table2_text",
    "write_figures",
    "write_html",
    "write_report",
    "write_store",
    "write_tables",
    "write_until",
    "write_verdict",
]

_HOME = {
    "Provenance": "provenance",
    "gather_provenance": "provenance",
    "set_aside_text": "text",
    "summary_text": "text",
    "table2_text": "text",
    "write_figures": "drawings",
    "write_html": "page",
    "write_report": "write",
    "write_store": "store",
    "write_tables": "tables",
    "write_until": "write",
    "write_verdict": "diagnosis",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
