"""Hostile inputs of five kinds, drawn at random by hypothesis: each is read as what it says, or refused with sentences.

    python benchmarks/torture_inputs.py [--cases 2000] [--seed 1] [--kinds tests.csv zip ...]

The cases and the checks are those of tests/hostile_inputs.py, which says what counts as read as it is. A case fails as

- traceback: an exception other than a refusal;
- hang: more than 20 s of processor time, or more than 120 s in all;
- different: accepted, and not what an independent reading of the input says.

Exit status 1 if a case failed.
"""

from __future__ import annotations

import argparse
import signal
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings, strategies as st

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
import hostile_inputs as hostile  # noqa: E402

from tribo import stages  # noqa: E402
from tribo.campaign import load_campaign  # noqa: E402
from tribo.records import Ingested  # noqa: E402

PROCESSOR_S, WALL_S = 20, 120
MOST_SHOWN = 5
Check = Callable[[Any, Path], str]


class HangError(BaseException):
    """A case took too long."""


def stop(number: int, frame: FrameType | None) -> None:
    raise HangError


def example() -> Ingested:
    """The bundled campaign, read; its decisions by hand are what overrides.csv is about."""
    from tribo.files import data_dir

    return stages.ingest(load_campaign(data_dir() / "example"))


def kinds() -> dict[str, Callable[[], Check]]:
    def overrides() -> Check:
        ingested = example()
        return lambda draw, folder: hostile.check_overrides(draw, folder, ingested)

    return {
        "tests.csv": lambda: hostile.check_tests_csv,
        "campaign.toml": lambda: hostile.check_campaign_toml,
        "overrides.csv": overrides,
        "design": lambda: hostile.check_design,
        "zip": lambda: hostile.check_zip,
    }


def one(check: Check, draw: Any, failures: list[str]) -> str:
    """The outcome of one case; its failure as text goes to ``failures``."""
    signal.setitimer(signal.ITIMER_PROF, PROCESSOR_S)
    signal.alarm(WALL_S)
    try:
        with tempfile.TemporaryDirectory() as folder:
            return check(draw, Path(folder))
    except hostile.DifferentError as why:
        failures.append(f"different: {why}")
        return "different"
    except HangError:
        failures.append(f"hang: {traceback.format_exc()}")
        return "hang"
    except Exception:
        failures.append(traceback.format_exc())
        return "traceback"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.alarm(0)


def run(check: Check, cases: int, first: int) -> tuple[Counter[str], list[str]]:
    """So many cases of one kind: how often each outcome came, and the failures as text."""
    outcomes: Counter[str] = Counter()
    failures: list[str] = []

    @seed(first)
    @settings(
        max_examples=cases, database=None, deadline=None, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(st.data())
    def drawn(data: Any) -> None:
        outcomes[one(check, data.draw, failures)] += 1

    drawn()
    return outcomes, failures


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="*", default=list(kinds()))
    given_options = parser.parse_args()
    signal.signal(signal.SIGPROF, stop)
    signal.signal(signal.SIGALRM, stop)
    columns = ("same", "changed", "in part", "refused", "traceback", "hang", "different")
    print("| kind | cases |", " | ".join(columns), "|", flush=True)
    failed = False
    for kind in given_options.kinds:
        outcomes, failures = run(kinds()[kind](), given_options.cases, given_options.seed)
        counts = " | ".join(str(outcomes[c]) for c in columns)
        print(f"| {kind} | {sum(outcomes.values())} | {counts} |", flush=True)
        for failure in failures[:MOST_SHOWN]:
            print(failure, file=sys.stderr, flush=True)
        failed |= bool(failures)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
