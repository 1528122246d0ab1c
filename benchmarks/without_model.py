"""How often the diagnosis without the spring-block model names something where nothing is hidden, and what it finds.

    python benchmarks/without_model.py [--seeds 40] [--first 0]

Every campaign has three flat samples of two specimens each, five loads, three repeats of each load in random order, one
of three laws for each sample, a gain for each specimen (4 %), scatter of 3 % with heavy tails (t, 4 degrees of
freedom), and columns of speed, temperature, run order, operator and date. The law, the sizes and the forms are written
here and share no code with tribo.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import tribo
from tribo.stages import diagnosis_without_model

LOADS = (0.5, 1.0, 2.0, 4.0, 8.0)
HIDDEN = {
    "nothing": lambda row: 0.0,
    "speed": lambda row: 0.05 * np.log(row["speed_mm_s"]) * row["slides"],
    "temperature": lambda row: 0.01 * (row["temperature_C"] - 23.0),
    "operator": lambda row: 0.08 * (row["operator"] == "Bo"),
    "step of temperature": lambda row: 0.1 * (row["temperature_C"] > 25.0),
}
EXPECTED = {
    "nothing": set(), "speed": {"velocity_dependence"}, "temperature": {"temperature"},
    "operator": {"covariate:operator"}, "step of temperature": {"temperature"},
}  # fmt: skip


def rows(seed: int, hidden: str) -> Iterator[dict[str, object]]:
    """The tests of one campaign."""
    rng = np.random.default_rng(seed)
    laws = (lambda n: 0.3 * n + 0.4, lambda n: 0.5 * n**0.75, lambda n: 0.25 * n)
    plan = [(s, k, n) for s in range(3) for k in range(2) for n in LOADS for _ in range(3)]
    order = rng.permutation(len(plan))
    gains = rng.normal(0.0, 0.04, (3, 2))
    for place, at in enumerate(order):
        s, k, load = plan[at]
        row: dict[str, object] = {
            "test_id": f"T{place + 1:03d}", "sample": f"S{s}", "specimen": f"S{s}-{k}", "normal_load_N": load,
            "speed_mm_s": float(rng.choice([0.1, 1.0, 10.0])), "run_order": place + 1,
            "temperature_C": round(23.0 + 3.0 * np.sin(place / 9.0) + rng.normal(0.0, 1.0), 2),
            "operator": str(rng.choice(["Ann", "Bo"])), "started_at": f"2026-01-{1 + place // 30:02d}",
        }  # fmt: skip
        both = gains[s, k] + 0.03 * rng.standard_t(4)
        for name, slides, factor in (("static_N", 0.0, 1.2), ("sliding_N", 1.0, 1.0)):
            change = HIDDEN[hidden]({**row, "slides": slides})
            scatter = both + 0.02 * rng.standard_t(4)
            row[name] = f"{factor * laws[s](load) * np.exp(change + scatter):.6g}"
        yield row


def campaign(folder: Path, seed: int, hidden: str) -> Path:
    """A campaign of forces that were evaluated elsewhere."""
    tests = list(rows(seed, hidden))
    lines = [",".join(tests[0]), *(",".join(map(str, row.values())) for row in tests)]
    (folder / "tests.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    samples = "".join(f'[patterns.S{s}]\ncavity = "none"\n' for s in range(3))
    (folder / "campaign.toml").write_text(f'[campaign]\ntitle = "made"\n{samples}', encoding="utf-8")
    return folder


def named(seed: int, hidden: str) -> set[str]:
    """What the diagnosis names."""
    with tempfile.TemporaryDirectory() as folder:
        made = tribo.load_campaign(campaign(Path(folder), seed, hidden))
        study = tribo.study(made, tribo.StudyOptions(no_model=True))
        return {cause.mechanism for cause in diagnosis_without_model(study, seed=seed).verdict.causes}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    print("hidden,campaigns,named,missed,wrong")
    for hidden, expected in EXPECTED.items():
        found = [named(seed, hidden) for seed in range(given.first, given.first + given.seeds)]
        right = sum(expected <= causes for causes in found) if expected else 0
        wrong = sum(bool(causes - expected) for causes in found)
        print(f"{hidden},{len(found)},{right},{len(found) - right if expected else 0},{wrong}", flush=True)


if __name__ == "__main__":
    main()
