"""The street is one way: a room imports only rooms before it, and siblings do not import each other."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "tribo"

# Each room with the rooms it may import, from the ground up. A room may import itself, and nothing else.
GROUND = {"errors", "quantities", "records", "published"}
STREET: tuple[tuple[str, set[str]], ...] = (
    ("errors", set()),
    ("quantities", {"errors"}),
    ("records", {"errors"}),
    ("published", set()),
    ("store", GROUND),
    ("campaign", GROUND),
    ("readers", GROUND),
    ("traces", GROUND),
    ("laws", GROUND),
    ("virtual_tribometer", GROUND),
    ("ingestion", GROUND | {"campaign", "readers", "traces"}),
    ("fitting", GROUND | {"laws"}),
    ("simulate", GROUND | {"campaign", "laws", "store"}),
    ("mechanisms", GROUND | {"laws"}),
    ("mechanisms_in_model", GROUND | {"mechanisms", "simulate", "virtual_tribometer"}),
    ("comparison", GROUND | {"fitting", "laws", "simulate", "store"}),
    ("diagnose", GROUND | {"laws", "fitting", "simulate", "mechanisms", "mechanisms_in_model"}),
    ("figures", GROUND | {"laws", "comparison", "diagnose"}),
    ("report", GROUND | {"laws", "store", "comparison", "diagnose", "figures"}),
)
MAY_IMPORT = dict(STREET)
BELOW = set(MAY_IMPORT)
MAY_IMPORT["stages"] = BELOW - {"figures", "report"}
MAY_IMPORT["pipeline"] = BELOW | {"stages"}
MAY_IMPORT["cli"] = BELOW | {"stages", "pipeline"}
MAY_IMPORT["__main__"] = {"cli"}
MAY_IMPORT["__init__"] = set()
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
    assert imported_rooms(module.read_text(encoding="utf-8")) <= MAY_IMPORT[room] | {room}


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
