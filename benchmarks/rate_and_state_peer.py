"""Rate-and-state friction beside rsfmodel (J. Leeman, MIT licence) itself, on its own problems.

    git clone https://github.com/jrleeman/rsfmodel
    python benchmarks/rate_and_state_peer.py rsfmodel

Prints the largest difference over the change of friction, of velocity steps with one and two states under both
laws and of slide-hold-slide; both integrate to tolerances of 1e-12 (rsfmodel) and 1e-11 (tribo).
"""

from __future__ import annotations

import sys

import numpy as np
from scipy import integrate

from tribo.slider import SliderConfig, simulate_slider, speed_steps

STATES = ((0.01, 10.0), (0.001, 5.0))  # b, and Dc in um
STIFFNESS_PER_UM = 1e-3


def peer(law: str, a: float, states: tuple[tuple[float, float], ...], speeds_um_s: np.ndarray) -> np.ndarray:
    """Friction by rsfmodel at 100 Hz, under a speed for every sample."""
    from rsfmodel import rsf, staterelations

    kinds = {"dieterich": staterelations.DieterichState, "ruina": staterelations.RuinaState}
    model = rsf.Model()
    model.mu0, model.a, model.k, model.v, model.vref = 0.6, a, STIFFNESS_PER_UM, 1.0, 1.0
    for b, Dc in states:
        state = kinds[law]()
        state.b, state.Dc = b, Dc
        model.state_relations.append(state)
    model.time, model.loadpoint_velocity = np.arange(speeds_um_s.size) / 100.0, speeds_um_s
    model.solve()
    return np.array(model.results.friction)


def own(law: str, a: float, states: tuple[tuple[float, float], ...], knots_s: list[float], speeds_um_s: list[float],
        samples: int) -> np.ndarray:  # fmt: skip
    """The same by tribo."""
    values = {"mu0": 0.6, "v0_m_s": 1e-6, "a": a, "b": states[0][0], "Dc_m": 1e-6 * states[0][1]}
    if len(states) > 1:
        values |= {"b2": states[1][0], "Dc2_m": 1e-6 * states[1][1]}
    drive = speed_steps(knots_s, [1e-6 * v for v in speeds_um_s])
    config = SliderConfig(
        0.0, 1e6 * STIFFNESS_PER_UM, 0.0, 1.0, law=law, values=values, drive=drive, duration_s=(samples - 1) / 100.0,
        rate_Hz=100.0,
    )  # fmt: skip
    return simulate_slider(config).force_N


def main() -> None:
    sys.path.insert(0, sys.argv[1])
    integrate.cumtrapz = integrate.cumulative_trapezoid  # its name before scipy 1.14
    for law, a, b in (("dieterich", 0.005, 0.01), ("ruina", 0.01, 0.005)):
        for states in (((b, 10.0),), ((b, 10.0), STATES[1])):
            speeds = np.where(np.arange(4001) < 1000, 1.0, 10.0)
            theirs = peer(law, a, states, speeds)
            difference = np.abs(own(law, a, states, [0.0, 10.0], [1.0, 10.0], theirs.size) - theirs).max()
            print(f"velocity step, {law}, states: {len(states)}: {difference / np.ptp(theirs):.1e}")
        hold = np.arange(15001)
        theirs = peer(law, 0.005, STATES[:1], np.where((hold >= 1000) & (hold < 11000), 0.0, 1.0))
        difference = np.abs(own(law, 0.005, STATES[:1], [0.0, 10.0, 110.0], [1.0, 0.0, 1.0], hold.size) - theirs).max()
        print(f"slide-hold-slide, {law}: {difference / np.ptp(theirs):.1e}")


if __name__ == "__main__":
    main()
