"""A whole study made from simple formulas, for the tests of figures and report.

Every force follows T = mu N + tau0 AF A with a factor per specimen and noise per pull; traces rise linearly,
peak, and slide with stick-slip that dies out. The "model" is the same law with its own factor per sample.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tribo.diagnostics.verdict import Cause, Estimate, Excluded, Gain, Layer, Misfit, NextTest, Verdict
from tribo.errors import Problem
from tribo.records import (
    REGIMES,
    Campaign,
    Comparison,
    ComparisonRow,
    Ingested,
    LawFit,
    Pattern,
    Pull,
    Regime,
    Run,
    SetAside,
    Study,
    Test,
    Trace,
)
from tribo.wording.verdict_sentences import worded

AREA_M2 = 55e-6
MASSES_kg = np.array([5, 12, 25, 50, 90, 138.5]) * 1e-3
LAW = {"static": (4.8, 23.4e3), "sliding": (2.9, 11.8e3)}  # mu, tau0 in pascal of the flat sample
PATTERNS = {
    "F": Pattern("F"),
    "A": Pattern("A", "circle", (5e-6, 5e-6), (20e-6, 20e-6)),
    "B": Pattern("B", "circle", (10e-6, 10e-6), (15e-6, 15e-6)),
    "C": Pattern("C", "circle", (15e-6, 15e-6), (20e-6, 20e-6)),
    "Sx": Pattern("S", "rectangle", (200e-6, 40e-6), (220e-6, 120e-6), True),
    "Sy": Pattern("S", "rectangle", (200e-6, 40e-6), (220e-6, 120e-6), True),
}
MODEL_FACTOR = {"F": 1.0, "A": 1.02, "B": 1.1, "C": 1.8, "Sx": 1.3, "Sy": 1.9}


def law_force(sample: str, regime: str, load_N: float, area_fraction: float, model: bool = False) -> float:
    mu, tau0 = LAW[regime]
    measured = (mu * load_N + tau0 * AREA_M2) * (0.4 + 0.6 * area_fraction)
    return measured * (MODEL_FACTOR.get(sample, 1.2) if model else 1.0)


def make_trace(name: str, static_N: float, sliding_N: float, rng: np.random.Generator, n: int) -> Trace:
    t = np.linspace(0, 21.6, n)
    rise = np.clip((t - 2) / 4, 0, 1) * static_N
    slide = sliding_N + (static_N - sliding_N) * np.exp(-(t - 6) / 0.4)
    slide = slide + 0.04 * sliding_N * np.sin(2 * np.pi * t / 0.9) * np.exp(-(t - 6) / 6)
    force = np.where(t < 6, rise, slide) + rng.normal(0, 0.004, n) + 0.01
    return Trace(name, t, force, displacement_m=2e-4 * t, metadata={"Specimen label": name})


def make_tests(samples: Sequence[str], masses_kg: np.ndarray, n_specimens: int, n_repeats: int) -> list[Test]:
    cells = [
        (sample, specimen, mass, repeat)
        for sample in samples
        for specimen in range(1, n_specimens + 1)
        for mass in masses_kg
        for repeat in range(1, n_repeats + 1)
    ]
    return [
        Test(
            test_id=f"T{k:04d}",
            file=f"raw/T{k:04d}.csv",
            sample=sample,
            specimen=f"{sample}{specimen}",
            normal_load_N=float((mass + 1.5e-3) * 9.80665),
            direction=sample[1:],
            speed_m_s=2e-4,
            hold_s=10.0,
            repeat=repeat,
            run_order=k,
            temperature_C=22.5,
            operator="op1",
            covariates={"batch": "b1"},
            row=k + 1,
        )
        for k, (sample, specimen, mass, repeat) in enumerate(cells, 1)
    ]


def make_pull(test: Test, trace: Trace, static_N: float, sliding_N: float) -> Pull:
    return Pull(
        test.test_id, "stabilised", static_N, 0.004, sliding_N, 0.002, 0.01, 0.0005, 2.0, 6.0, (10.0, 21.5),
        rise_N_per_s=static_N / 4, stick_slip_amplitude_N=0.02, stick_slip_period_s=0.9, noise_N=0.004,
        flags=("stick_slip",) if test.run_order and test.run_order % 17 == 0 else (),
    )  # fmt: skip


def fit_line(loads_N: np.ndarray, forces_N: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    design = np.column_stack([loads_N, np.full_like(loads_N, AREA_M2)])
    values, residues, *_ = np.linalg.lstsq(design, forces_N, rcond=None)
    variance = float(residues[0]) / max(len(loads_N) - 2, 1) if len(residues) else 1e-6
    return values, variance * np.linalg.inv(design.T @ design)


def make_fit(sample: str, regime: Regime, table: pd.DataFrame, method: str, dof: float) -> LawFit:
    values, covariance = fit_line(table["normal_load_N"].to_numpy(float), table[f"{regime}_N"].to_numpy(float))
    n_specimens = table["specimen"].nunique() if "specimen" in table else 0
    return LawFit(
        sample, regime, "mu_tau0", ("mu", "tau0_Pa"), values, covariance * 4, dof, n_specimens, len(table),
        method, 1.1, AREA_M2,
    )  # fmt: skip


def make_simulated(campaign: Campaign, samples: Sequence[str]) -> pd.DataFrame:
    rng = np.random.default_rng(7)
    rows = [
        {
            "sample": sample,
            "pressure_Pa": p,
            "normal_load_N": p * AREA_M2,
            "angle_deg": angle,
            "seed": 1,
            "static_N": law_force(sample, "static", p * AREA_M2, campaign.area_fraction(sample), True)
            * rng.normal(1, 0.01),
            "sliding_N": law_force(sample, "sliding", p * AREA_M2, campaign.area_fraction(sample), True)
            * rng.normal(1, 0.005),
        }
        for sample in samples
        for p in (2e3, 5e3, 10e3, 25e3)
        for angle in (9.0, 45.0, 81.0)
    ]
    return pd.DataFrame(rows)


def make_run(sample: str, area_fraction: float) -> Run:
    t = np.linspace(0, 20e-3, 4001)
    load_N = 9185.82 * (85 * 5e-6) ** 2
    scale = (0.4 + 0.6 * area_fraction) * load_N
    force = np.where(t < 6e-3, 7 * t / 6e-3, 4 + 3 * np.exp(-(t - 6e-3) / 5e-4) * np.cos(9e3 * (t - 6e-3)))
    moving = np.where(t < 6e-3, 0, 7000)
    return Run(
        sample, 9185.82, 45.0 if area_fraction == 1 else -7.8, 1, t,
        force * scale, moving, load_N, 7.0, 4.0, 6e-3, (8e-3, 20e-3), "fast",
        {"dt_s": 5e-8, "area_fraction": area_fraction, **drawn_pattern(sample)},
    )  # fmt: skip


def drawn_pattern(sample: str) -> dict[str, object]:
    """What a run says about its lattice and its pattern."""
    pattern = PATTERNS.get(sample, Pattern(sample, "square", (6e-6, 6e-6), (12e-6, 12e-6)))
    return {
        "blocks": (85, 85), "spacing_m": 5e-6, "cavity": pattern.cavity, "cavity_size_m": pattern.size_m or 0.0,
        "cavity_pitch_m": pattern.pitch_m or 0.0, "cavity_staggered": pattern.staggered,
    }


def compare(
    campaign: Campaign, samples: Sequence[str], fits: Sequence[LawFit], simulated: Sequence[LawFit]
) -> Comparison:
    loads = sorted({t.normal_load_N for t in campaign.tests})
    by_key = {(f.sample, f.regime): f for f in simulated}
    rows = [
        ComparisonRow(
            fit.sample, fit.regime, load, float(fit.force_N(load)), float(fit.force_u_N(load)),
            float(by_key[fit.sample, fit.regime].force_N(load)),
            float(by_key[fit.sample, fit.regime].force_u_N(load)),
        )
        for fit in fits
        for load in loads
    ]  # fmt: skip
    calibration = {"mu_s_mean": 5.5, "mu_d_mean": 2.9, "F_as_Pa": 23.45e3}
    return Comparison(tuple(simulated), tuple(rows), calibration, samples[0])


def make_ingested(samples: Sequence[str], n_specimens: int, n_repeats: int, n_samples: int, seed: int) -> Ingested:
    rng = np.random.default_rng(seed)
    patterns = {s: PATTERNS.get(s, Pattern(s, "square", (6e-6, 6e-6), (12e-6, 12e-6))) for s in samples}
    tests = make_tests(samples, MASSES_kg, n_specimens, n_repeats)
    traces, pulls = {}, {}
    specimen_factor = {t.specimen: rng.normal(1, 0.03) for t in tests}
    for test in tests:
        factor = specimen_factor[test.specimen] * rng.normal(1, 0.02)
        af = patterns[test.sample].area_fraction
        static_N = law_force(test.sample, "static", test.normal_load_N, af) * factor
        sliding_N = law_force(test.sample, "sliding", test.normal_load_N, af) * factor
        traces[test.test_id] = make_trace(test.test_id, static_N, sliding_N, rng, n_samples)
        pulls[test.test_id] = make_pull(test, traces[test.test_id], static_N, sliding_N)
    aside = (
        SetAside("T9001", "excluded by hand: <wire> slipped & \"came\" off"),
        SetAside(
            tests[-1].test_id, "the file ends in the middle of a row",
            (Problem("truncated", "the last row is cut", file=tests[-1].file, row=601),),
        ),
    )  # fmt: skip
    del traces[tests[-1].test_id], pulls[tests[-1].test_id]
    campaign = Campaign(
        "Patterned PDMS on polycarbonate <synthetic>", Path("campaign"), AREA_M2, tuple(tests), patterns,
        "PDMS", "polycarbonate", 1.5e-3, 2e-4, aside[:1],
    )  # fmt: skip
    return Ingested(campaign, traces, pulls, aside)


def make_study(
    samples: Sequence[str] = tuple(PATTERNS),
    n_specimens: int = 3,
    n_repeats: int = 1,
    n_samples: int = 300,
    seed: int = 1,
) -> Study:
    """A study of these samples; the first one is the flat one. Test T9001 and the last test are set aside."""
    ingested = make_ingested(samples, n_specimens, n_repeats, n_samples, seed)
    table = ingested.table()
    simulated = make_simulated(ingested.campaign, samples)
    pairs = [(s, r) for s in samples for r in REGIMES]
    fits = [make_fit(s, r, table[table["sample"] == s], "specimens", n_specimens - 1.0) for s, r in pairs]
    other = [make_fit(s, r, table[table["sample"] == s], "mixedlm", n_specimens - 1.0) for s, r in pairs]
    model = [make_fit(s, r, simulated[simulated["sample"] == s], "ensemble", 10.0) for s, r in pairs]
    runs = tuple(make_run(s, ingested.campaign.area_fraction(s)) for s in samples)
    comparison = compare(ingested.campaign, samples, fits, model)
    beside = {t.sample: t.test_id for t in ingested.campaign.tests if t.test_id in ingested.traces}
    recorded = {i: (ingested.traces[i], ingested.pulls[i], {}) for i in beside.values()}
    return Study(
        ingested, tuple(fits), tuple(other), comparison, simulated, runs, recorded, notes=("a note of the study",)
    )  # fmt: skip


def verdict_of(plain: Mapping[str, Any]) -> Verdict:
    """A worded verdict with the numbers and texts of one in the form of verdict.json."""

    def number(value: float | None) -> float:
        return math.nan if value is None else float(value)

    def estimates(of: Mapping[str, Any]) -> dict[str, Estimate]:
        return {
            name: Estimate(number(e["value"]), number(e["low"]), number(e["high"]), e["unit"])
            for name, e in (of.get("parameters") or {}).items()
        }

    def layer(of: Mapping[str, Any]) -> Layer:
        lists = {name: tuple(of.get(name) or ()) for name in ("samples", "regimes", "tied_with")}
        numbers = {name: number(of.get(name)) for name in ("p_adjusted", "effect_percent", "low", "high")}
        texts = {name: of.get(name, "") for name in ("formula", "text", "at", "choice")}
        return Layer(of["kind"], of["name"], parameters=estimates(of), **lists, **numbers, **texts)

    test = plain.get("next_test")
    given = Verdict(
        plain["verdict"],
        misfits=tuple(Misfit(**m) for m in plain.get("misfits") or ()),
        causes=tuple(
            Cause(c["mechanism"], c["weight"], estimates(c), c["text"]) for c in plain.get("causes") or ()
        ),
        equivalent=tuple(map(tuple, plain.get("equivalent") or ())),
        excluded=tuple(
            Excluded(e["mechanism"], "explains less", 4.0) for e in plain.get("excluded") or ()
        ),
        not_testable=tuple(Excluded(e["mechanism"], "not varied") for e in plain.get("not_testable") or ()),
        layers=tuple(map(layer, plain.get("layers") or ())),
        gain=Gain(**plain["gain"]) if plain.get("gain") else None,
        model=plain.get("model") or {},
        shows=plain.get("shows"),
    )
    said = worded(given)
    if not test:
        return said
    return replace(said, next_test=NextTest("measure", tuple(test["separates"]), test["design"], text=test["text"]))
