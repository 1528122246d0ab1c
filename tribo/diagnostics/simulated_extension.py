"""The extended model simulated for a campaign: runs with and without the named mechanisms, test by test.

The diagnosis finds a mechanism by its law; here the mechanism acts on the blocks. Pairs of runs share local friction,
angle and load, so that their ratio is the effect of the mechanism alone. The local friction is that of the flat law of
the extended fit. Every sample is pulled at a low, a middle and a high load, under the conditions of the test at that
load that the law changes most.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tribo.diagnostics.diagnosis import Diagnosis
from tribo.diagnostics.effect_sizes import rms_percent
from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.model import effect_of
from tribo.diagnostics.predictor import flat_law
from tribo.diagnostics.verdict import CERTAIN_CAUSES
from tribo.errors import SimulationError
from tribo.mechanisms.record import Values
from tribo.mechanisms_in_model import simulate_pair
from tribo.records import FloatArray, Run
from tribo.springblock.config import PAPER, LocalFriction, SimConfig
from tribo.springblock.ensemble import angle_range_deg, run_seed

if TYPE_CHECKING:
    import pandas as pd


DT_S = 1e-7  # pairs of runs share their step, so that its error cancels
LEAST_CHANGE = 0.01  # of ln T; the ratio of simulated to quick change would be noise below
MOST_LOADS = 3  # the effect is smooth in the load: more are interpolated
LONG_PEAKS = 2.2  # length of a run in peak times
MOST_CHANGE = 1.2  # of ln T; beyond it hardly any force was there before, and a ratio says nothing
Progress = Callable[[str, int, int], None]
STAGE = "simulating the extended model"


def simulate_extension(
    model: ModelFit, *, seed: int = 0, jobs: int = 2, progress: Progress | None = None
) -> tuple[FloatArray, pd.DataFrame] | str:
    """The model of a campaign with its mechanisms in the simulator, or the reason why it was not simulated.

    Returns ln T of every test (n, 2) by the model with the simulated effect, and a table with one row a pair of runs.

    Parameters
    ----------
    model : the fit with the named mechanisms
    seed : draws the local friction, equal in both runs of a pair
    jobs : threads
    """
    each = zip(model.acting, model.values, strict=True)
    quick = sum((effect_of(model.setup, model.law, a, v) for a, v in each), np.zeros_like(model.residual))
    picked = representatives(model, quick)
    if not picked:
        bounds = f"{100 * np.expm1(LEAST_CHANGE):.0f} and {100 * np.expm1(MOST_CHANGE):.0f} %"
        return f"no test has a change of T between {bounds}"
    runs = []
    try:
        with ThreadPoolExecutor(max(1, jobs)) as pool:
            for both in pool.map(lambda test: simulate_pair(*_pair(model, test, seed)), picked):
                runs.append(both)
                if progress is not None:
                    progress(STAGE, len(runs), len(picked))
    except SimulationError as why:
        return "; ".join(str(problem) for problem in why.problems)
    table = _table(model, picked, quick, runs)
    return model.predicted - quick + interpolated(model, picked, table, quick), table


def representatives(model: ModelFit, quick: FloatArray) -> list[int]:
    """Tests to simulate: the most moved of every sample at up to MOST_LOADS of its loads, evenly over the logarithm of
    their range; equal loads are one level."""
    c = model.setup.observations.conditions
    levels = np.unique(np.round(c.normal_load_N, 6))
    loads = levels[np.abs(np.log(c.normal_load_N[:, None] / levels)).argmin(axis=1)]
    size = np.abs(quick[:, leading(quick)])
    tests = []
    for sample in np.unique(c.sample):
        usable = (c.sample == sample) & (np.abs(quick) < MOST_CHANGE).all(axis=1) & (size > LEAST_CHANGE)
        few = np.unique(loads[usable])
        if len(few) > MOST_LOADS:
            wanted = np.geomspace(few[0], few[-1], MOST_LOADS)
            few = np.unique(few[np.abs(np.log(few[:, None] / wanted)).argmin(axis=0)])
        for load in few:
            rows = np.flatnonzero(usable & (loads == load))
            tests.append(int(rows[np.argmax(size[rows])]))
    return tests


def leading(quick: FloatArray) -> int:
    """The regime that the effect moves more: 0 static, 1 sliding."""
    return int(np.argmax(np.abs(quick).mean(axis=0)))


def _pair(model: ModelFit, test: int, seed: int) -> tuple[SimConfig, dict[str, Values], dict[str, float]]:
    """The run of one test, the mechanisms as they act on it, and its recorded conditions."""
    o = model.setup.observations
    c = o.conditions
    sample, pressure = str(c.sample[test]), float(c.pressure_Pa[test])
    low, high = angle_range_deg(sample, o.patterns[sample])
    own = run_seed(seed, sample, pressure, 0)
    angle = float(np.random.default_rng(own).uniform(low, high)) if (low, high) == (0.0, 90.0) else (low + high) / 2
    config = SimConfig(
        sample=sample, pattern=o.patterns[sample], pressure_Pa=pressure, angle_deg=angle, seed=own,
        friction=local_friction(model.law), dt_s=DT_S, duration_peaks=LONG_PEAKS,
    )  # fmt: skip
    at_work: dict[str, Values] = {}
    for acting, values in zip(model.acting, model.values, strict=True):
        here = acting.mechanism.choosing.on_test(values, acting.choice, c, test)
        if here is not None:  # the choice concerns this test
            name, (of_test, other_sample) = acting.mechanism.name, here
            at_work[f"{name}({other_sample})" if other_sample else name] = of_test
    known = {
        "hold_s": c.hold_s, "specimen_run": c.specimen_run, "temperature_C": c.temperature_C,
        "humidity_pct": c.humidity_pct, "speed_m_s": c.speed_m_s, "elapsed_s": c.elapsed_s, "run_order": c.run_order,
    }  # fmt: skip
    recorded = {name: float(values[test]) for name, values in known.items() if np.isfinite(values[test])}
    return config, at_work, recorded | {"nominal_area_m2": c.nominal_area_m2}


def local_friction(law: FloatArray) -> LocalFriction:
    """Local friction whose flat sample follows the law (mu, tau0 in kPa, static and sliding): all scales are linear."""
    mu_s, static, mu_d, sliding = np.asarray(law) / np.asarray(flat_law())
    return LocalFriction(
        PAPER.mu_s * mu_s, PAPER.mu_s_sd * mu_s, PAPER.mu_d * mu_d, PAPER.mu_d_sd * mu_d,
        PAPER.static_adhesion_Pa * static, PAPER.sliding_adhesion_Pa * sliding,
    )  # fmt: skip


def _table(
    model: ModelFit, tests: Sequence[int], quick: FloatArray, runs: Sequence[tuple[Run, Run]]
) -> pd.DataFrame:
    """A row a pair: the test it stands for, T/N before and after, and the change of ln T, simulated and quick."""
    import pandas as pd

    o = model.setup.observations
    rows = [
        {
            "test_id": o.test_ids[test], "sample": str(o.conditions.sample[test]),
            "normal_load_N": float(o.conditions.normal_load_N[test]), "angle_deg": before.angle_deg,
            "static_before": before.static_friction, "static_after": after.static_friction,
            "sliding_before": before.sliding_friction, "sliding_after": after.sliding_friction,
            "simulated_static": float(np.log(after.static_friction / before.static_friction)),
            "simulated_sliding": float(np.log(after.sliding_friction / before.sliding_friction)),
            "quick_static": float(quick[test, 0]), "quick_sliding": float(quick[test, 1]),
        }
        for test, (before, after) in zip(tests, runs, strict=True)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def interpolated(model: ModelFit, tests: Sequence[int], table: pd.DataFrame, quick: FloatArray) -> FloatArray:
    """Change of ln T of every test, (n, 2): the quick one, corrected as the pairs of ``tests`` of its sample were.

    The correction of both regimes is in proportion to the quick change of the leading one (no effect, no correction).
    Between loads the factor is linear in ln N.
    """
    c = model.setup.observations.conditions
    places = np.array(tests)
    lead = leading(quick)
    off = table[["simulated_static", "simulated_sliding"]].to_numpy() - quick[places]
    factor = off / quick[places, lead][:, None]
    change = quick.copy()
    for sample in np.unique(c.sample[places]):
        rows = np.flatnonzero(c.sample == sample)
        pairs = np.flatnonzero(c.sample[places] == sample)
        pairs = pairs[np.argsort(c.normal_load_N[places[pairs]])]
        known, wanted = np.log(c.normal_load_N[places[pairs]]), np.log(c.normal_load_N[rows])
        for k in (0, 1):
            change[rows, k] += quick[rows, lead] * np.interp(wanted, known, factor[pairs, k])
    return change


def ratio_of_effects(table: pd.DataFrame) -> tuple[float, float]:
    """Least squares ratio of simulated to quick change over all pairs and regimes, and its standard error."""
    x = table[["quick_static", "quick_sliding"]].to_numpy().ravel()
    y = table[["simulated_static", "simulated_sliding"]].to_numpy().ravel()
    whole = float(x @ x)
    if whole < 1e-12:
        return float("nan"), float("nan")
    ratio = float(x @ y / whole)
    left = y - ratio * x
    return ratio, float(np.sqrt(left @ left / max(len(x) - 1, 1) / whole))


def with_simulation(
    d: Diagnosis, *, seed: int = 0, jobs: int = 2, progress: Progress | None = None
) -> Diagnosis:
    """The same diagnosis with its named mechanisms simulated.

    The ``model`` record of its verdict says where the predictions come from and what the simulation gave, or why there
    is none.
    """
    model: dict[str, object] = {**d.verdict.model, "shares_from": d.baseline.setup.predictor.source}
    if d.named is None or not d.named.causes or d.verdict.verdict not in CERTAIN_CAUSES:
        return replace(d, verdict=replace(d.verdict, model=model))
    extension = simulate_extension(d.named.model, seed=seed, jobs=jobs, progress=progress)
    if isinstance(extension, str):
        model["not_simulated"] = {"mechanisms": [a.name for a in d.named.model.acting], "reason": extension}
        return replace(d, verdict=replace(d.verdict, model=model))
    log_force, table = extension
    ratio, ratio_u = ratio_of_effects(table)
    measured = d.baseline.setup.observations.log_force
    model["simulated"] = {
        "mechanisms": [a.name for a in d.named.model.acting], "pairs_of_runs": len(table),
        "effect_over_law": ratio, "effect_over_law_u": ratio_u,
        "rms_percent_before": rms_percent(d.baseline.residual),
        "rms_percent_law": rms_percent(d.named.model.residual),
        "rms_percent_simulated": rms_percent(measured - log_force),
    }  # fmt: skip
    return replace(d, simulated_log_force=log_force, extended_runs=table, verdict=replace(d.verdict, model=model))
