"""How often the 90 % intervals of the pattern corrections hold the error that was drawn.

    python benchmarks/pattern_corrections.py --campaigns 60 --seed 6000

The campaigns come from the generator of tests/blind, at pattern errors of 0.5 to 3 times the stated one and specimen
slopes of 3 %; the drawn error is the difference of the forces without any scatter from the model's at the true law.
"""

from __future__ import annotations

import argparse
from collections import defaultdict

from blind_cases import Case, design_for, true_corrections

import numpy as np  # after blind_cases, which says how many threads it may use  # isort: skip
from blind.direct import ingested  # isort: skip
from blind.tribometer import hide  # isort: skip

from tribo.diagnostics.fit import fit
from tribo.diagnostics.inference import pattern_corrections
from tribo.diagnostics.model import setup
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor

FACTORS = (0.5, 1.0, 1.5, 2.0, 3.0)


def held(seed: int, factor: float) -> list[bool]:
    """Whether each correction of one campaign holds its drawn error."""
    case = Case("corrections", seed, (), design_for(pattern_error=factor, specimen_slope=0.03))
    o = observe(ingested(hide(seed, [], case.design), seed))
    s = setup(o, tabled_predictor(o.patterns))
    truth = true_corrections(case, s)
    return [c.low <= truth[c.name, c.regimes[0]] <= c.high for c in pattern_corrections(fit(s))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--campaigns", type=int, default=60)
    parser.add_argument("--seed", type=int, default=6000)
    options = parser.parse_args()
    counted: dict[float, list[bool]] = defaultdict(list)
    for k in range(options.campaigns):
        factor = FACTORS[k % len(FACTORS)]
        counted[factor] += held(options.seed + k, factor)
    for factor, each in sorted(counted.items()):
        print(f"pattern error {factor:g}: {sum(each)}/{len(each)} = {100 * np.mean(each):.0f} %")
    every = [x for each in counted.values() for x in each]
    print(f"all: {sum(every)}/{len(every)} = {100 * np.mean(every):.1f} %")


if __name__ == "__main__":
    main()
