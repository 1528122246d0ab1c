"""Putting a mechanism into the spring-block model itself: ``tribo simulate --with suction:dp=3000``.

A mechanism acts on the blocks in contact. Its law, applied to the law of one contact block, says by how much
the block's coefficients, its adhesion and what rests on it change; the simulation then makes of that what the
pattern makes of it, which the quick predictor can only scale.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values
from tribo.mechanisms.table import MECHANISMS
from tribo.records import FloatArray, Run
from tribo.simulate.config import LocalFriction, SimConfig
from tribo.simulate.run import simulate

SIMULATED = (
    "contact_area_loss", "pressure_dependent_friction", "velocity_dependence", "contact_ageing", "run_in", "suction",
    "edge_adhesion", "normal_load_error", "temperature", "humidity",
)  # fmt: skip
RECORDED = {"hold_s": 10.0, "specimen_run": 1.0, "temperature_C": 23.0, "humidity_pct": 50.0, "speed_m_s": 2e-4}


def parse_with(text: str) -> dict[str, Values]:
    """"suction:dp=3000,run_in:c=0.2,n0=5" -> values by mechanism; parameters not given keep their start.

    Raises
    ------
    SimulationError
        An unknown mechanism or parameter, or a value outside its bounds: every fault with what is allowed.
    """
    problems: list[Problem] = []
    found: dict[str, Values] = {}
    name = ""
    for item in filter(None, (part.strip() for part in text.split(","))):
        if ":" in item:
            name, item = (part.strip() for part in item.split(":", 1))
        if name not in SIMULATED:
            problems.append(_unknown(name or item))
            continue
        _set(found.setdefault(name, MECHANISMS[name].start()), MECHANISMS[name], item, problems)
    if problems:
        raise SimulationError(problems)
    return found


def _unknown(name: str) -> Problem:
    what = "no mechanism of the simulator"
    return Problem("unknown_mechanism", what, found=name, allowed=", ".join(SIMULATED))


def _set(values: Values, mechanism: Mechanism, item: str, problems: list[Problem]) -> None:
    key, _, number = item.partition("=")
    names = [p.name for p in mechanism.parameters]
    if key not in names:
        problems.append(
            Problem("unknown_parameter", f"no parameter of {mechanism.name}", found=key, allowed=", ".join(names))
        )
        return
    p = mechanism.parameters[names.index(key)]
    try:
        value = float(number)
    except ValueError:
        value = float("nan")
    if not p.low <= value <= p.high:
        allowed = f"{p.low:g} to {p.high:g} {p.unit}".rstrip()
        problems.append(Problem("bad_value", f"{mechanism.name}:{key} cannot be this", found=number, allowed=allowed))
        return
    values[names.index(key)] = value


def simulate_with(config: SimConfig, mechanisms: Mapping[str, Values], **recorded: float) -> Run:
    """One run with mechanisms at work; with none, or all at zero, the run of ``config`` to the bit.

    ``recorded`` are the conditions of the pull that the model itself does not have: hold_s, specimen_run,
    temperature_C, humidity_pct, and speed_m_s of the bench (the model's own clock is scaled).
    """
    return simulate(extended(config, mechanisms, **recorded))


def extended(config: SimConfig, mechanisms: Mapping[str, Values], **recorded: float) -> SimConfig:
    """The configuration whose blocks obey the mechanisms; raises SimulationError for one that cannot be simulated."""
    friction = config.friction
    for name, values in mechanisms.items():
        if name not in SIMULATED:
            raise SimulationError(_unknown(name))
        if values[0] != MECHANISMS[name].amplitude.zero:
            friction = _blocks(config, friction, MECHANISMS[name], values, recorded)
    return config if friction == config.friction else replace(config, friction=friction)


def _blocks(
    config: SimConfig, friction: LocalFriction, mechanism: Mechanism, values: Values, recorded: Mapping[str, float]
) -> LocalFriction:
    """Local friction changed by one mechanism. The load of the contact blocks is p / AF, their area AF A."""
    conditions = conditions_of_run(config, recorded)
    load = conditions.contact_pressure_Pa[0]
    mu = _base(friction.mu_s, 0.0, friction.mu_d, 0.0)
    adhesion = _base(0.0, friction.static_adhesion_Pa, 0.0, friction.sliding_adhesion_Pa)
    whole = _base(friction.mu_s, friction.static_adhesion_Pa, friction.mu_d, friction.sliding_adhesion_Pa)
    nothing = _tractions(mechanism, values, _base(0.0, 0.0, 0.0, 0.0), conditions)
    changed = _tractions(mechanism, values, mu, conditions) - nothing
    stuck = _tractions(mechanism, values, adhesion, conditions) - nothing
    together = _tractions(mechanism, values, whole, conditions) - nothing
    plain = np.array([friction.mu_s * load, friction.mu_d * load])
    pull = np.array([friction.static_adhesion_Pa, friction.sliding_adhesion_Pa])
    if not np.allclose(changed + stuck, together, rtol=1e-9):  # not linear: one gain on the whole threshold
        changed, stuck = plain * together / (plain + pull), pull * together / (plain + pull)
    gain = changed / plain
    return replace(
        friction,
        mu_s=friction.mu_s * gain[0], mu_s_sd=friction.mu_s_sd * gain[0],
        mu_d=friction.mu_d * gain[1], mu_d_sd=friction.mu_d_sd * gain[1],
        static_adhesion_Pa=float(stuck[0] + nothing[0]), sliding_adhesion_Pa=float(stuck[1] + nothing[1]),
    )  # fmt: skip


def conditions_of_run(config: SimConfig, recorded: Mapping[str, float]) -> Conditions:
    """The contact blocks of a run as one test, shape (1,): nominal load p A on the area fraction AF."""
    from tribo.diagnose.observations import rim_per_m

    pattern, known = config.cavities, {**RECORDED, **recorded}

    def one(value: float) -> FloatArray:
        return np.array([value], float)

    return Conditions(
        normal_load_N=one(config.pressure_Pa), nominal_area_m2=1.0, area_fraction=one(pattern.area_fraction),
        rim_per_m=one(rim_per_m(pattern)), cavity_width_m=one(min(pattern.size_m) if pattern.size_m else 0.0),
        elongation=one(0.0), sample=np.array([config.sample]), specimen=np.array([""]),
        speed_m_s=one(known["speed_m_s"]), hold_s=one(known["hold_s"]), specimen_run=one(known["specimen_run"]),
        run_order=one(1.0), elapsed_s=one(0.0), temperature_C=one(known["temperature_C"]),
        humidity_pct=one(known["humidity_pct"]), clip_N=one(0.0),
    )  # fmt: skip


def _base(mu_s: float, static_Pa: float, mu_d: float, sliding_Pa: float) -> Base:
    return Base(np.array([mu_s]), np.array([static_Pa]), np.array([mu_d]), np.array([sliding_Pa]))


def _tractions(mechanism: Mechanism, values: Values, base: Base, conditions: Conditions) -> FloatArray:
    """Static and sliding traction of the contact, Pa, (2,), of a sample whose whole force is carried by AF."""
    share = conditions.area_fraction
    spread = replace(
        base, static_adhesion_N=base.static_adhesion_N * share, sliding_adhesion_N=base.sliding_adhesion_N * share
    )
    forces: Forces = mechanism.law(values, spread, conditions, "")
    return np.array([forces.static_N[0], forces.sliding_N[0]]) / share[0]
