"""Mutants of the library, each tried against the quick tests that run the line it changes.

    python benchmarks/mutants.py run out/mutants [--mutants 300] [--seed 1]     goes on where it was stopped
    python benchmarks/mutants.py again out/mutants                              the survivors, against the tests of now
    python benchmarks/mutants.py table out/mutants                              by room, in Markdown

cosmic-ray makes the mutants and changes the source; which are tried is drawn at random from all of them. Mutants that
change nothing but annotations are not counted among them. Tests run in a copy of the repository without
anything beside it: first once under coverage, which says what test runs what line, then for every mutant those tests
that run its line, the quickest first, up to the first failure or the limit of processor time. A mutant is killed when
a test fails, when its tests take ten times longer than without it, or when it crashes the interpreter.
"""

from __future__ import annotations

import argparse
import ast
import compileall
import json
import os
import py_compile
import random
import resource
import shutil
import subprocess
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
ROOMS = {
    "traces": "tribo/traces",
    "fitting": "tribo/fitting",
    "diagnostics": "tribo/diagnostics",
    "law search": "tribo/lawsearch",
    "mechanisms": "tribo/mechanisms",
    "readers: reading": "tribo/readers/reading.py",
    "readers: wide tables": "tribo/readers/wide_tables.py",
}
TESTS = ("traces", "fitting", "diagnose", "mechanisms", "mechanisms_in_model", "readers", "ingestion")
LIMIT_S = 12.0  # of processor time for the tests of one mutant, as they take without it
LIBRARIES = ("h5py", "numba", "numpy", "pandas", "pint", "pytest", "scipy.optimize", "scipy.special",
             "scipy.stats", "statsmodels.api", "xarray")  # fmt: skip


def copy_of_repository(folder: Path) -> Path:
    """The files under version control, as they are now, in a folder of their own."""
    shutil.rmtree(folder, ignore_errors=True)
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in listed.splitlines():
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    # compiled files that are checked by the text of their module, not by its date: a mutant never runs another one's
    checked = py_compile.PycInvalidationMode.CHECKED_HASH
    compileall.compile_dir(folder / "tribo", quiet=1, invalidation_mode=checked)
    return folder


def in_a_child(folder: Path, work: Callable[[], int], cpu_s: float, output: Path) -> int:
    """Exit status of ``work`` in a process of its own, in ``folder``; negative where a signal ended it."""
    pid = os.fork()
    if pid:
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    status = 99
    try:
        os.chdir(folder)
        sys.path.insert(0, str(folder))
        sys.dont_write_bytecode = False  # tests are compiled once
        resource.setrlimit(resource.RLIMIT_CPU, (int(cpu_s), int(cpu_s) + 5))
        with output.open("w") as out:
            os.dup2(out.fileno(), 1)
            os.dup2(out.fileno(), 2)
            status = int(work())
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


class Watch:
    """A pytest plugin: which test runs which line, and how long it takes."""

    def __init__(self, folder: Path) -> None:
        import coverage

        places = [str(folder / place) for place in ROOMS.values()]
        self.coverage = coverage.Coverage(data_file=None, include=[*places, *(f"{place}/*" for place in places)])
        self.seconds: dict[str, float] = {}
        self.begin, self.unfit = 0.0, set[str]()  # skipped and failed tests kill no mutant
        self.coverage.start()

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.coverage.switch_context(nodeid)
        self.begin = time.process_time()

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.outcome != "passed":
            self.unfit.add(report.nodeid)

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        if nodeid not in self.unfit:
            self.seconds[nodeid] = time.process_time() - self.begin

    def record(self, folder: Path) -> dict[str, Any]:
        """``tests`` with ``seconds`` of processor time each, and by file and line the numbers of those that run it."""
        self.coverage.stop()
        data = self.coverage.get_data()
        number = {test: k for k, test in enumerate(self.seconds)}
        lines = {
            str(Path(file).relative_to(folder)): {
                line: [number[test] for test in tests if test in number]
                for line, tests in data.contexts_by_lineno(file).items()
            }
            for file in data.measured_files()
        }
        return {"tests": list(number), "seconds": list(self.seconds.values()), "lines": lines}


def pytest_arguments(*more: str) -> list[str]:
    return ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--hypothesis-seed=0", "-m", "not slow", *more]


def watched_tests(copy: Path, out: Path) -> dict[str, Any]:
    """Seconds of every test, and the tests that run each line of each file; measured once for an ``out``."""
    kept = out / "lines.json"

    def work() -> int:
        import pytest

        watch = Watch(copy)
        pytest.main(pytest_arguments(*(f"tests/{name}" for name in TESTS)), plugins=[watch])
        kept.write_text(json.dumps(watch.record(copy)))
        return 0

    if not kept.exists() and in_a_child(copy, work, 36000, out / "lines.log") != 0:
        raise SystemExit(f"the tests do not run: see {out / 'lines.log'}")
    found: dict[str, Any] = json.loads(kept.read_text())
    return found


class WithoutAnnotations(ast.NodeTransformer):
    """Takes annotations out of a module: nothing depends on them but readers of the code."""

    def visit(self, node: ast.AST) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
        if isinstance(node, ast.arg):
            node.annotation = None
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        return node


def meaning(source: str) -> str:
    return ast.dump(WithoutAnnotations().visit(ast.parse(source)))


def all_mutants(copy: Path, out: Path) -> Iterator[dict[str, Any]]:
    """Every mutant of the rooms, in an order that does not change from run to run."""
    from cosmic_ray.commands.init import init
    from cosmic_ray.work_db import WorkDB, use_db

    for room, place in ROOMS.items():
        path = copy / place
        modules = sorted(path.rglob("*.py")) if path.is_dir() else [path]
        with use_db(str(out / "session.sqlite"), WorkDB.Mode.create) as session:
            init(modules, session, {})
            specs = [item.mutations[0] for item in session.work_items]
        for s in sorted(specs, key=lambda s: (str(s.module_path), s.operator_name, s.occurrence)):
            file = str(Path(s.module_path).relative_to(copy))
            yield {
                "room": room, "file": file, "operator": s.operator_name.removeprefix("core/"),
                "occurrence": s.occurrence, "line": s.start_pos[0],
            }  # fmt: skip


def mutated(copy: Path, mutant: dict[str, Any]) -> tuple[str, str | None]:
    """Source before and after; None where the mutant means the same."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    before = (copy / mutant["file"]).read_text(encoding="utf-8")
    after = mutate_code(before, get_operator(f"core/{mutant['operator']}")(), mutant["occurrence"])
    try:
        return before, None if after is None or meaning(before) == meaning(after) else after
    except SyntaxError:
        return before, None


def drawn(copy: Path, out: Path, n: int, seed: int) -> list[dict[str, Any]]:
    """``n`` mutants that mean something, drawn at random from all; kept, so that a run can go on."""
    kept = out / f"drawn-{n}-{seed}.json"
    if not kept.exists():
        every = list(all_mutants(copy, out))
        random.Random(seed).shuffle(every)
        chosen: list[dict[str, Any]] = []
        for mutant in every:
            before, after = mutated(copy, mutant)
            if after is not None:
                changed = [(a, b) for a, b in zip(before.split("\n"), after.split("\n"), strict=False) if a != b]
                mutant["before"], mutant["after"] = (text.strip() for text in changed[0])
                chosen.append(mutant)
            if len(chosen) == n:
                break
        kept.write_text(json.dumps({"of": len(every), "mutants": chosen}, indent=1))
    found: list[dict[str, Any]] = json.loads(kept.read_text())["mutants"]
    return found


def tests_of(watched: dict[str, Any], mutant: dict[str, Any]) -> list[int]:
    """Tests that run the line, the quickest first, within the limit.

    Of a line run on import, those of its module; any test where all of the module is run on import.
    """
    lines = watched["lines"].get(mutant["file"], {})
    found = set(lines.get(str(mutant["line"]), [])) or {test for tests in lines.values() for test in tests}
    found = found or set(range(len(watched["tests"])))
    chosen, spent = [], 0.0
    for test in sorted(found, key=lambda k: (watched["seconds"][k], k)):
        spent += watched["seconds"][test]
        if spent > LIMIT_S:
            break
        chosen.append(test)
    return chosen


def outcome(copy: Path, watched: dict[str, Any], mutant: dict[str, Any], log: Path) -> dict[str, Any]:
    """Try one mutant; what became of it, with the test that killed it."""
    before, after = mutated(copy, mutant)
    tests = tests_of(watched, mutant)
    if after is None or not tests:
        return {**mutant, "outcome": "survived", "tests": len(tests), "by": ""}
    spent = sum(watched["seconds"][test] for test in tests)
    names = [watched["tests"][test] for test in tests]

    def work() -> int:
        import pytest

        return int(pytest.main(pytest_arguments("-x", *names)))

    begin = time.monotonic()
    file = copy / mutant["file"]
    try:
        file.write_text(after, encoding="utf-8")
        status = in_a_child(copy, work, 20 + 10 * spent, log)
    finally:
        file.write_text(before, encoding="utf-8")
    said = log.read_text(errors="replace")
    by = next((line for line in said.splitlines() if line[:6] in ("FAILED", "ERROR ")), "")
    if status == 0 or (status > 0 and not by and "loading conftest" not in said):
        what = "survived"  # or pytest itself refused: nothing was shown
    else:
        what = "killed" if status > 0 else "stopped"
    return {**mutant, "outcome": what, "tests": len(tests), "by": by[:160], "s": round(time.monotonic() - begin, 1)}


def key(mutant: dict[str, Any]) -> str:
    return "{file}:{operator}:{occurrence}".format(**mutant)


def results(out: Path) -> dict[str, dict[str, Any]]:
    """The last outcome of every mutant."""
    file = out / "results.jsonl"
    lines = file.read_text().splitlines() if file.exists() else []
    return {key(found): found for found in map(json.loads, lines)}


def try_all(copy: Path, out: Path, mutants: Sequence[dict[str, Any]]) -> None:
    for library in LIBRARIES:
        __import__(library)  # once, and not in every child
    watched = watched_tests(copy, out)
    for k, mutant in enumerate(mutants, start=1):
        found = outcome(copy, watched, mutant, out / "last.log")
        with (out / "results.jsonl").open("a") as stream:
            stream.write(json.dumps(found) + "\n")
        where = f"{mutant['file']}:{mutant['line']}"
        print(f"{k}/{len(mutants)} {found['outcome']:8s} {where} {mutant['after']}", flush=True)


def table(out: Path) -> str:
    found = list(results(out).values())
    count = Counter((m["room"], m["outcome"] != "survived") for m in found)
    lines = ["| room | mutants | killed | share |", "|---|---|---|---|"]
    for name, rooms in (*((room, [room]) for room in ROOMS), ("all", list(ROOMS))):
        killed, survived = (sum(count[room, died] for room in rooms) for died in (True, False))
        n = killed + survived
        lines.append(f"| {name} | {n} | {killed} | {100 * killed / max(n, 1):.0f} % |")
    for m in found:
        if m["outcome"] == "survived":
            lines.append(f"- `{m['file']}:{m['line']}` {m['operator']}: `{m['before']}` -> `{m['after']}`")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "again", "table"))
    parser.add_argument("out", type=Path)
    parser.add_argument("--mutants", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    out: Path = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    if options.what != "table":
        copy = copy_of_repository(out / "copy" / "repository")
        if options.what == "run":
            done = results(out)
            try_all(copy, out, [m for m in drawn(copy, out, options.mutants, options.seed) if key(m) not in done])
        else:
            (out / "lines.json").unlink(missing_ok=True)
            try_all(copy, out, [m for m in results(out).values() if m["outcome"] == "survived"])
    print(table(out))
    return 0


if __name__ == "__main__":
    sys.exit(main())
