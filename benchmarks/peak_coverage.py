"""How often does static_N +- k static_u_N hold the static peak? Pulls of known continuous shape, sampled and noisy.

    python benchmarks/peak_coverage.py [--pulls 400] [--seed 1] [--csv FILE]

A pull rises in a line to its static peak and falls exponentially to sliding; the top is sharp, or rounded over a width
by one of two shapes: a Gaussian blur of the whole signal (the bandwidth of an amplifier), or an arc between the loading
line and the fall (creep before the slip). The true peak is the highest force of the continuous signal. Rise, fall and
phase of the clock are drawn anew for each pull, the noise is white. Reported are the share of 95 % intervals that hold
the true peak, the mean error and the spread of the reading in percent of the peak, and the mean standard uncertainty.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
import pandas as pd

from tribo import read_pull
from tribo.errors import TraceError
from tribo.records import Trace

STATIC_N, SLIDING_N = 2.0, 1.3
ZERO_S, SLIDE_S = 2.0, 12.0
K_95 = 1.959964
RATES_HZ = (10.0, 20.0, 50.0, 100.0)
WIDTHS_S = (0.0, 0.05, 0.1, 0.2, 0.4, 0.8)
NOISES = (0.003, 0.01, 0.03)  # share of the static peak
FINE_S = 1e-3


@dataclass(frozen=True)
class Top:
    """A continuous pull: its times (fine grid), forces, and its true peak."""

    time_s: np.ndarray
    force_N: np.ndarray

    @property
    def peak_N(self) -> float:
        return float(self.force_N.max())


def sharp(rise_s: float, fall_s: float) -> Top:
    """A line up to the peak and an exponential down from it."""
    time = np.arange(0.0, ZERO_S + rise_s + SLIDE_S, FINE_S)
    peak = ZERO_S + rise_s
    up = STATIC_N * np.clip((time - ZERO_S) / rise_s, 0.0, 1.0)
    down = SLIDING_N + (STATIC_N - SLIDING_N) * np.exp(-np.maximum(time - peak, 0.0) / fall_s)
    return Top(time, np.where(time < peak, up, down))


def blurred(rise_s: float, fall_s: float, width_s: float) -> Top:
    """The sharp pull seen through a Gaussian of standard deviation ``width_s``."""
    from scipy.ndimage import gaussian_filter1d

    top = sharp(rise_s, fall_s)
    return Top(top.time_s, gaussian_filter1d(top.force_N, width_s / FINE_S, mode="nearest"))


def arched(rise_s: float, fall_s: float, width_s: float) -> Top:
    """The loading line bends into a level top over ``width_s``, from which the fall begins."""
    top = sharp(rise_s, fall_s)
    rate, peak_s = STATIC_N / rise_s, ZERO_S + rise_s
    start = peak_s - width_s / 2.0  # the line is left here; its slope then falls evenly to zero at peak + width/2
    bend = np.clip((top.time_s - start) / width_s, 0.0, 1.0)
    line = rate * np.minimum(top.time_s - ZERO_S, start - ZERO_S)
    arc = line + rate * width_s * (bend - bend**2 / 2.0)
    end = start + width_s
    force = np.where(top.time_s < ZERO_S, 0.0, arc)
    fall = SLIDING_N + (arc.max() - SLIDING_N) * np.exp(-np.maximum(top.time_s - end, 0.0) / fall_s)
    return Top(top.time_s, np.where(top.time_s < end, force, fall))


SHAPES = {"blurred": blurred, "arched": arched}


def one_error(
    shape: str, width_s: float, rate_Hz: float, noise: float, rng: np.random.Generator
) -> tuple[float, float]:
    """(error of the reading, its standard uncertainty) over the true peak; NaN where no pull was read."""
    rise, fall = rng.uniform(1.0, 3.0), rng.uniform(0.1, 0.6)
    top = SHAPES[shape](rise, fall, width_s) if width_s else sharp(rise, fall)
    time = np.arange(rng.uniform(0.0, 1.0 / rate_Hz), top.time_s[-1], 1.0 / rate_Hz)
    force = np.interp(time, top.time_s, top.force_N) + noise * STATIC_N * rng.standard_normal(time.size)
    try:
        pull = read_pull(Trace("made", time, force))
    except TraceError:
        return np.nan, np.nan
    return pull.static_N / top.peak_N - 1.0, pull.static_u_N / top.peak_N


def coverage(pulls: int, seed: int) -> pd.DataFrame:
    """One row a shape, width, rate and noise."""
    rows = []
    for width in WIDTHS_S:
        for shape in SHAPES if width else ("sharp",):
            for rate in RATES_HZ:
                for noise in NOISES:
                    rng = np.random.default_rng([seed, int(1e4 * width), int(rate), int(1e4 * noise), *shape.encode()])
                    error, u = np.array([one_error(shape, width, rate, noise, rng) for _ in range(pulls)]).T
                    read = np.isfinite(error)
                    held = np.abs(error[read]) <= K_95 * u[read]
                    rows.append(
                        {
                            "shape": shape, "width_s": width, "rate_Hz": rate, "noise_pct": 100 * noise,
                            "pulls": int(read.sum()), "covered_pct": 100 * held.mean(),
                            "bias_pct": 100 * error[read].mean(), "sd_pct": 100 * error[read].std(),
                            "u_pct": 100 * u[read].mean(),
                        }
                    )  # fmt: skip
    return pd.DataFrame(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--pulls", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--csv", help="write the figures to this file")
    options = parser.parse_args()
    found = coverage(options.pulls, options.seed)
    if options.csv:
        found.round(3).to_csv(options.csv, index=False)
    print(found.round(2).to_string(index=False))
    groups = found.groupby(["shape", "rate_Hz"])["covered_pct"]
    print(groups.agg(["mean", "min", "max"]).round(1).to_string())


if __name__ == "__main__":
    main()
