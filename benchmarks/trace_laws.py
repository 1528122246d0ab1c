"""How often the intervals of laws read from traces hold, and how often the right law is chosen.

Virtual records come from ``tests/support/virtual_slips.py``, which shares nothing with the code that reads them. Every
record draws its own law, machine and noise::

    python benchmarks/trace_laws.py run --count 250 -o rows.jsonl       # of each law; continues rows.jsonl
    python benchmarks/trace_laws.py table rows.jsonl

Rows are appended one by one; a stopped exam goes on where it ended. Seeds of records: 26000 + number.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.virtual_slips import ladder, slips, velocity_step

from tribo.slider import speed_steps
from tribo.tracelaws import (
    FEWEST_SLIPS,
    SLIP_LAWS,
    SPEED_LAWS,
    STEP_LAWS,
    at_rest,
    chosen_step_laws,
    fit_rests,
    fit_slips,
    fit_speeds,
    fit_steps,
    unbeaten,
)
from tribo.traces.events import slips_of

OVER_RESTS = {"coulomb over rests": "coulomb", "ageing over rests": "ageing"}
TRUTHS = ("coulomb", "ageing", "dieterich", "ruina", "stribeck", "viscous", "constant", "logarithmic", *OVER_RESTS)


def slip_record(rng: np.random.Generator, truth: str):
    """A record of about 70 slips at 1 kHz, and its truth."""
    load, mass = float(rng.uniform(0.1, 3.0)), float(10 ** rng.uniform(-2, -0.5))
    mu_s = float(rng.uniform(0.3, 0.6))
    drop = mu_s * float(rng.uniform(0.08, 0.25))
    swing = float(rng.uniform(0.03, 0.12))
    stiffness = mass * (2 * math.pi / swing) ** 2
    damping = 2 * float(rng.uniform(0.02, 0.25)) * math.sqrt(stiffness * mass)
    period = float(rng.uniform(4.0, 12.0)) * swing
    speed = 2 * drop * load / (stiffness * period)
    b = float(rng.uniform(0.05, 0.3)) * drop if truth == "ageing" else 0.0
    mu_0 = mu_s - b * math.log(period / 1e-3)
    given = {
        "mass_kg": mass, "stiffness": stiffness, "damping": damping, "load_N": load, "speed_m_s": speed, "mu_s": mu_0,
        "mu_d": mu_s - drop, "b": b, "scatter": float(rng.uniform(0.03, 0.15)) * drop, "duration_s": 70 * period,
        "rate_Hz": 1000.0, "noise_N": float(rng.uniform(0.003, 0.02)) * drop * load,
    }  # fmt: skip
    t, force = slips(rng, **given)
    first = int(np.argmax(force > (mu_s - drop) * load))  # loading from a slack spring is no part of stick-slip
    record = t[first:], force[first:]
    known = {"mu_d": mu_s - drop, "stiffness_N_per_m": stiffness, "mass_kg": mass, "damping_N_s_per_m": damping}
    known |= {"mu_s": mu_0} if truth == "coulomb" else {"mu_s_after_1_s": mu_0 + b * math.log(1e3), "b": b}
    return record, known, (load, speed)


def rest_records(rng: np.random.Generator, truth: str):
    """Five to eight records of about 25 slips at 1 kHz, at speeds over a factor of six to twenty, and their truth.

    Each record has a static friction of its own, as far off as a twentieth of a drop.
    """
    load, mass = float(rng.uniform(0.1, 3.0)), float(10 ** rng.uniform(-2, -0.5))
    mu_s, swing = float(rng.uniform(0.3, 0.6)), float(rng.uniform(0.03, 0.12))
    drop = mu_s * float(rng.uniform(0.08, 0.25))
    stiffness = mass * (2 * math.pi / swing) ** 2
    damping = 2 * float(rng.uniform(0.02, 0.25)) * math.sqrt(stiffness * mass)
    periods = swing * np.geomspace(4.0, 4.0 * float(rng.uniform(6.0, 20.0)), int(rng.integers(5, 9)))
    b = float(rng.uniform(0.02, 0.1)) * drop if OVER_RESTS[truth] == "ageing" else 0.0
    mu_0 = mu_s - b * math.log(periods[0] / 1e-3)
    given = {"mass_kg": mass, "stiffness": stiffness, "damping": damping, "load_N": load, "mu_d": mu_s - drop, "b": b,
             "scatter": float(rng.uniform(0.03, 0.15)) * drop, "rate_Hz": 1000.0,
             "noise_N": float(rng.uniform(0.003, 0.02)) * drop * load}  # fmt: skip
    off = float(rng.uniform(0.0, 0.05)) * drop * rng.standard_normal(periods.size)
    means = []
    for period, away in zip(periods, off, strict=True):
        speed = 2 * drop * load / (stiffness * period)
        t, force = slips(rng, **given, mu_s=mu_0 + away, speed_m_s=speed, duration_s=(mu_s / drop + 25) * period)
        found = slips_of(t, force, speed_m_s=speed)[1:]
        if len(found) >= FEWEST_SLIPS:
            means.append(at_rest(found, load))
    known = {"mu_s": mu_s} if b == 0.0 else {"mu_s_after_1_s": mu_0 + b * math.log(1e3), "b": b}
    return np.array(means).reshape(-1, 2).T, known


def step_record(rng: np.random.Generator, truth: str):
    """A tenfold or threefold step of speed at 10 Hz, and its truth."""
    a = float(rng.uniform(0.004, 0.012))
    b = a + float(rng.uniform(-0.003, 0.004))
    Dc = float(10 ** rng.uniform(math.log10(3e-6), math.log10(4e-5)))
    stiffness = (1.5 if truth == "dieterich" else 5.0) * float(10 ** rng.uniform(0, 0.8)) * max(b - a, 0.001) / Dc
    speeds = (1e-6, float(rng.choice([3e-6, 1e-5])))
    noise = float(10 ** rng.uniform(-4, -3.3))
    drift = float(rng.normal(0.0, 3.0))
    record = velocity_step(
        rng, ageing=truth == "dieterich", a=a, b=b, Dc_m=Dc, stiffness_per_m=stiffness, mu0=0.6, speeds_m_s=speeds,
        step_s=80.0, duration_s=80.0 + 1e-3 / speeds[1], rate_Hz=10.0, noise=noise, drift_per_m=drift,
    )  # fmt: skip
    known = {"a": a, "b": b, "a_minus_b": a - b, "Dc_m": Dc, "stiffness_per_m": stiffness}
    return record, known, (speed_steps([0.0, 80.0], list(speeds)), noise)


def speed_record(rng: np.random.Generator, truth: str):
    """Six to ten speeds over two to four decades, up and down; means over the last three quarters of each stretch."""
    count, decades = int(rng.integers(6, 11)), float(rng.uniform(2.0, 4.0))
    lowest = float(10 ** rng.uniform(-6, -4))
    up = np.geomspace(lowest, lowest * 10**decades, count)
    speeds = np.concatenate([up, up[::-1]])
    mu_d = float(rng.uniform(0.1, 0.5))
    size = float(rng.uniform(0.1, 0.5)) * mu_d  # by which friction changes over the ladder
    v_s = float(lowest * 10 ** (decades * rng.uniform(0.25, 0.75)))
    known = {"mu_d": mu_d}
    friction = np.full(speeds.size, mu_d)
    if truth == "logarithmic":
        per = size / math.log(speeds.max() / lowest)
        friction = mu_d + per * np.log(speeds)
        known = {"mu_at_1_m_s": mu_d, "per_e_fold": per}
    elif truth != "constant":
        viscous = size / speeds.max() * float(rng.uniform(0.2, 1.0))
        friction = friction + viscous * speeds
        known["viscous_s_per_m"] = viscous
    if truth == "stribeck":
        friction = friction + size * np.exp(-speeds / v_s)
        known |= {"mu_s": mu_d + size, "v_s_m_s": v_s}
    _, mu = ladder(rng, speeds, friction, scatter=float(rng.uniform(0.02, 0.12)) * size, noise=0.1 * size)
    return (speeds, mu.reshape(speeds.size, -1)[:, mu.size // speeds.size // 4 :].mean(axis=1)), known


def examined(truth: str, number: int) -> dict:
    """One record: what was fitted under its own law beside the truth, and which laws were chosen."""
    rng = np.random.default_rng([26000 + number, TRUTHS.index(truth)])
    began = time.process_time()
    if truth in SLIP_LAWS:
        (t, force), known, (load, speed) = slip_record(rng, truth)
        made = fit_slips(t, force, SLIP_LAWS, load, speed)
        if not made:
            return {"truth": truth, "number": number, "chosen": []}
        chosen = [law.law for law in unbeaten(made)]
    elif truth in OVER_RESTS:
        (hold, mu), known = rest_records(rng, truth)
        made = [law for law in (fit_rests(hold, mu, one) for one in SLIP_LAWS) if law is not None]
        if not made:
            return {"truth": truth, "number": number, "chosen": []}
        chosen = [law.law for law in unbeaten(made)]
    elif truth in SPEED_LAWS:
        (speeds, mu), known = speed_record(rng, truth)
        made = [fit_speeds(speeds, mu, law) for law in SPEED_LAWS]
        chosen = [law.law for law in unbeaten(made)]
    else:
        (t, mu), known, (drive, noise) = step_record(rng, truth)
        known["noise"] = noise
        made = fit_steps(t, mu, STEP_LAWS, drive)
        chosen = [law.law for law in chosen_step_laws(made)]
    own = next(law for law in made if law.law == OVER_RESTS.get(truth, truth))
    rows = {p.name: [known[p.name], p.value, p.low, p.high, bool(p.told)] for p in own.parameters if p.name in known}
    return {"truth": truth, "number": number, "chosen": chosen, "cpu_s": time.process_time() - began, "rows": rows}


def table(rows: list[dict]) -> str:
    """Coverage, share that can be told, median error, and the choice of law, by law and parameter."""
    lines = ["| law | parameter | records | told | 95 % interval holds | median error |", "|---|---|---|---|---|---|"]
    choices = ["| law | records | right law alone | tied | wrong | read as nothing |", "|---|---|---|---|---|---|"]
    for truth in TRUTHS:
        of = [row for row in rows if row["truth"] == truth]
        if not of:
            continue
        for name in {name: None for row in of for name in row.get("rows", {})}:
            found = [row["rows"][name] for row in of if name in row.get("rows", {})]
            told = [r for r in found if r[4]]
            inside = sum(r[2] <= r[0] <= r[3] for r in told)
            share = f"{100 * inside / len(told):.1f} % ({inside} of {len(told)})" if told else "-"
            error = f"{100 * np.median([abs(r[1] / r[0] - 1) for r in told]):.2f} %" if told else "-"
            seen = f"{100 * len(told) / len(found):.0f} %"
            lines.append(f"| {truth} | `{name}` | {len(found)} | {seen} | {share} | {error} |")
        right = OVER_RESTS.get(truth, truth)
        alone = sum(row["chosen"] == [right] for row in of)
        tied = sum(right in row["chosen"] and len(row["chosen"]) > 1 for row in of)
        nothing = sum(not row["chosen"] for row in of)
        choices.append(f"| {truth} | {len(of)} | {alone} | {tied} | {len(of) - alone - tied - nothing} | {nothing} |")
    return "\n".join([*lines, "", *choices])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["run", "table"])
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--count", type=int, default=250)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--laws", nargs="+", choices=TRUTHS, default=TRUTHS)
    given = parser.parse_args()
    file = given.file or given.out
    kept = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    if given.what == "table":
        print(table(kept))
        return
    warnings.simplefilter("ignore")
    done = {(row["truth"], row["number"]) for row in kept}
    with file.open("a") as out:
        for number in range(given.first, given.first + given.count):
            for truth in given.laws:
                if (truth, number) not in done:
                    out.write(json.dumps(examined(truth, number)) + "\n")
                    out.flush()


if __name__ == "__main__":
    main()
