"""One campaign in many environments: whether tribo writes the same bytes, or says in a sentence why it cannot.

    python benchmarks/environments.py run  out/environments.jsonl [--count 200] [--seed 1] [--jobs 2]
    python benchmarks/environments.py page out/environments.jsonl     the counts into docs/results/environments.md

Every environment is a fresh process: `tribo fit` of a small zipped campaign, in every fifth `tribo report` with two
simulations a sample. First all settings alone, then two drawn together with a processor (the kernels of OpenBLAS and
the instructions that numpy and numba may use). Counted is whether every file of the output folder is that of an
undisturbed run, byte by byte but for times and the command; else whether all words and, to six digits, all numbers are;
else whether the exit status says so and the words are sentences without a traceback. The date of the outputs is fixed
by SOURCE_DATE_EPOCH, but where a setting takes that away. Linux only.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import torture_processes as processes  # noqa: E402
from faults.trial import state_of  # noqa: E402
from run_lines import read_rows, work_off  # noqa: E402

PAGE = ROOT / "docs" / "results" / "environments.md"
DATA = ROOT / "docs" / "data" / "environments.jsonl"
MARK = "<!-- below: python benchmarks/environments.py page -->"
FIT = ("fit", "campaign.zip", "-o", "out", "-q")
REPORT = ("report", "campaign.zip", "-o", "out", "--runs", "2", "--jobs", "1", "-q")
EVERY_FIFTH = 5
LONGEST_S = 600.0
EPOCH = "1790000000"
MB = 1 << 20
# what says a command and is not a result: the command line, versions and the machine of the run
RECORDS = ("ro-crate-metadata.json", "provenance.json")
CLOSE = 1e-6  # relative, of two numbers
NUMBER = re.compile(r"[-+−]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
# what follows from the bytes of something else: hashes, embedded pictures, names of parts of a picture
DERIVED = re.compile(r"data:[a-z/+]+;base64,[A-Za-z0-9+/=]+|[0-9a-f]{64}|\b[pmh][0-9a-f]{10}\b|sha\d+-[A-Za-z0-9+/=]+")
TEXTS = (".csv", ".json", ".html", ".svg", ".md", ".txt", ".toml")


@dataclass(frozen=True)
class Setting:
    """One thing that differs: variables (None takes one away), limit and umask of the process, line of the shell."""

    name: str
    kind: str
    variables: dict[str, str | None] = field(default_factory=dict)
    limit: tuple[int, int] | None = None
    umask: int | None = None
    wrapped: str = "{command}"


def _variables(kind: str, name: str, *values: str | None) -> Iterator[Setting]:
    for value in values:
        yield Setting(f"{name}={'(taken away)' if value is None else value}", kind, {name: value})


def processors() -> list[Setting]:
    """Kernels of OpenBLAS, and instructions that are held back."""
    kernels = ("Prescott", "Nehalem", "Sandybridge", "Haswell", "Zen")  # others need instructions that many have not
    found = list(_variables("processor", "OPENBLAS_CORETYPE", *kernels))
    found += _variables("processor", "NPY_DISABLE_CPU_FEATURES", "AVX2 FMA3", "AVX512F AVX512CD AVX512_SKX")
    found += _variables("processor", "NUMBA_CPU_NAME", "generic", "nocona")
    return [*found, *_variables("processor", "OPENBLAS_NUM_THREADS", "1", "2", "7")]


def settings() -> list[Setting]:
    """Everything else that differs between machines, one at a time."""
    found = [
        *_variables("locale", "LC_ALL", "C", "POSIX", "C.UTF-8", "de_DE.UTF-8", "tr_TR.UTF-8", "ja_JP.eucJP", "x"),
        *_variables("locale", "LANG", None, "fr_FR.ISO-8859-1"),
        *_variables("locale", "PYTHONUTF8", "0", "1"),
        *_variables("locale", "PYTHONIOENCODING", "ascii", "latin-1", "utf-16"),
        *_variables("time zone", "TZ", "UTC", "Asia/Kathmandu", "America/St_Johns", "Nowhere/Never", ""),
        *_variables("terminal", "TERM", None, "dumb", "xterm-256color"),
        *_variables("terminal", "COLUMNS", "0", "20", "x"),
        *_variables("terminal", "NO_COLOR", "1"), *_variables("terminal", "FORCE_COLOR", "1"),
        *_variables("python", "PYTHONHASHSEED", "0", "12345"), *_variables("python", "PYTHONOPTIMIZE", "2"),
        *_variables("python", "PYTHONDONTWRITEBYTECODE", "1"), *_variables("python", "PYTHONWARNINGS", "default"),
        *_variables("python", "PYTHONDEVMODE", "1"), *_variables("python", "PYTHONUNBUFFERED", "1"),
        *_variables("matplotlib", "MPLBACKEND", "TkAgg", "nonsense"),
        *_variables("matplotlib", "MPLCONFIGDIR", "/nowhere/at/all"), *_variables("matplotlib", "DISPLAY", ":99"),
        *_variables("threads", "OMP_NUM_THREADS", "1", "5", "x"),
        *_variables("threads", "NUMBA_NUM_THREADS", "1", "2"),
        *_variables("folders", "HOME", None, "/nowhere/at/all", "/dev/null"),
        *_variables("folders", "TMPDIR", "/nowhere/at/all", "/dev/null"),
        *_variables("folders", "XDG_CACHE_HOME", "/proc"),
        *_variables("folders", "NUMBA_CACHE_DIR", "/nowhere/at/all"), *_variables("folders", "PATH", "/nowhere/at/all"),
        *_variables("date", "SOURCE_DATE_EPOCH", "0", "nonsense", None),
        Setting("umask 077", "files", umask=0o77), Setting("umask 000", "files", umask=0),
        Setting("stdout closed", "streams", wrapped="{command} >&-"),
        Setting("stderr closed", "streams", wrapped="{command} 2>&-"),
        Setting("stdin closed", "streams", wrapped="{command} <&-"),
        Setting("all streams closed", "streams", wrapped="{command} <&- >&- 2>&-"),
        Setting("stdout full", "streams", wrapped="{command} >/dev/full"),
        Setting("stderr full", "streams", wrapped="{command} 2>/dev/full"),
        Setting("reader gone", "streams", wrapped="set -o pipefail; {command} | true"),
        Setting("words wanted, reader gone", "streams", wrapped="set -o pipefail; {verbose} | true"),
        Setting("words wanted, stdout full", "streams", wrapped="{verbose} >/dev/full"),
        Setting("words wanted, all streams closed", "streams", wrapped="{verbose} <&- >&- 2>&-"),
        Setting("no terminal size", "streams", wrapped="{verbose} </dev/null 2>&1 | cat"),
    ]  # fmt: skip
    limits = {
        "open files 20": (resource.RLIMIT_NOFILE, 20), "open files 64": (resource.RLIMIT_NOFILE, 64),
        "memory 300 MB": (resource.RLIMIT_AS, 300 * MB), "memory 1 GB": (resource.RLIMIT_AS, 1024 * MB),
        "memory 4 GB": (resource.RLIMIT_AS, 4096 * MB), "size of files 0": (resource.RLIMIT_FSIZE, 0),
        "size of files 10 kB": (resource.RLIMIT_FSIZE, 10_000), "size of files 1 MB": (resource.RLIMIT_FSIZE, MB),
        "stack 256 kB": (resource.RLIMIT_STACK, MB // 4), "core files 0": (resource.RLIMIT_CORE, 0),
        "locked memory 0": (resource.RLIMIT_MEMLOCK, 0),
    }  # fmt: skip
    return found + [Setting(name, "limits", limit=given) for name, given in limits.items()]


@dataclass(frozen=True)
class Trial:
    """Settings that act together."""

    number: int
    settings: tuple[Setting, ...]

    @property
    def command(self) -> tuple[str, ...]:
        return REPORT if self.number % EVERY_FIFTH == 0 else FIT

    @property
    def name(self) -> str:
        return " + ".join(s.name for s in self.settings) or "nothing"


def trials(count: int, seed: int) -> list[Trial]:
    """Every setting alone, then one of a processor with two others that do not differ in the same thing."""
    rng = random.Random(seed)
    alone = [(s,) for s in (*processors(), *settings())]
    drawn: list[tuple[Setting, ...]] = []
    while len(alone) + len(drawn) < count:
        one, other = rng.sample(settings(), 2)
        if one.kind != other.kind and not (set(one.variables) & set(other.variables)):
            drawn.append((rng.choice(processors()), one, other))
    return [Trial(k, chosen) for k, chosen in enumerate((*alone, *drawn)[:count])]


def in_environment(trial: Trial, campaign: Path, folder: Path) -> dict[str, Any]:
    """Run the command; its exit status, its words, and what stands in its output folder."""
    shutil.copy(campaign, folder / "campaign.zip")
    temporary = folder / "tmp"
    temporary.mkdir()
    variables = {**os.environ, "SOURCE_DATE_EPOCH": EPOCH, "TMPDIR": str(temporary), "LC_ALL": "C.UTF-8"}
    variables["PYTHONPATH"] = str(ROOT)
    for name in ("PYTHONDONTWRITEBYTECODE", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        variables.pop(name, None)
    wrapped = "{command}"
    for setting in trial.settings:
        wrapped = setting.wrapped if setting.wrapped != "{command}" else wrapped
        for name, value in setting.variables.items():
            variables.pop(name, None)
            if value is not None:
                variables[name] = value
    start = f"{sys.executable} -m tribo {' '.join(trial.command)}"
    line = wrapped.format(command=start, verbose=start.removesuffix(" -q"))

    def prepared() -> None:
        for setting in trial.settings:
            if setting.limit is not None:
                resource.setrlimit(setting.limit[0], (setting.limit[1], setting.limit[1]))
            if setting.umask is not None:
                os.umask(setting.umask)

    try:
        done = subprocess.run(
            ["/bin/bash", "-c", line], cwd=folder, env=variables, capture_output=True, timeout=LONGEST_S,
            preexec_fn=prepared,
        )  # fmt: skip
        status, words = done.returncode, (done.stdout + done.stderr).decode("utf-8", "replace")
    except subprocess.TimeoutExpired:
        status, words = None, "longer than the limit"
    return {"status": status, "words": words, "state": state_of(folder / "out")}


def differing(found: dict[str, str], expected: dict[str, str]) -> list[str]:
    """Files that are not those of the undisturbed run; records of the command and the machine left out, and what tribo
    keeps for itself."""
    every = sorted({*found, *expected})
    names = [n for n in every if found.get(n) != expected.get(n) and Path(n).name not in RECORDS]
    return [n for n in names if "/kept/" not in n]


def same_numbers(one: Path, other: Path) -> bool:
    """Whether two files say the same in words, and in numbers to six digits; of pictures, their text form is asked."""
    if not (one.is_file() and other.is_file()):
        return False
    if one.suffix == ".nc":
        return _same_tree(one, other)
    if one.suffix not in TEXTS:
        return True
    first, second = (DERIVED.sub("", path.read_text("utf-8", "replace")) for path in (one, other))
    if NUMBER.sub("#", first) != NUMBER.sub("#", second):
        return False
    pairs = zip(NUMBER.findall(first), NUMBER.findall(second), strict=True)
    return all(_close(float(a.replace("−", "-")), float(b.replace("−", "-")), one.suffix) for a, b in pairs)


def _close(a: float, b: float, suffix: str) -> bool:
    return abs(a - b) <= (1e-3 if suffix == ".svg" else 0.0) + CLOSE * max(abs(a), abs(b), 1e-9)


def _same_tree(one: Path, other: Path) -> bool:
    import numpy as np
    import xarray as xr

    with xr.open_datatree(one) as first, xr.open_datatree(other) as second:
        if set(first.groups) != set(second.groups):
            return False
        for group in first.groups:
            for name, column in first[group].variables.items():
                there = second[group].variables[name].values
                if column.dtype.kind != "f":
                    same = np.array_equal(column.values, there)
                else:
                    same = np.allclose(column.values, there, rtol=CLOSE, atol=1e-12, equal_nan=True)
                if not same:
                    return False
    return True


def judged(
    seen: dict[str, Any], expected: dict[str, Any], folder: Path, undisturbed: Path, *, dated: bool
) -> tuple[str, list[str]]:
    """The outcome of a trial ("same bytes", "same numbers", "refused", or what is wrong), and the files that differ;
    ``dated`` where its settings change the date of the outputs."""
    words, status = seen["words"], seen["status"]
    other = differing(seen["state"], expected["state"])
    if dated:  # pages hold the date in words
        other = [name for name in other if not name.endswith((".html", ".pdf"))]
    if status is None:
        return "no end", other
    if "because of an error in tribo" in words:
        return "error in tribo", other
    if "Traceback (most recent call last)" in words or re.search(r"Segmentation fault|Aborted|core dumped", words):
        return "traceback or crash", other
    if status == expected["status"]:
        worse = [name for name in other if not same_numbers(folder / name, undisturbed / name)]
        if worse:
            return "other results", worse
        return ("same numbers" if other else "same bytes"), other
    if not other:  # all was written, and nobody was left to be told
        return "same bytes", []
    return "refused" if _sentences(words) else "refused without a word", other


def _sentences(words: str) -> list[str]:
    return [line for line in words.splitlines() if len(line.split()) >= 3]


class Trials:
    """Runs trials beside one undisturbed run."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.campaign = root / "campaign.zip"
        if not self.campaign.exists():
            processes.zipped_campaign(root / "campaign")
            expected = {}
            for trial in (Trial(-EVERY_FIFTH, ()), Trial(-1, ())):
                expected[trial.command[0]] = in_environment(trial, self.campaign, self.folder(trial))
            (root / "expected.json").write_text(json.dumps(expected))
        self.expected = json.loads((root / "expected.json").read_text())

    def folder(self, trial: Trial) -> Path:
        folder = self.root / (f"trial-{trial.number}" if trial.number >= 0 else f"undisturbed-{trial.command[0]}")
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        return folder

    def __call__(self, trial: Trial) -> dict[str, Any]:
        folder = self.folder(trial)
        try:
            seen = in_environment(trial, self.campaign, folder)
            command = trial.command[0]
            undisturbed, dated = self.root / f"undisturbed-{command}", any(s.kind == "date" for s in trial.settings)
            outcome, other = judged(seen, self.expected[command], folder, undisturbed, dated=dated)
        finally:
            if not os.environ.get("KEEP_TRIALS"):
                shutil.rmtree(folder, ignore_errors=True)
        return {
            "number": trial.number, "name": trial.name, "kinds": [s.kind for s in trial.settings], "outcome": outcome,
            "status": seen["status"], "files": other[:6],
            "words": seen["words"].replace(str(folder), "FOLDER")[-600:],
        }  # fmt: skip


def in_a_line(row: dict[str, Any]) -> str:
    return f"{row['number']:3d} {row['name']}: {row['outcome']} (exit {row['status']})"


HELD = ("same bytes", "same numbers", "refused")


def table(rows: list[dict[str, Any]]) -> str:
    """Counts by what differs, and every trial that did not hold."""
    outcomes = sorted({r["outcome"] for r in rows}, key=lambda o: (o not in HELD, o))
    alone = [r for r in rows if len(r["kinds"]) == 1]
    parts = [("all", rows), ("one setting", alone), ("several settings", [r for r in rows if len(r["kinds"]) > 1])]
    for kind in dict.fromkeys(k for r in rows for k in r["kinds"]):
        parts.append((f"with: {kind}", [r for r in rows if kind in r["kinds"]]))
    lines = [f"| environments | number | {' | '.join(outcomes)} |", "|---" * (2 + len(outcomes)) + "|"]
    for name, part in parts:
        counts = " | ".join(str(sum(r["outcome"] == o for r in part)) for o in outcomes)
        lines.append(f"| {name} | {len(part)} | {counts} |")
    bad = [
        f"- {r['name']}: {r['outcome']}, exit status {r['status']}; {', '.join(r['files'])}"
        for r in rows if r["outcome"] not in HELD
    ]  # fmt: skip
    refused = [
        f"- {r['name']} (exit status {r['status']}): {' '.join(r['words'].split())[-160:]}"
        for r in alone if r["outcome"] == "refused"
    ]  # fmt: skip
    lines += ["", "Not held:", "", *(bad or ["none"]), ""]
    return "\n".join([*lines, "Refusals of one setting, the end of their words:", "", *(refused or ["none"]), ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "table", "page"))
    parser.add_argument("path", type=Path, help="JSON lines, one an environment")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="", help="names that contain this")
    options = parser.parse_args()
    if options.what == "run":
        known = {row["number"] for row in read_rows(options.path)}
        rest = [t for t in trials(options.count, options.seed) if t.number not in known and options.only in t.name]
        with tempfile.TemporaryDirectory() as folder:
            work_off(rest, Trials(Path(folder)), options.path, options.jobs, in_a_line)
    rows = sorted(read_rows(options.path), key=lambda r: r["number"])
    text = table(rows)
    if options.what == "page":
        above = PAGE.read_text().split(MARK)[0]
        PAGE.write_text(f"{above}{MARK}\n\nSeed {options.seed}: {len(rows)} environments.\n\n{text}")
        DATA.write_text("".join(json.dumps(row) + "\n" for row in rows))
    print(text)


if __name__ == "__main__":
    main()
