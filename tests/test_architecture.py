"""The street is one way: a room imports only rooms before it, and siblings do not import each other."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "tribo"

# Each room with the rooms it may import. Left out: errors, quantities and records, which everyone may use.
MAY_IMPORT: dict[str, set[str]] = {
    "errors": set(),
    "quantities": set(),
    "records": set(),
    "published": set(),
    "campaign": set(),
    "readers": set(),
    "traces": set(),
    "laws": set(),
    "fitting": {"laws"},
    "simulate": {"laws"},
    "mechanisms": {"laws"},
    "diagnose": {"laws", "fitting", "simulate", "mechanisms", "published"},
    "figures": {"laws", "diagnose", "published"},
    "report": {"laws", "diagnose", "figures", "published"},
}
EVERYONE = {"errors", "quantities", "records"}
TOP = {
    "stages", "exports", "overrides", "prediction", "simulations", "designs", "simulating", "kept", "pipeline",
    "cli", "console", "bench", "doctor", "__init__", "__main__",
}  # fmt: skip
ROOMS = sorted(p for p in PACKAGE.rglob("*.py"))


def room_of(module: Path) -> str:
    """The room a file belongs to: its package below tribo, or its own name."""
    return module.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported_rooms(source: str) -> set[str]:
    """Rooms of tribo that a module imports anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module] if node.module != "tribo" else [f"tribo.{a.name}" for a in node.names]
        elif isinstance(node, ast.Import):
            names = [a.name for a in node.names]
        else:
            continue
        found |= {n.split(".")[1] for n in names if n.startswith("tribo.")}
    return found - {"__version__"}


@pytest.mark.parametrize("module", ROOMS, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_a_room_imports_only_what_lies_before_it(module: Path) -> None:
    room = room_of(module)
    if room in TOP:
        return
    allowed = MAY_IMPORT[room] | ({room} if module.parent != PACKAGE else set())
    base = EVERYONE if room not in EVERYONE else {"errors", "quantities"} - {room}
    assert imported_rooms(module.read_text(encoding="utf-8")) <= allowed | base


def test_a_forbidden_import_is_seen() -> None:
    assert imported_rooms("from tribo.report import tables\nimport tribo.cli\nfrom tribo import stages") == {
        "report",
        "cli",
        "stages",
    }


@pytest.mark.parametrize("module", ROOMS, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_only_named_rooms_use_pyplot_state_or_fast_math(module: Path) -> None:
    source = module.read_text(encoding="utf-8")
    assert "pyplot" not in source or "no pyplot" in source
    assert "fastmath=True" not in source


def test_the_command_line_starts_without_the_heavy_libraries() -> None:
    code = "import sys, tribo.cli; print([m for m in sys.modules if m.split('.')[0] in sys.argv[1:]])"
    heavy = ["numba", "xarray", "statsmodels", "matplotlib", "scipy", "pandas", "pint", "pydantic"]
    seen = subprocess.run([sys.executable, "-c", code, *heavy], capture_output=True, text=True, check=True)
    assert seen.stdout.strip() == "[]"


def test_units_are_converted_in_one_place_only() -> None:
    users = {room_of(m) for m in ROOMS if "import pint" in m.read_text(encoding="utf-8")}
    assert users <= {"quantities", "stages", "console"}
