"""What mechanisms do to the blocks of the spring-block model: coefficients, adhesion, load, contact, springs.

Most act on every block in contact alike: the law of the mechanism, applied to the law of one contact block, says by
how much its coefficients, its adhesion and what rests on it change. Some act by where a block lies (rims, floors, the
trailing edge); these change the thresholds of single blocks.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tribo.mechanisms.record import REFERENCE_SPEED_M_S, Base, Conditions, Forces, Mechanism, Values
from tribo.mechanisms.table import MECHANISMS
from tribo.records import FloatArray, Pattern, Run
from tribo.simulate.config import LocalFriction, SimConfig
from tribo.simulate.engines.fast import Thresholds, lattice_of, run_fast, thresholds_of
from tribo.simulate.engines.lattice import Lattice
from tribo.simulate.engines.reference import run_reference
from tribo.simulate.run import run_of, simulate
from tribo.virtual_tribometer.measuring_chain import SLED_AREA_M2

RECORDED = {
    "hold_s": 10.0, "specimen_run": 1.0, "temperature_C": 23.0, "humidity_pct": 50.0, "speed_m_s": 2e-4,
    "elapsed_s": 3600.0, "samples_in_rise": 100.0, "nominal_area_m2": SLED_AREA_M2,
}  # fmt: skip
PLACED = ("edge_adhesion", "cavity_collapse", "tilt")
LIFTED_SHARE = 1e-6  # left on a block that the tilt has lifted, so that it keeps a threshold
MOST_ECCENTRIC = 0.49  # lengths; at half a length the sample stands on its edge
CARDINAL = 4  # neighbours E, W, N, S come first in the lattice


@dataclass(frozen=True)
class Pulled:
    """Static and sliding T/N of the whole sample, on which tilt, a slanted wire and area loss depend."""

    static: float = 0.0
    sliding: float = 0.0


def run_with(
    config: SimConfig, acting: Mapping[str, Values], recorded: Mapping[str, float], pulled: Pulled
) -> Run:
    """One run whose blocks obey the mechanisms, given the friction of the whole sample so far."""
    changed = on_every_block(config, acting, recorded, pulled)
    placed = {name: values for name, values in acting.items() if name in PLACED}
    if not placed:
        return simulate(changed)
    changed.check()
    floors = floors_down(changed, placed.get("cavity_collapse"), recorded)
    bare = changed.with_(pattern=Pattern("F")) if floors else changed
    lattice = lattice_of(bare)
    static, sliding = (on_floors(changed, floors) if floors else even(lattice) for _ in range(2))
    if "tilt" in placed:
        height = float(placed["tilt"][0])
        static = on_tilted(changed, lattice, height * pulled.static, static)
        sliding = on_tilted(changed, lattice, height * pulled.sliding, sliding)
    thresholds = weighted(bare, lattice, static, sliding)
    if "edge_adhesion" in placed:
        thresholds = on_rims(changed, thresholds, placed["edge_adhesion"], recorded)
    run = run_reference if changed.engine == "reference" else run_fast
    return run_of(changed, run(changed, lattice, thresholds), float(lattice_of(changed).area_fraction))


def on_every_block(
    config: SimConfig, acting: Mapping[str, Values], recorded: Mapping[str, float], pulled: Pulled
) -> SimConfig:
    """The configuration with the local friction and the springs that the mechanisms give every block alike."""
    friction = config.friction
    for name, values in acting.items():
        if name == "contact_area_loss":
            friction = scaled(friction, *(_area_kept(config, values, pulled),) * 2)
        elif name == "pull_angle":
            lift = np.tan(values[0])
            friction = lighter(friction, 1.0 - pulled.static * lift, 1.0 - pulled.sliding * lift)
        elif name not in (*PLACED, *BEYOND_BLOCKS):
            friction = by_law(config, friction, MECHANISMS[name], values, recorded)
    changed = config if friction == config.friction else config.with_(friction=friction)
    if "bulk_viscoelasticity" in acting:
        speed = {**RECORDED, **recorded}["speed_m_s"]
        gain = 1.0 + acting["bulk_viscoelasticity"][0] * np.log(speed / REFERENCE_SPEED_M_S)
        changed = changed if gain == 1.0 else changed.with_(modulus_Pa=float(config.modulus_Pa * gain))
    return changed


BEYOND_BLOCKS = (
    "bulk_viscoelasticity", "load_cell_offset", "load_cell_drift", "pulley_friction", "machine_compliance",
    "sampling_clip", "mislabelled_specimen",
)  # fmt: skip
"""Mechanisms that act on the springs, in the measuring chain, or on which sample lies there at all."""


def _area_kept(config: SimConfig, values: Values, pulled: Pulled) -> float:
    """Share of the contact left at the traction of the peak, 1 - c (T / (AF A))^2."""
    traction_Pa = pulled.static * config.pressure_Pa / config.cavities.area_fraction
    return float(np.clip(1.0 - values[0] * traction_Pa**2, 0.05, 1.0))


def scaled(friction: LocalFriction, static: float, sliding: float) -> LocalFriction:
    """Every threshold times a gain."""
    return replace(
        lighter(friction, static, sliding),
        static_adhesion_Pa=friction.static_adhesion_Pa * static,
        sliding_adhesion_Pa=friction.sliding_adhesion_Pa * sliding,
    )


def lighter(friction: LocalFriction, static: float, sliding: float) -> LocalFriction:
    """The normal force of every block times a share, while it holds and while it slides."""
    a, b = max(static, 0.0), max(sliding, 0.0)
    return replace(
        friction, mu_s=friction.mu_s * a, mu_s_sd=friction.mu_s_sd * a, mu_d=friction.mu_d * b,
        mu_d_sd=friction.mu_d_sd * b,
    )  # fmt: skip


def by_law(
    config: SimConfig, friction: LocalFriction, mechanism: Mechanism, values: Values, recorded: Mapping[str, float]
) -> LocalFriction:
    """Local friction changed by the mechanism's own law. The load of the contact blocks is p / AF, their area AF A."""
    conditions = conditions_of_run(config, recorded)
    choice = _choice(mechanism, conditions)
    load = conditions.contact_pressure_Pa[0]
    area = conditions.nominal_area_m2

    def traction(mu: float, adhesion: float) -> FloatArray:
        base = Base(
            np.array([mu * friction.mu_s]), np.array([adhesion * friction.static_adhesion_Pa * area]),
            np.array([mu * friction.mu_d]), np.array([adhesion * friction.sliding_adhesion_Pa * area]),
        )  # fmt: skip
        return _tractions(mechanism, values, base, conditions, choice)

    nothing = traction(0.0, 0.0)
    changed, stuck, together = traction(1.0, 0.0) - nothing, traction(0.0, 1.0) - nothing, traction(1.0, 1.0) - nothing
    plain = np.array([friction.mu_s * load, friction.mu_d * load])
    pull = np.array([friction.static_adhesion_Pa, friction.sliding_adhesion_Pa])
    if not np.allclose(changed + stuck, together, rtol=1e-9):  # not linear: one gain on the whole threshold
        changed, stuck = plain * together / (plain + pull), pull * together / (plain + pull)
    gain = changed / plain
    return replace(
        lighter(friction, float(gain[0]), float(gain[1])),
        static_adhesion_Pa=float(stuck[0] + nothing[0]), sliding_adhesion_Pa=float(stuck[1] + nothing[1]),
    )  # fmt: skip


def _choice(mechanism: Mechanism, conditions: Conditions) -> str:
    """What a mechanism with a choice is about in a single run: the pattern of the sample, the one column there is."""
    if mechanism.name == "pattern_geometry":
        from tribo.mechanisms.pattern_geometry import pattern_of

        return str(pattern_of(conditions.sample)[0])
    return "column is this" if mechanism.name == "covariate" else ""


def _tractions(
    mechanism: Mechanism, values: Values, base: Base, conditions: Conditions, choice: str
) -> FloatArray:
    """Static and sliding traction of the contact, Pa, (2,), of a sample whose whole force is carried by AF."""
    share = conditions.area_fraction
    spread = replace(
        base, static_adhesion_N=base.static_adhesion_N * share, sliding_adhesion_N=base.sliding_adhesion_N * share
    )
    forces: Forces = mechanism.law(values, spread, conditions, choice)
    return np.array([forces.static_N[0], forces.sliding_N[0]]) / (share[0] * conditions.nominal_area_m2)


def conditions_of_run(config: SimConfig, recorded: Mapping[str, float]) -> Conditions:
    """The run as one test of a sled of the nominal area, shape (1,): load p A on the area fraction AF.

    A long cavity counts by the cosine of twice the angle between it and the pull: nothing at 45 degrees.
    """
    pattern, known = config.cavities, {**RECORDED, **recorded}
    size = pattern.size_m
    long = np.log(size[0] / size[1]) * np.cos(2 * np.deg2rad(config.angle_deg)) if size else 0.0

    def one(value: float) -> FloatArray:
        return np.array([value], float)

    return Conditions(
        normal_load_N=one(config.pressure_Pa * known["nominal_area_m2"]), nominal_area_m2=known["nominal_area_m2"],
        area_fraction=one(pattern.area_fraction), rim_per_m=one(pattern.rim_per_m),
        cavity_width_m=one(min(size) if size else 0.0), elongation=one(float(long)),
        sample=np.array([config.sample]), specimen=np.array([""]), speed_m_s=one(known["speed_m_s"]),
        hold_s=one(known["hold_s"]), specimen_run=one(known["specimen_run"]), run_order=one(1.0),
        elapsed_s=one(known["elapsed_s"]), temperature_C=one(known["temperature_C"]),
        humidity_pct=one(known["humidity_pct"]), clip_N=one(0.0),
        columns={"column": np.array(["this"])},
    )  # fmt: skip


def floors_down(config: SimConfig, values: Values | None, recorded: Mapping[str, float]) -> float:
    """Share of the cavity floors that touch down at this pressure."""
    if values is None:
        return 0.0
    from tribo.mechanisms.cavity_collapse import share_down

    return float(share_down(values, conditions_of_run(config, recorded))[0])


@dataclass(frozen=True)
class Carried:
    """Normal load and adhesion of every block over those of an even contact, (n,)."""

    load: FloatArray
    grip: FloatArray


def even(lattice: Lattice) -> Carried:
    """Nothing changed."""
    ones = np.ones(lattice.contact.size)
    return Carried(ones, ones)


def weighted(config: SimConfig, lattice: Lattice, static: Carried, sliding: Carried) -> Thresholds:
    """Thresholds of a configuration with load and adhesion of every block times what it carries."""
    whole = thresholds_of(config, lattice)
    no_adhesion = replace(config.friction, static_adhesion_Pa=0.0, sliding_adhesion_Pa=0.0)
    bare = thresholds_of(config.with_(friction=no_adhesion), lattice)
    return Thresholds(
        bare.static_N * static.load + (whole.static_N - bare.static_N) * static.grip,
        bare.sliding_N * sliding.load + (whole.sliding_N - bare.sliding_N) * sliding.grip,
    )


def on_floors(config: SimConfig, share: float) -> Carried:
    """In a lattice in contact everywhere: floors carry ``share`` of the load and adhesion of a flat block.

    The rest of the load stays on the lands. At share one the sample is flat.
    """
    contact = lattice_of(config).contact
    land = float(contact.mean())
    return Carried(np.where(contact, (1.0 - share * (1.0 - land)) / land, share), np.where(contact, 1.0, share))


def on_rims(
    config: SimConfig, thresholds: Thresholds, values: Values, recorded: Mapping[str, float]
) -> Thresholds:
    """Extra adhesion on the blocks beside a cavity, by the number of their sides that face one.

    The rim length per area is that of the pattern, so that square cavities get what the round ones have.
    """
    sides = _sides_at_cavities(config)
    if sides.sum() == 0:
        return thresholds
    whole_N = float(conditions_of_run(config, recorded).rim_per_m[0]) * len(sides) * config.spacing_m**2
    extra = values[0] * whole_N * sides / sides.sum()
    return Thresholds(thresholds.static_N + extra, thresholds.sliding_N + values[1] * extra)


def _sides_at_cavities(config: SimConfig) -> FloatArray:
    """Of every contact block the number of its four sides that face a cavity block, (n,)."""
    lattice = lattice_of(config)
    cavity = np.append(~lattice.contact, False)
    near = cavity[lattice.neighbours[:-1, :CARDINAL]].sum(axis=1)
    return np.where(lattice.contact, near, 0).astype(float)


def on_tilted(config: SimConfig, lattice: Lattice, eccentricity: float, carried: Carried) -> Carried:
    """Load linear along the pull, its resultant off the middle by so many lengths of the sample.

    Beyond a sixth the trailing edge lifts: it carries nothing and no longer adheres.
    """
    angle = np.deg2rad(config.angle_deg)
    y, x = np.divmod(np.arange(lattice.contact.size), lattice.nx)
    along = x * np.cos(angle) + y * np.sin(angle)
    place = (along - along.min()) / max(float(np.ptp(along)), 1.0) - 0.5
    if eccentricity <= 1.0 / 6.0:
        load, grip = 1.0 + 12.0 * eccentricity * place, np.ones_like(place)
    else:
        start = 0.5 - 3.0 * (0.5 - min(eccentricity, MOST_ECCENTRIC))
        load = np.maximum(place - start, LIFTED_SHARE)
        grip = (place > start).astype(float)
    load = load * carried.load
    return Carried(load * carried.load[lattice.contact].mean() / load[lattice.contact].mean(), grip * carried.grip)
