"""Every remedy that a message of the readers and of init names works when it is followed.

A case makes a fault; its remedies are taken from the text of the message, each is applied, and the fault is gone.
Words that stand for something of the user's (NAME, COLUMN, unit, FILE) are filled in.
"""

from __future__ import annotations

import ast
import re
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from on_the_command_line import run

import tribo
from tribo.errors import Problem, ReadError
from tribo.readers import columns_from_text, read_blocks, read_export
from tribo.readers.columns import Columns
from tribo.records import Correction

N = 60
K = np.arange(N)
TIME, FORCE = 0.1 * K, 0.5 + 0.01 * (K % 7)


def table(header: str, *columns: np.ndarray, mark: str = ",", decimals: int = 3) -> str:
    rows = (mark.join(f"{value:.{decimals}f}" for value in row) for row in zip(*columns, strict=True))
    return header + "\n" + "\n".join(rows) + "\n"


GOOD = table("Time [s],Force [N]", TIME, FORCE)
SCALED = np.where(K > 30, 10.0, 1.0)
ROLLED = np.r_[TIME[:30], TIME[:30]]


def damaged(row: int, cells: str) -> str:
    lines = GOOD.split("\n")
    lines[row] = cells
    return "\n".join(lines)


@dataclass(frozen=True)
class Fault:
    """An export (text, or a function that makes it), what is stated about it, and what fills the words of a remedy."""

    kind: str
    made: str | Callable[[Path], Path]
    columns: Columns = field(default_factory=dict)
    fill: Mapping[str, str] = field(default_factory=dict)
    name: str = "a.csv"

    def export(self, folder: Path) -> Path:
        if callable(self.made):
            return self.made(folder)
        (folder / self.name).write_text(self.made, encoding="utf-8")
        return folder / self.name


def zipped(folder: Path) -> Path:
    with zipfile.ZipFile(folder / "x.zip", "w") as out:
        out.writestr("a/b.txt", GOOD)
        out.writestr("a/c.txt", GOOD)
    return folder / "x.zip"


def matrix(folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "m.mat", {"data": np.c_[TIME, FORCE, 2 * FORCE]})
    return folder / "m.mat"


FAULTS = [
    Fault("missing_unit", table("Time,Force", TIME, FORCE)),
    Fault("missing_unit", "\n".join(table("Time,Load", TIME, FORCE) for _ in range(3))),
    Fault("unknown_unit", table("Time [s],Force [foo]", TIME, FORCE)),
    Fault("ambiguous_unit", table("Time [s],Force [g],ax [m/s2]", TIME, FORCE, FORCE)),
    Fault("ambiguous_mark", table("Time [s];Force [N]", 1 + TIME, 1 + FORCE, mark=";").replace(".", ",")),
    Fault("time_of_day", "No,Time,Force [N]\n" + "".join(f"{k},Mo 09:00:{k:02d},{FORCE[k]:.3f}\n" for k in range(50)),
          fill={"NAME": "No"}),
    Fault("time_of_day", "No,Time,Force [N]\n" + "".join(f"{k},00:{k:02d},{FORCE[k]:.3f}\n" for k in range(50)),
          fill={"NAME": "No"}),
    Fault("missing_column", table("clock,ch1", TIME, FORCE), fill={"NAME [unit]": "ch1 [N]"},
          columns={"time": "#1 [s]"}),
    Fault("missing_column", table("clock,Force [N]", TIME, FORCE), fill={"NAME [unit]": "clock [s]"}),
    Fault("missing_column", table("", TIME, FORCE).lstrip(), columns={"time": "#1 [s]"}, fill={"#2 [unit]": "#2 [N]"}),
    Fault("missing_column", table("Time [s],Channel 2 [N]", TIME, FORCE), columns={"force": "Chanel 2"}),
    Fault("missing_column", table("Time [s];a;b", TIME, FORCE, FORCE, mark=";"), columns={"friction_force": "F* [N]"}),
    Fault("missing_column", table("Time [s];a1;a2;a3", TIME, FORCE, FORCE, FORCE, mark=";"),
          fill={"F*": "a*", "NAME [unit]": "a2 [N]"}),
    Fault("uneven_patterns", table("Time [s];F1 [N];F2 [N];x1 [mm]", TIME, FORCE, FORCE, TIME, mark=";"),
          columns={"friction_force": "F* [N]", "displacement": "x* [mm]"}),
    Fault("missing_column", matrix, fill={"NAME [s]": "data(1) [s]", "NAME [N]": "data(2) [N]", "Fnorm": "data(2)"},
          columns={"time": "#1 [s]"}),
    Fault("missing_lever", table("Time [s],Torque [N mm]", TIME, FORCE)),
    Fault("missing_load", table("Time [s],COF", TIME, FORCE), fill={"NAME": "COF"}),
    Fault("missing_area", table("Time [s],COF,Normal stress [MPa]", TIME, FORCE, FORCE)),
    Fault("load_is_friction", table("Time [s],COF,Load [N]", TIME, FORCE, 12 * FORCE)),
    Fault("force_may_be_load", table("Time [s],COF,Force [N]", TIME, FORCE, 3 + 0.001 * TIME)),
    Fault("larger_along_y", table("Time [s],Fx [N],Fy [N]", TIME, 0.01 * FORCE * (K > 5), FORCE * (K > 5))),
    Fault("two_forces", table("Time [s],Kraft 1 [N],Kraft 2 [N]", TIME, FORCE, 3 * FORCE)),
    Fault("one_of_two_forces", table("Time [s],Load [N],Resistance [N],x [mm]", TIME, 3 * FORCE, FORCE, TIME)),
    Fault("no_radius", table("Time [s],Torque [N mm],Radius [mm]", TIME, FORCE, np.zeros(N))),
    Fault("names_do_not_fit", table("Time [s],Force [N],x,y,z", TIME, FORCE)),
    Fault("several_tables", GOOD + "\n" + GOOD),
    Fault("several_tables", "".join(f"{k}\n{GOOD}" for k in (1, 2, 3))),
    Fault("several_entries", zipped),
    Fault("unknown_entry", lambda folder: zipped(folder) / "a/d.txt"),
    Fault("time_goes_back", table("Time [s],Force [N]", ROLLED, FORCE)),
    Fault("scale_jump", table("Time [s],Force [N]", TIME, FORCE * SCALED)),
    Fault("text_in_numbers", damaged(20, "1.9,OVER")),
    Fault("two_decimal_marks", damaged(20, "1.9,0.5.3")),
    Fault("nan_gap", damaged(20, "1.9,")),
    Fault("wrong_number_of_cells", damaged(20, "1.9,0.5,7")),
    Fault("truncated_mid_row", GOOD[:-6] ),
    Fault("unknown_decimal", GOOD, columns={"decimal": "x"}),
    Fault("unknown_quantity", GOOD, columns={"frction_force": "Force [N]"}),
    Fault("not_acceptable", damaged(20, "1.9,OVER"), columns={"accept": "everything"}),
]  # fmt: skip

_COLUMN = re.compile(r'(?<![\w-])(\w+) = "([^"]+)"')
_STATED = re.compile(r"\b(lever_arm_mm|sampling_rate_Hz|normal_load_N|nominal_area_mm2)\b(?: = ([\d.]+))?")
_PATHS = re.compile(r"\S+?(?:#\d+(?=[ ;,]|$)|\.zip/[\w/.]+)")
_FIELDS = {"lever_arm_mm": ("lever_arm_m", 1e-3), "sampling_rate_Hz": ("sampling_rate_Hz", 1.0),
           "normal_load_N": ("load_N", 1.0), "nominal_area_mm2": ("area_m2", 1e-6)}  # fmt: skip
Remedy = tuple[Columns, Correction | None, Path]


def remedies(problem: Problem, fault: Fault, path: Path) -> list[Remedy]:
    """What the message says may be stated or read in place, one by one."""
    text = f"{problem.what}; {problem.allowed or ''}"
    such_as = re.search(r"the unit such as ([^\s;]+)", text)
    for word, meant in fault.fill.items():
        text = text.replace(word, meant)
    unit = such_as[1] if such_as else "s" if "the time" in problem.what else "N"
    text = text.replace("[unit]", f"[{unit}]")
    alternatives = (dict(_COLUMN.findall(one)) for one in re.split(r"; | or |\(or ", text))
    found: list[Remedy] = [(one, None, path) for one in alternatives if one]
    for key, value in _STATED.findall(text.partition("tribo init")[0]):
        name, factor = _FIELDS[key]
        found.append(({}, Correction(**{name: float(value or 3.0) * factor}), path))
    found += [({}, None, Path(one)) for one in _PATHS.findall(text)]
    if meant := re.search(r"did you mean ([^?]+)\?", text):
        key = next((k for k, v in fault.columns.items() if v == problem.found), "")
        found.append(({key: meant[1]} if key else {meant[1]: fault.columns[str(problem.found)]}, None, path))
    if problem.kind in ("unknown_decimal", "not_acceptable"):
        key = "decimal" if problem.kind == "unknown_decimal" else "accept"
        found += [({key: one.strip('"')}, None, path) for one in re.split(r", | or ", problem.allowed or "")]
        found = [one for one in found if one[0] != {"accept": "scale_jump"}]  # of other damage than this
    if problem.kind == "unknown_entry":
        found.append(({}, None, path.parents[1] / re.split(r"one of |,", text)[1]))
    if problem.kind == "uneven_patterns":
        found.append(({"displacement": "none"}, None, path))
    return found


def faults_with(columns: Columns, correction: Correction | None, path: Path, *, every: bool) -> tuple[Problem, ...]:
    """What is wrong with an export that is read as one trace, or with every one in it."""
    try:
        (read_blocks if every and "#" not in path.name else read_export)(path, columns=columns, correction=correction)
    except ReadError as why:
        return why.problems
    return ()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.kind)
def test_every_remedy_of_a_message_works(tmp_path: Path, fault: Fault) -> None:
    path = fault.export(tmp_path)
    problems = faults_with(fault.columns, None, path, every=False)
    assert fault.kind in {p.kind for p in problems}
    found = {p: remedies(p, fault, path) for p in problems}
    for problem, ways in found.items():
        assert ways, f"no remedy in: {problem}"
        for columns, correction, at in ways:
            stated = {k: v for k, v in fault.columns.items() if v != problem.found and k != problem.found} | columns
            left = faults_with(stated, correction, at, every=True)
            same = {(p.kind, p.column, p.what) for p in left}
            assert (problem.kind, problem.column, problem.what) not in same, (columns, correction, at)
    first = [ways[0] for ways in found.values()]
    kept = {k: v for k, v in fault.columns.items() if not {k, v} & {p.found for p in problems} and k != "decimal"}
    together = kept | {key: value for columns, _, _ in first for key, value in columns.items()}
    assert not faults_with(together, first[0][1], first[0][2], every=True)


def written(folder: Path, exports: Mapping[str, str]) -> Path:
    folder.mkdir()
    for name, text in exports.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


EVALUATED = "Material,Load,CoF\nA,10,0.2\nB,20,0.3\nC,30,0.3\n"
# kind, exports, what init is told, words of the remedy and what fills them
OF_INIT = [
    ("names_not_used", {"alpha.txt": GOOD, "beta.txt": GOOD}, (), {}),
    ("names_not_used", {"a_x_1.txt": GOOD, "a_y_1.txt": GOOD, "b_x_1.txt": GOOD}, (), {}),
    ("bad_names", {"A_1.txt": GOOD}, ("--names", "A_1"), {}),
    ("bad_columns", {"A_1.txt": GOOD}, ("--columns", "Time [s]"), {"NAME [unit]": "Time [s]", "#3 [unit]": "#2 [N]"}),
    ("missing_column", {"cof.csv": EVALUATED}, ("--table", "sample=Material,coefficient=CoF"),
     {"one of normal_load_N": "sample=Material,coefficient=CoF,normal_load_N=Load"}),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "exports", "told", "fill"), OF_INIT, ids=lambda value: str(value)[:20])
def test_every_remedy_of_init_works(
    tmp_path: Path, kind: str, exports: dict[str, str], told: tuple[str, ...], fill: dict[str, str]
) -> None:
    raw = written(tmp_path / "raw", exports)
    source = raw if len(exports) > 1 else raw / next(iter(exports))
    refused = run("init", tmp_path / "c", "--from", source, *told, "--json")
    assert refused.exit_code == 1
    text = " ".join(refused.output.split()).replace('\\"', '"')
    assert f'"kind": "{kind}"' in text
    for word, meant in fill.items():
        assert word in text
        text = text.replace(word, meant)
    ways = [re.findall(r'--names "([^"]+)"', way) for way in re.split(r" or |,(?= --names)", text) if "--names" in way]
    options = [[option for name in names for option in ("--names", name)] for names in ways if names]
    if kind == "bad_names":
        text = text.replace("{normal_load_N}N_", "")  # which these names do not hold
        options = [["--names", pattern] for pattern in re.findall(r'"(\{[^"]+\*)"', text)]
    if kind == "bad_columns":
        options = [["--columns", one] for one in re.findall(r'time=[^"]+', text)]
    if kind == "missing_column":
        options = [["--table", one] for one in re.findall(r"sample=Material,coefficient=CoF,normal_load_N=Load", text)]
    assert options
    for k, option in enumerate(options):
        done = run("init", tmp_path / f"c{k}", "--from", source, *option)
        assert done.exit_code == 0, (option, done.output)


def test_a_table_of_evaluated_forces_that_is_inspected_leads_to_the_command_that_takes_it(tmp_path: Path) -> None:
    table = written(tmp_path / "raw", {"cof.csv": EVALUATED}) / "cof.csv"
    shown = " ".join(run("inspect", table).output.split())
    way = re.search(r"tribo init NEW --from FILE (--table) (\S+=COLUMN)", shown)
    assert way
    mapping = way[2]
    for column in ("Material", "Load", "CoF"):
        mapping = mapping.replace("COLUMN", column, 1)
    assert run("init", tmp_path / "c", "--from", table, way[1], mapping).exit_code == 0
    assert len(tribo.load_campaign(tmp_path / "c").tests) == 3


@pytest.mark.parametrize("entry", ["x.zip/a/b.txt", "x.zip/a/c.txt"])
def test_the_path_of_an_entry_is_taken_by_inspect_and_by_init(tmp_path: Path, entry: str) -> None:
    shown = " ".join(run("inspect", zipped(tmp_path)).output.split())
    (path,) = set(re.findall(r"name of the \.zip: (\S+);", shown))
    assert run("inspect", path).exit_code == 0
    assert run("inspect", tmp_path / entry).exit_code == 0
    folder = tmp_path / "c"
    assert run("init", folder, "--from", tmp_path / entry, "--fill", "normal_load_N=1").exit_code == 0
    assert len(tribo.ingest(tribo.load_campaign(folder), rule="last_share").pulls) == 1


# Kinds whose only remedy is another export, a file that is there, or a look at the doubt itself
NOTHING_TO_STATE = {
    "missing", "not_a_file", "too_large", "bad_archive", "encrypted", "empty", "bom_only", "binary", "unreadable",
    "bad_mat", "bad_tdms", "header_only", "not_an_export", "impossible_number", "too_many_rows", "more", "one_column",
    "decimal_is_delimiter", "no_exports", "exists", "short", "no_export",
    "time_repeats", "coarse_clock", "time_gap", "uneven_time", "no_zero_phase", "flat_top", "all_zero",
    "only_beginning", "footer", "header_again",
    "empty_end", "empty_start", "other_candidate", "accepted", "column_not_here", "no_time",
}  # fmt: skip


def test_no_kind_of_message_is_left_out_here() -> None:
    folder = Path(tribo.__file__).parent
    files = [*(folder / "readers").glob("*.py"), *(folder / "drafting").glob("*.py"), folder / "cli/setup_commands.py"]
    kinds = set()
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Problem":
                first = node.args[0]
                kinds |= {first.value} if isinstance(first, ast.Constant) else set()
            if isinstance(node, ast.keyword) and node.arg == "kind" and isinstance(node.value, ast.Constant):
                kinds.add(node.value.value)
    followed = {fault.kind for fault in FAULTS} | {kind for kind, *_ in OF_INIT}
    assert {str(kind) for kind in kinds} - followed - NOTHING_TO_STATE == set()


def test_an_interval_whose_first_points_are_invalid_is_read_from_its_first_whole_row(tmp_path: Path) -> None:
    head = "Test:\tfriction\nInterval data:\tPoint No.\tTime\tFriction Force\tStatus\n\t\t[s]\t[N]\t\n"
    rows = "".join(f"\t{k}\t{0.5 * k:.1f}\t{'' if k < 4 else 0.3 + 0.01 * k}\t{'bad' if k < 4 else 'Dy_'}\n" for k in K)
    path = tmp_path / "a.txt"
    path.write_text(head + rows, encoding="utf-8")
    trace = read_export(path)
    np.testing.assert_allclose(trace.force_N, 0.3 + 0.01 * K[4:])
    assert [(p.kind, p.row) for p in trace.problems] == [("empty_start", 4)]
    assert trace.first_row == 8


def test_rows_with_accepted_damage_are_left_out_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(damaged(20, "1.9,OVER"), encoding="utf-8")
    trace = read_export(path, columns=columns_from_text("accept=text_in_numbers"))
    np.testing.assert_allclose(trace.time_s, np.delete(TIME, 19))
    assert trace.flags == ("accepted",)
    assert "1 damaged rows are left out" in trace.problems[0].what


def test_a_table_with_a_doubtful_decimal_costs_neither_the_others_nor_itself(tmp_path: Path) -> None:
    doubtful = table("Time [s],Force [N]", TIME, FORCE * SCALED)
    path = tmp_path / "a.csv"
    path.write_text("".join(f"Specimen {k}\n{doubtful if k == 3 else GOOD}" for k in range(1, 6)), encoding="utf-8")
    assert read_export(f"{path}#5").time_s.size == N
    traces = read_blocks(path, columns={"accept": ["scale_jump"]})
    assert [trace.flags for trace in traces] == [(), (), ("accepted",), (), ()]
    np.testing.assert_allclose(traces[2].force_N, FORCE * SCALED, atol=1e-3)
