"""The street is one way: a room imports only rooms before it, and siblings do not import each other."""

from __future__ import annotations

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "tribo"

# Each room with the rooms it may import, from the ground up. A room may import itself, and nothing else.
GROUND = {
    "display", "errors", "user_text", "input_files", "workbook_sheets", "units", "zeroing", "fits", "records", "files",
    "temporary", "forked", "laws", "vocabulary", "outputs",
}  # fmt: skip
STREET: tuple[tuple[str, set[str]], ...] = (
    ("user_text", set()),
    ("display", {"user_text"}),
    ("errors", {"display"}),
    ("units", {"errors"}),
    ("zeroing", {"display"}),
    ("files", {"errors"}),
    ("outputs", {"files", "user_text"}),
    ("fits", {"outputs", "display", "errors"}),
    ("records", {"display", "errors", "fits", "zeroing"}),
    ("laws", {"fits", "records", "display"}),
    ("vocabulary", set()),
    ("temporary", {"files", "errors"}),
    ("forked", set()),
    ("workbook_sheets", set()),
    ("input_files", {"errors", "files", "workbook_sheets"}),
    ("own_folder", GROUND),
    ("kept_results", GROUND | {"own_folder"}),
    ("campaign", GROUND),
    ("readers", GROUND),
    ("traces", GROUND),
    ("ingestion", GROUND | {"campaign", "readers", "traces"}),
    ("drafting", GROUND | {"campaign", "readers", "traces"}),
    ("fitting", GROUND),
    ("plausibility", GROUND),
    ("springblock", GROUND | {"campaign", "kept_results", "own_folder"}),
    ("slider", GROUND | {"springblock"}),
    ("tracelaws", GROUND | {"slider", "traces"}),
    ("mechanisms", GROUND),
    ("mechanisms_in_model", GROUND | {"mechanisms", "springblock"}),
    ("comparison", GROUND | {"fitting", "springblock", "kept_results"}),
    ("diagnostics", GROUND | {"fitting", "springblock", "mechanisms", "mechanisms_in_model"}),
    ("lawsearch", GROUND | {"fitting", "springblock", "mechanisms", "mechanisms_in_model", "diagnostics"}),
    ("berardo2019", GROUND | {"fitting", "springblock", "mechanisms", "diagnostics", "lawsearch"}),
    ("design", GROUND | {"campaign", "kept_results", "springblock", "berardo2019"}),
    ("wording", GROUND | {"mechanisms", "comparison", "diagnostics", "lawsearch", "berardo2019"}),
    ("figures", GROUND | {"fitting", "comparison", "diagnostics", "lawsearch", "berardo2019", "wording"}),
    ("plot", GROUND | {"diagnostics", "berardo2019", "figures"}),
    (
        "report",
        GROUND
        | {"kept_results", "own_folder", "comparison", "diagnostics", "lawsearch", "berardo2019", "wording", "figures"},
    ),
)
MAY_IMPORT = dict(STREET)
BELOW = set(MAY_IMPORT)
MAY_IMPORT["stages"] = BELOW - {"figures", "report"}
MAY_IMPORT["dry_run"] = MAY_IMPORT["stages"] | {"stages"}
MAY_IMPORT["site"] = BELOW | {"stages", "dry_run"}
MAY_IMPORT["cli"] = BELOW | {"stages", "dry_run", "site"}
MAY_IMPORT["__main__"] = {"cli"}
MAY_IMPORT["__init__"] = set()
# Records that hold a record of a room above them: its type is known to the type checker alone.
TYPED = {"diagnosis": {"lawsearch"}}
ROOMS = sorted(p for p in PACKAGE.rglob("*.py"))


@cache
def parsed(source: str) -> ast.Module:
    """A source as its tree: several tests look at every module."""
    return ast.parse(source)


def room_of(module: Path) -> str:
    """The room a file belongs to: its package below tribo, or its own name."""
    return module.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported_rooms(source: str, typed: bool = True) -> set[str]:
    """Rooms of tribo that a module imports anywhere in it, ``typed`` those for the type checker as well."""
    found = set()
    for node in ast.walk(parsed(source)) if typed else at_run_time(parsed(source)):
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
    room, source = room_of(module), module.read_text(encoding="utf-8")
    assert imported_rooms(source) <= MAY_IMPORT[room] | {room} | TYPED.get(module.stem, set())
    assert imported_rooms(source, typed=False) <= MAY_IMPORT[room] | {room}


MOST_ARGUMENTS = 7
MOST_WITH_MORE = 5  # functions that may take more arguments
SHARED_NAMES = {"__init__"}  # module names that several rooms may use


def arguments(function: ast.FunctionDef) -> int:
    """Number of positional and keyword-only arguments, self and cls excluded."""
    given = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return len([a for a in given if a.arg not in ("self", "cls")])


def long_signatures(source: str) -> list[str]:
    """Functions and methods with more than seven arguments."""
    functions = [node for node in ast.walk(parsed(source)) if isinstance(node, ast.FunctionDef)]
    return [f.name for f in functions if arguments(f) > MOST_ARGUMENTS]


def test_at_most_five_functions_take_eight_arguments_or_more() -> None:
    found = [f"{m.relative_to(PACKAGE)}:{name}" for m in ROOMS for name in long_signatures(m.read_text("utf-8"))]
    assert len(found) <= MOST_WITH_MORE, found


def test_a_long_signature_is_seen() -> None:
    source = "def f(a, b, /, c, d, *, e, g, h): ...\nclass C:\n  def m(self, a, b, c, d, e, g, h, i): ..."
    assert long_signatures(source) == ["m"]


def module_name(module: Path) -> str:
    return ".".join(module.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")


@cache
def at_run_time(tree: ast.AST) -> list[ast.AST]:
    """Every node but those under ``if TYPE_CHECKING``."""
    nodes: list[ast.AST] = []
    ahead = [tree]
    while ahead:
        for child in ast.iter_child_nodes(ahead.pop()):
            if not (isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)):
                nodes.append(child)
                ahead.append(child)
    return nodes


def imported_modules(source: str, package: str, known: set[str], faces: dict[str, dict[str, str]]) -> set[str]:
    """Modules of tribo that a source imports at run time, at its top or late; through the face of a package as well."""
    found = set()
    for node in at_run_time(parsed(source)):
        if isinstance(node, ast.ImportFrom):
            base = ".".join(filter(None, (package if node.level else "", node.module)))
            for name in (a.name for a in node.names):
                found.add(f"{base}.{name}" if f"{base}.{name}" in known else faces.get(base, {}).get(name, base))
        elif isinstance(node, ast.Import):
            found |= {a.name for a in node.names}
    return found & known


def circles(imports: dict[str, set[str]]) -> list[str]:
    """Modules that reach themselves through their imports."""

    def reached(start: str) -> set[str]:
        seen: set[str] = set()
        waiting = [start]
        while waiting:
            new = imports[waiting.pop()] - seen
            seen |= new
            waiting += new
        return seen

    return sorted(module for module in imports if module in reached(module))


def test_no_files_import_each_other_in_a_circle() -> None:
    names = {module_name(m): m for m in ROOMS}
    faces = {}
    for name, module in names.items():
        stub = module.with_suffix(".pyi")
        if stub.exists():
            lines = [n for n in parsed(stub.read_text("utf-8")).body if isinstance(n, ast.ImportFrom)]
            faces[name] = {a.asname or a.name: f"{name}.{line.module}" for line in lines for a in line.names}
    known = set(names)
    imports = {
        name: imported_modules(module.read_text("utf-8"), name.rpartition(".")[0], known, faces) - {name}
        for name, module in names.items()
    }
    assert imports["tribo.comparison.prediction"] >= {"tribo.records", "tribo.springblock.calibration"}
    assert circles(imports) == []


def test_a_circle_is_seen() -> None:
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == ["a", "b", "c"]
    late = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n  import tribo.a\ndef f():\n  import tribo.b"
    assert imported_modules(late, "tribo", {"tribo.a", "tribo.b"}, {}) == {"tribo.b"}


def test_no_two_modules_share_a_name() -> None:
    stems = [module.stem for module in ROOMS]
    assert {stem for stem in stems if stems.count(stem) > 1} <= SHARED_NAMES


def test_the_tree_in_contributing_names_every_package_and_top_module() -> None:
    tree = (PACKAGE.parent / "CONTRIBUTING.md").read_text("utf-8").split("    tribo/\n")[1].split("\n\n")[0]
    words = set(tree.split())
    packages = {f"{p.parent.name}/" for p in PACKAGE.glob("*/**/__init__.py")}
    modules = {p.name for p in PACKAGE.glob("[!_]*.py")}
    assert packages | modules <= words
    assert {w for w in words if w.endswith(("/", ".py"))} <= packages | modules


MOST_STOPS = 12


def ways_of(text: str) -> list[list[tuple[str, str]]]:
    """The lines "a.py: f, g -> b.py: h" of a page, each as its functions with their files."""
    lines = [line.strip() for line in text.splitlines() if line.startswith("    cli/") and " -> " in line]
    parts = [[part.split(": ") for part in line.split(" -> ")] for line in lines]
    return [[(file, name) for file, names in way for name in names.split(", ")] for way in parts]


def names_in(file: str, function: str) -> set[str]:
    """Every name in a function of a file, those of what it calls, is handed or hands on among them."""
    tree = parsed((PACKAGE / file).read_text("utf-8"))
    (found,) = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef) and n.name == function]
    nodes = list(ast.walk(found))
    imported = {a.asname or a.name: a.name for n in nodes if isinstance(n, ast.ImportFrom) for a in n.names}
    named = {n.id for n in nodes if isinstance(n, ast.Name)} | {n.attr for n in nodes if isinstance(n, ast.Attribute)}
    return {imported.get(name, name) for name in named}


def breaks_of(way: list[tuple[str, str]]) -> list[str]:
    """Functions of a way that neither the one before them names nor the one before that, through it."""
    named: list[set[str]] = [{way[0][1]}, *(names_in(*stop) for stop in way)]
    return [name for k, (_, name) in enumerate(way) if name not in named[k] | named[max(k - 1, 0)]]


def test_the_four_ways_of_a_report_are_as_stated_and_short() -> None:
    ways = ways_of((PACKAGE.parent / "CONTRIBUTING.md").read_text("utf-8"))
    assert [way[-1][1] for way in ways] == ["parse_block", "find_apex", "advance", "finding"]
    assert [len(way) for way in ways if len(way) > MOST_STOPS] == []
    assert [breaks_of(way) for way in ways] == [[]] * len(ways)


def test_a_way_with_a_function_left_out_is_seen() -> None:
    way = ways_of((PACKAGE.parent / "CONTRIBUTING.md").read_text("utf-8"))[1]
    assert breaks_of([*way[:4], *way[6:]]) == ["evaluate"]


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


def test_tables_are_written_without_the_libraries_of_figures_and_diagnosis() -> None:
    code = "import sys; from tribo.report import write_until; print([m for m in sys.argv[1:] if m in sys.modules])"
    heavy = ["matplotlib", "xarray", "dask", "statsmodels", "scipy.stats", "numba", "typst", "tribo.diagnostics"]
    seen = subprocess.run([sys.executable, "-c", code, *heavy], capture_output=True, text=True, check=True)
    assert seen.stdout.strip() == "[]"


def test_units_are_converted_in_one_place_only() -> None:
    users = {room_of(m) for m in ROOMS if "import pint" in m.read_text(encoding="utf-8")}
    assert users <= {"units", "stages", "console"}


def open_records(source: str) -> list[str]:
    """Data classes whose fields can be set after they were made."""
    classes = [node for node in ast.walk(parsed(source)) if isinstance(node, ast.ClassDef)]
    decorators = [(c.name, ast.unparse(d)) for c in classes for d in c.decorator_list]
    return [name for name, text in decorators if text.startswith("dataclass") and "frozen=True" not in text]


def test_the_records_that_stages_exchange_are_frozen() -> None:
    found = {name for module in ROOMS for name in open_records(module.read_text("utf-8"))}
    assert found == {"Draft"}  # filled step by step by one function, handed to none


def test_a_record_that_is_not_frozen_is_seen() -> None:
    assert open_records("@dataclass\nclass A: ...\n@dataclass(frozen=False)\nclass B: ...") == ["A", "B"]
    assert open_records("@dataclass(frozen=True)\nclass A: ...") == []


TIDIES_ONLY = {"temporary.py", "own_folder.py", "jit.py"}  # what they cannot list stays, and nothing depends on it


def silent_reads(source: str) -> list[str]:
    """Calls that leave out folders which cannot be listed, or whose errors name no file; resources are no files."""
    calls = [node.func for node in ast.walk(parsed(source)) if isinstance(node, ast.Call)]
    named = [ast.unparse(f) for f in calls if isinstance(f, ast.Attribute) and f.attr in SILENT]
    return [name for name in named if not name.startswith("(files(")]


SILENT = {"glob", "rglob", "read_text", "read_bytes", "write_text", "write_bytes"}


def test_files_and_folders_are_read_and_written_by_functions_that_leave_nothing_out_in_silence() -> None:
    readers = {m.name for m in ROOMS if silent_reads(m.read_text(encoding="utf-8"))}
    assert readers == {"files.py", *TIDIES_ONLY}


def test_a_silent_read_is_seen() -> None:
    assert silent_reads("p.rglob('*')\nq = (a / b).read_text()") == ["p.rglob", "(a / b).read_text"]
