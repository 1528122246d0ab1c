"""The reading "berardo2019" against the printed simulation, from the whole column (docs/results/table2-search.md).

    tribo simulate --table2 --reading berardo2019 -o STORE
    python benchmarks/simulator_column.py entries STORE docs/data   # table2-column.csv, table2-column-laws.csv
    python benchmarks/simulator_column.py angles STORE docs/data    # table2-angles.csv
    python benchmarks/simulator_column.py steps STORE docs/data     # table2-steps.csv
    python benchmarks/simulator_column.py peaks STORE docs/data C Sx Sy    # table2-peaks.csv
    python benchmarks/simulator_column.py claims STORE docs/data    # table2-claims.csv

``entries`` compares the mean of every sample at every load with T/N of the printed law. ``angles`` pulls samples at ten
angles and says how far that moves the means (four minutes). ``steps`` repeats runs of the column at the step of the
paper, 1e-8 s, at three loads (ten minutes, three runs each); it goes on where it was stopped. ``peaks`` does so for
static friction alone, with all twenty runs (five minutes for three samples). ``claims`` holds what the text and the
captions of Figures 5 to 8 say, and what is exact in the model, against the column (a minute).
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tribo.berardo2019.published_tables import beside, load_table2, table2_design
from tribo.records import FloatArray, Run
from tribo.springblock import SimConfig, read_stored, simulate, stratified_design
from tribo.springblock.calibration import expected_minimum, fitted, means
from tribo.springblock.config import PAPER, PAPER_PRESSURES_PA, PAPER_SAMPLES
from tribo.springblock.engines.state import lattice_of, thresholds_of
from tribo.springblock.ensemble import run_row

READING = SimConfig().of_reading("berardo2019")
REGIMES = ("static", "sliding")
CHOSEN_ON = {"A", "C", "Sx"}  # static friction at 10 kPa chose the thickness of the layer; 8 and 11 kPa lie around it
CHOSEN_AT_kPa = {8.0, 11.0}
AREA_FRACTIONS = {"F": 1.0, "A": 0.94, "B": 0.57, "C": 0.46, "Sx": 0.72, "Sy": 0.72}  # caption of Figure 8
ANGLES, SOME_PRESSURES_PA = 10, (3e3, 11e3, 25e3)
FINE_S = 1e-8

Row = dict[str, Any]


def printed() -> pd.DataFrame:
    """The printed simulation, by sample and regime."""
    return load_table2().query("source == 'simulation'").set_index(["sample", "regime"])


def printed_entry(law: pd.Series, p_kPa: FloatArray | float) -> tuple[Any, Any]:
    """T/N of a printed law, and its error from the printed standard deviations.

    The covariance is not published; it is that of a straight line in 1/p through eight equally certain loads.
    """
    x = 1e6 / np.asarray(PAPER_PRESSURES_PA) / 1e3
    correlation = -x.mean() / np.sqrt((x**2).mean())
    variance = law.mu_sd**2 + (law.tau0_sd_kPa / p_kPa) ** 2
    variance = variance + 2.0 * correlation * law.mu_sd * law.tau0_sd_kPa / p_kPa
    return law.mu + law.tau0_kPa / p_kPa, np.sqrt(variance)


def entries_of(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per sample, load and regime: the mean, the printed number, and how far apart they are."""
    table, rows = means(runs), []
    for (sample, regime), law in printed().iterrows():
        for r in table[table["sample"] == sample].itertuples(index=False):
            p, here, own = r.pressure_Pa / 1e3, getattr(r, regime), getattr(r, f"{regime}_se")
            there, its_own = printed_entry(law, p)
            used = regime == "sliding" or (sample in CHOSEN_ON and p in CHOSEN_AT_kPa)
            rows.append({
                "regime": regime, "sample": sample, "pressure_kPa": p, "runs": r.runs, "mean": here, "se": own,
                "printed": there, "printed_se": its_own, "used_in_choosing": used,
                "deviation_percent": 100.0 * (here / there - 1.0), "se_percent": 100.0 * np.hypot(own, its_own) / there,
            })  # fmt: skip
    return pd.DataFrame(rows)


def entries(store: str, out: str) -> None:
    runs = read_stored(store)
    table = entries_of(runs)
    table.to_csv(Path(out) / "table2-column.csv", index=False, float_format="%.5g")
    laws = beside(fitted(runs), load_table2())
    laws.to_csv(Path(out) / "table2-column-laws.csv", index=False, float_format="%.5g")
    print(laws.round(3).to_string(index=False))
    for regime, group in table.groupby("regime", sort=False):
        off = group["deviation_percent"]
        print(f"\n{regime}: rms {np.sqrt((off**2).mean()):.2f} %, largest {off.abs().max():.2f} %")
        for column in ("deviation_percent", "se_percent"):
            by_load = group.pivot(index="pressure_kPa", columns="sample", values=column)
            print(by_load[list(PAPER_SAMPLES)].round(2).to_string())
        unused = group[~group["used_in_choosing"]]
        beyond = unused[unused["deviation_percent"].abs() > 2.0 * unused["se_percent"]]
        print(f"not used in choosing: {len(unused)}, beyond two standard errors {len(beyond)}")
        print(beyond.groupby("sample", sort=False)["pressure_kPa"].agg(list).to_string() if len(beyond) else "")


def angles(store: str, out: str) -> None:
    """Means over ten angles against those of the nominal direction; standard deviation over the angle alone."""
    runs = read_stored(store)
    rows = []
    for sample in PAPER_SAMPLES:
        design = stratified_design([sample], SOME_PRESSURES_PA, ANGLES, base=READING)
        found = pd.DataFrame([run_row(simulate(config)) for config in design])
        for p, group in found.groupby("pressure_Pa"):
            nominal = runs[(runs["sample"] == sample) & (runs["pressure_Pa"] == p)]
            row: Row = {"sample": sample, "pressure_kPa": p / 1e3, "angles": len(group)}
            for regime in REGIMES:
                here, there = group[f"{regime}_friction"], nominal[f"{regime}_friction"]
                spread = np.sqrt(max(here.var() - there.var(), 0.0))
                row |= {
                    f"{regime}_shift_percent": 100.0 * (here.mean() / there.mean() - 1.0),
                    f"{regime}_sd_of_angle_percent": 100.0 * spread / there.mean(),
                    f"{regime}_sd_of_run_percent": 100.0 * there.std() / there.mean(),
                }
            rows.append(row)
    table = pd.DataFrame(rows)
    table.to_csv(Path(out) / "table2-angles.csv", index=False, float_format="%.3g")
    print(table.round(2).to_string(index=False))


def steps(store: str, out: str, repeats: str = "4") -> None:
    """Runs of the column again at fine steps: the difference of coarse and fine, in pairs."""
    path = Path(out) / "table2-steps.csv"
    rows = pd.read_csv(path).to_dict("records") if path.exists() else []
    done = {(r["sample"], r["pressure_kPa"], r["repeat"]) for r in rows}
    for config, coarse, repeat in pairs(store, int(repeats)):
        key = (config.sample, config.pressure_Pa / 1e3, repeat)
        if key in done:
            continue
        fine = simulate(config.with_(dt_s=FINE_S))
        row: Row = dict(zip(("sample", "pressure_kPa", "repeat"), key, strict=True))
        for regime in REGIMES:
            here, there = coarse[f"{regime}_friction"], getattr(fine, f"{regime}_friction")
            row |= {f"{regime}_fine": there, f"{regime}_difference_percent": 100.0 * (here / there - 1.0)}
        rows.append(row)
        pd.DataFrame(rows).to_csv(path, index=False, float_format="%.6g")
    found = pd.DataFrame(rows).groupby("sample", sort=False)[[f"{r}_difference_percent" for r in REGIMES]]
    print(found.agg(["size", "mean", "sem", "std"]).round(3).to_string())


def peaks(store: str, out: str, *samples: str) -> None:
    """Static friction of all runs at three loads, with both steps up to 1.2 times the peak time of the column."""
    rows = []
    for config, coarse, repeat in pairs(store):
        if config.sample in (samples or PAPER_SAMPLES):
            short_run = config.with_(duration_s=1.2 * coarse["peak_s"], window_start_peaks=1.01)
            here, there = (simulate(short_run.with_(dt_s=dt)).static_friction for dt in (config.dt_s, FINE_S))
            of = {"sample": config.sample, "pressure_kPa": config.pressure_Pa / 1e3, "repeat": repeat}
            rows.append(of | {"static_fine": there, "static_difference_percent": 100.0 * (here / there - 1.0)})
    table = pd.DataFrame(rows)
    table.to_csv(Path(out) / "table2-peaks.csv", index=False, float_format="%.6g")
    for by in ("sample", ["sample", "pressure_kPa"]):
        grouped = table.groupby(by, sort=False)["static_difference_percent"]
        print(grouped.agg(["size", "mean", "sem"]).round(3).to_string())


def pairs(store: str, repeats: int | None = None) -> Iterator[tuple[SimConfig, pd.Series, int]]:
    """The runs of the column at three loads, the first of every entry first: configuration, stored row, number."""
    runs = read_stored(store)
    per_load = len(runs) // (len(PAPER_SAMPLES) * len(PAPER_PRESSURES_PA))
    design = table2_design(READING, per_load, angles="nominal")
    for repeat in range(per_load if repeats is None else repeats):
        for k in range(repeat, len(design), per_load):
            if design[k].seed != runs.iloc[k]["seed"]:
                raise SystemExit(f"{store} holds another design")
            if design[k].pressure_Pa in SOME_PRESSURES_PA:
                yield design[k], runs.iloc[k], repeat


def claims(store: str, out: str) -> None:
    runs = read_stored(store)
    table = pd.DataFrame([*of_figures(runs), *exact(runs)], columns=["claim", "printed", "here", "holds"])
    table.to_csv(Path(out) / "table2-claims.csv", index=False)
    print(table.to_string(index=False))


Claim = tuple[str, str, str, bool]


def of_figures(runs: pd.DataFrame) -> Iterator[Claim]:
    """What the text and the captions of Figures 5 to 8 say of the simulated numbers."""
    here, paper = fitted(runs, resamples=2).set_index(["sample", "regime"]), printed()
    measured = load_table2().query("source == 'experiment'").set_index(["sample", "regime"])
    found = runs.groupby("sample")["area_fraction"].first()
    gap = max(abs(found[s] - af) for s, af in AREA_FRACTIONS.items())
    yield "Figure 8: area fractions", ".94, .57, .46, .72", f"largest difference {gap:.3f}", bool(gap < 0.01)
    for regime, figure in (("static", 6), ("sliding", 7)):
        off = max(bend(runs, s, regime) for s in PAPER_SAMPLES)
        yield f"Figure {figure}: {regime} T is a straight line in N", "", f"means within {off:.1f} % of it", off < 1
    order = [static_order(laws) for laws in (paper, here)]
    yield "text of Figure 6: order of static mu", *(" > ".join(names) for names in order), order[0] == order[1]
    same, pairs, widest = same_order(runs)
    words = f"{same} of {pairs}; the others are printed within {widest:.1f} %"
    yield "the same of T/N at each load, A to Sy in pairs", "", words, same == pairs
    near = [nearest_tau0(laws, measured) for laws in (paper, here)]
    yield "text of Figure 6: tau0 closest to the measured", *(", ".join(names) for names in near), near[0] == near[1]
    spread = [float(np.ptp(laws.xs("sliding", level="regime")["mu"])) for laws in (measured, paper, here)]
    words = f"{spread[1]:.2f}, measured {spread[0]:.2f}"
    narrower = spread[2] < spread[0]
    yield "text of Figure 7: sliding mu varies less than measured", words, f"{spread[2]:.2f}", narrower
    fraction = pd.Series(AREA_FRACTIONS)
    ratios = [laws.xs("sliding", level="regime")["tau0_kPa"] / fraction for laws in (paper, here)]
    apart = [100 * float((ratio / ratio.mean() - 1).abs().max()) for ratio in ratios]
    words_of = [f"within {percent:.1f} %" for percent in apart]
    yield "text of Figure 7: sliding tau0 is proportional to area", *words_of, apart[1] <= apart[0]
    for regime in REGIMES:
        lines = [three_terms(laws.xs(regime, level="regime")["tau0_kPa"], fraction) for laws in (paper, here)]
        words_of = [f"a {a:.1f} +- {se:.1f}, b {b:.1f} kPa" for a, b, se in lines]
        agrees = abs(lines[0][0] - lines[1][0]) < 2 * np.hypot(lines[0][2], lines[1][2])
        yield f"Figure 8: {regime} tau0 = a AF + b", *words_of, bool(agrees)


def static_order(laws: pd.DataFrame) -> list[str]:
    """The patterned samples, from the highest static mu down."""
    return list(laws.xs("static", level="regime")["mu"].drop("F").sort_values(ascending=False).index)


def bend(runs: pd.DataFrame, sample: str, regime: str) -> float:
    """How far the means at the loads lie off the straight line through them, in percent."""
    of = means(runs[runs["sample"] == sample])
    law = fitted(runs[runs["sample"] == sample], resamples=2).set_index("regime").loc[regime]
    return float((100 * (of[regime] / (law["mu"] + law["tau0_kPa"] * 1e3 / of["pressure_Pa"]) - 1)).abs().max())


def same_order(runs: pd.DataFrame) -> tuple[int, int, float]:
    """Pairs of patterns in the printed order of static T/N, all pairs, and the widest gap of the others in percent."""
    table = entries_of(runs).query("regime == 'static' and sample != 'F'")
    same, widest, pairs = 0, 0.0, 0
    for _, group in table.groupby("pressure_kPa"):
        at = group.set_index("sample")
        for a, b in combinations(at.index, 2):
            gap = at.loc[a, "printed"] - at.loc[b, "printed"]
            pairs += 1
            if gap * (at.loc[a, "mean"] - at.loc[b, "mean"]) > 0:
                same += 1
            else:
                widest = max(widest, 100 * abs(gap) / at.loc[a, "printed"])
    return same, pairs, widest


def nearest_tau0(laws: pd.DataFrame, measured: pd.DataFrame) -> list[str]:
    off = (laws["tau0_kPa"] - measured["tau0_kPa"]).xs("static", level="regime").drop("F").abs()
    return sorted(off.nsmallest(2).index)


def three_terms(tau0_kPa: pd.Series, fraction: pd.Series) -> tuple[float, float, float]:
    """a and b of tau0 = a AF + b over the samples, and the standard error of a from their scatter about the line."""
    y, x = tau0_kPa[fraction.index].to_numpy(float), fraction.to_numpy(float)
    (a, b), covariance = np.polyfit(x, y, 1, cov=True)
    return float(a), float(b), float(np.sqrt(covariance[0, 0]))


def exact(runs: pd.DataFrame) -> Iterator[Claim]:
    """What holds in the model whatever the reading."""
    flat = runs[runs["sample"] == "F"]
    configs = [READING.with_(pressure_Pa=r.pressure_Pa, seed=int(r.seed)) for r in flat.itertuples()]
    off = np.abs(flat["static_friction"] / np.array([weakest(config) for config in configs]) - 1).max()
    yield f"flat T/N is that of the weakest block, {len(flat)} runs", "1e-3", f"{off:.1e}", bool(off < 1e-3)
    mu = PAPER.mu_s + PAPER.mu_s_sd * expected_minimum(7225)
    here = fitted(flat).set_index("regime").loc["static"]
    words = f"{here['mu']:.3f} +- {here['mu_se']:.3f}"
    agrees = bool(abs(here["mu"] - mu) < 2 * here["mu_se"])
    yield "flat static mu is the expected minimum of 7225 blocks", f"{mu:.3f}", words, agrees
    yield fewer_blocks()
    peaks = np.array([short(sample="F", seed=1, dt_s=dt).static_friction for dt in (1e-8, 2e-8, 5e-8, 1e-7)])
    moved = 100 * np.abs(peaks / peaks[0] - 1)
    words = f"{moved[1:3].max():.4f} %; {moved[3]:.3f} %"
    holds = bool(moved[1:3].max() < 0.005 and moved[3] < 0.06)
    yield "flat peak at 2e-8 and 5e-8 s; at 1e-7 s, against 1e-8", "four decimals; 0.03 %", words, holds
    for sample in PAPER_SAMPLES:
        turned = np.array([rotation_percent(sample, seed) for seed in range(2, 6)])
        words = f"{turned.mean():+.3f} % (mean of 4), single runs up to {np.abs(turned).max():.2f} %"
        yield f"finite rotation moves the peak, {sample}", "0.5 %", words, bool(abs(turned.mean()) < 0.5)
    at = np.array([short(sample="F", seed=3, angle_deg=a).static_friction for a in (0.0, 30.0, 45.0, 90.0)])
    spread = 100 * float(np.ptp(at) / at.mean())
    yield "text: flat friction does not depend on the angle", "", f"within {spread:.3f} %", spread < 0.1


def fewer_blocks() -> Claim:
    """Static friction of small flat lattices lies on the curve of the expected minimum."""
    words, fine = [], True
    for n in (20, 43):
        mu = [short(sample="F", seed=s, blocks=(n, n)).static_friction - PAPER.static_adhesion_Pa / READING.pressure_Pa
              for s in range(40)]  # fmt: skip
        expected = PAPER.mu_s + PAPER.mu_s_sd * expected_minimum(n * n)
        apart = (np.mean(mu) - expected) / (np.std(mu, ddof=1) / len(mu) ** 0.5)
        words.append(f"{n}: {apart:+.1f} standard errors")
        fine &= abs(apart) < 2.5
    return "fewer blocks hold more, by extreme-value statistics", "", ", ".join(words), fine


def rotation_percent(sample: str, seed: int) -> float:
    """How far springs of the full r_ij move the peak; 45 x 45 blocks."""
    angle = 90.0 if sample == "Sy" else 0.0
    config = READING.with_(sample=sample, seed=seed, angle_deg=angle, engine="dense", blocks=(45, 45))
    peaks = [short(config, rotation=how).static_friction for how in ("small", "finite")]
    return 100.0 * (peaks[1] / peaks[0] - 1.0)


def short(base: SimConfig = READING, **changes: Any) -> Run:
    """One run to shortly after its peak."""
    return simulate(base.with_(duration_peaks=1.1, **changes))


def weakest(config: SimConfig) -> float:
    thresholds = thresholds_of(config, lattice_of(config))
    return float(thresholds.static_N.min()) / (config.pressure_Pa * config.spacing_m**2)


COMMANDS: dict[str, Callable[..., None]] = {
    "entries": entries, "angles": angles, "steps": steps, "peaks": peaks, "claims": claims,
}  # fmt: skip

if __name__ == "__main__":
    COMMANDS[sys.argv[1]](*sys.argv[2:])
