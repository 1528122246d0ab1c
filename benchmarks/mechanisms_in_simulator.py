"""How far the quick law of each mechanism lies from the simulator with the mechanism in it.

    python benchmarks/mechanisms_in_simulator.py docs/data/mechanisms-in-simulator.csv

Start amplitudes, five cases of sample and pressure, lattices of 25 x 25 blocks (45 x 45 for S), dt 1e-7 s; about a
minute of one core. Cases that the file holds already are not run again; a number after its name runs so many at
most. ``off_*_percent`` is simulated over quick T, ``change_*_percent`` what the law expects.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Base
from tribo.mechanisms_in_model import RECORDED, SIMULATED, conditions_of_run, simulate_with
from tribo.springblock import SimConfig, simulate

CASES = (("F", 8e3, 20.0), ("B", 4e3, 20.0), ("B", 16e3, 20.0), ("C", 8e3, 20.0), ("Sx", 8e3, 5.0))
GIVEN = {"humidity_pct": 58.0, "hold_s": 100.0, "temperature_C": 25.0, "speed_m_s": 8e-4, "specimen_run": 2.0}
REGIMES = ("static_friction", "sliding_friction")


def law_of(config: SimConfig, load_N: float) -> tuple[float, float, float, float]:
    """Static mu and tau0 A, sliding mu and tau0 A, of the simulated sample around its pressure."""
    light, here, heavy = (simulate(config.with_(pressure_Pa=config.pressure_Pa * f)) for f in (0.8, 1.0, 1.25))
    found = []
    for regime in REGIMES:
        mu = (1.25 * getattr(heavy, regime) - 0.8 * getattr(light, regime)) / 0.45
        found += [mu, (getattr(here, regime) - mu) * load_N]
    return found[0], found[1], found[2], found[3]


def case_rows(sample: str, pressure_Pa: float, angle_deg: float) -> list[dict[str, object]]:
    """One row a mechanism."""
    blocks = (45, 45) if sample.startswith("S") else (25, 25)
    config = SimConfig(sample=sample, pressure_Pa=pressure_Pa, angle_deg=angle_deg, blocks=blocks, seed=3, dt_s=1e-7)
    before = simulate(config)
    load = conditions_of_run(config, GIVEN).normal_load_N
    clip = before.static_friction * load * 0.5 / RECORDED["samples_in_rise"]
    conditions = replace(conditions_of_run(config, GIVEN), clip_N=clip)
    other = "C" if sample != "C" else "F"
    laws = {s: law_of(config.with_(sample=s), float(load[0])) for s in dict.fromkeys((sample, other, "F"))}
    base = Base(*(np.array([v]) for v in laws[sample]), by_sample=laws, flat="F")
    rows = []
    for name in SIMULATED:
        m = MECHANISMS[name]
        key = f"{name}({other})" if name == "mislabelled_specimen" else name
        choice = {
            "pattern_geometry": sample[0], "covariate": "column is this",
            "mislabelled_specimen": f" of {sample} behaves as {other}",
        }.get(name, "")  # fmt: skip
        run = simulate_with(config, {key: m.start()}, **GIVEN)
        forces = m.law(m.start(), base, conditions, choice)
        row: dict[str, object] = {"mechanism": name, "sample": sample, "pressure_kPa": pressure_Pa / 1e3}
        for regime, quick_N in zip(REGIMES, (forces.static_N[0], forces.sliding_N[0]), strict=True):
            word, quick = regime.split("_")[0], quick_N / load[0]
            row[f"change_{word}_percent"] = 100 * (quick / getattr(before, regime) - 1)
            row[f"off_{word}_percent"] = 100 * (getattr(run, regime) / quick - 1)
        rows.append(row | {"stated_error_percent": 100 * m.quick_error})
    return rows


def main(path: Path, most: int = len(CASES)) -> None:
    tables = [pd.read_csv(path)] if path.exists() else []
    known = {(r["sample"], 1e3 * r["pressure_kPa"]) for t in tables for r in t.to_dict("records")}
    for case in [c for c in CASES if c[:2] not in known][:most]:
        tables.append(pd.DataFrame(case_rows(*case)).round(3))
        pd.concat(tables).to_csv(path, index=False)
    table = pd.concat(tables)
    worst = table.groupby("mechanism")[["off_static_percent", "off_sliding_percent"]].agg(lambda x: x.abs().max())
    print(worst.join(table.groupby("mechanism")["stated_error_percent"].first()).round(2).to_string())


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:]))
