"""Mechanisms in the spring-block model itself: ``tribo simulate --with suction:dp=3000``.

Every mechanism of the library can be simulated. Its placement (:class:`tribo.mechanisms.record.Placement`) says whether
it acts on the blocks or in the measuring chain, or replaces the sample by another one. At zero amplitude a run is that
of the baseline to the bit. Most act on every block in contact alike: the law of the mechanism, applied to the law of
one contact block, gives the change of its coefficients, its adhesion and its normal force; a law that was found in
measurements always acts so. Some depend on where a block lies (rims, floors, the trailing edge); these change the
thresholds of single blocks.

The measuring chain shows a run as a machine would. A run pulls a square of a fraction of a millimetre; offsets, drifts
and compliances belong to the whole sled. They are scaled by the nominal area, so that T/N of the run is that of the
sled. An ideal chain leaves a run unchanged, bit for bit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Placement, Values
from tribo.records import FloatArray, Pattern, Run, Trace
from tribo.springblock.config import LocalFriction, SimConfig
from tribo.springblock.engines import ENGINES
from tribo.springblock.engines.state import Thresholds, lattice_of, thresholds_of
from tribo.springblock.lattice import SIDES, Lattice, pattern_of
from tribo.springblock.run import run_of, simulate, until_it_slides

SLED_AREA_M2 = 55e-6


def measured(
    run: Run,
    speed_m_s: float,
    *,
    wire_angle_rad: float = 0.0,
    roller_friction: float = 0.0,
    compliance_m_per_N: float = 0.0,
    offset_N: float = 0.0,
    interval_peaks: float = 0.0,
    nominal_area_m2: float = SLED_AREA_M2,
) -> Run:
    """The run as recorded by the chain between slider and recorded data, in the order of the signal.

    Parameters
    ----------
    speed_m_s
        The crosshead speed in the time of the model.
    wire_angle_rad
        Upward angle of the wire: its tension is the pull over the cosine (without its effect on the normal load).
    roller_friction
        Coefficient of the roller under the wire, wrapped over a right angle: gain exp(mu pi / 2).
    compliance_m_per_N
        Machine and wire as a spring in series with the sled: the crosshead moves on by the force times this.
    offset_N
        Reading of the load cell at zero force on the sled.
    interval_peaks
        Time between two samples of the recorder in units of the peak time; the peak falls midway between two. Zero
        keeps the samples of the run.
    nominal_area_m2
        Nominal area of the sled.
    """
    sleds = nominal_area_m2 * run.pressure_Pa / run.normal_load_N  # how many of the model's squares make the sled
    if wire_angle_rad or roller_friction:
        run = amplified(run, float(np.exp(roller_friction * np.pi / 2) / np.cos(wire_angle_rad)))
    if compliance_m_per_N:
        run = with_compliance(run, compliance_m_per_N * sleds, speed_m_s)
    if offset_N:
        run = shifted(run, offset_N / sleds)
    if interval_peaks:
        run = sampled(run, interval_peaks * run.peak_s)
    return run


def amplified(run: Run, gain: float) -> Run:
    """Every force times ``gain``."""
    return replace(
        run, force_N=run.force_N * gain, static_friction=run.static_friction * gain,
        sliding_friction=run.sliding_friction * gain,
    )  # fmt: skip


def shifted(run: Run, force_N: float) -> Run:
    """Every force plus ``force_N``."""
    return replace(
        run, force_N=run.force_N + force_N, static_friction=run.static_friction + force_N / run.normal_load_N,
        sliding_friction=run.sliding_friction + force_N / run.normal_load_N,
    )  # fmt: skip


def with_compliance(run: Run, compliance_m_per_N: float, speed_m_s: float) -> Run:
    """The same forces on the clock of a crosshead that has to stretch the machine as well.

    The force that falls in a slip lets the machine spring back faster than the crosshead moves: such a drop is
    upright. Static and sliding friction are those of the slider.
    """
    clock = np.maximum.accumulate(run.time_s + run.force_N * compliance_m_per_N / speed_m_s)

    def moved(time_s: float) -> float:
        return float(np.interp(time_s, run.time_s, clock))

    return replace(
        run, time_s=clock, peak_s=moved(run.peak_s), window_s=(moved(run.window_s[0]), moved(run.window_s[1]))
    )


def sampled(run: Run, interval_s: float) -> Run:
    """The data points of a recorder with this interval, half an interval to either side of the peak."""
    first = np.mod(run.peak_s - interval_s / 2, interval_s)
    time: FloatArray = np.arange(first, run.time_s[-1], interval_s)
    force = np.interp(time, run.time_s, run.force_N)
    moving = np.interp(time, run.time_s, run.moving).round().astype(np.int64)
    before = np.interp(run.peak_s - interval_s / 2, run.time_s, run.force_N)
    after = np.interp(run.peak_s + interval_s / 2, run.time_s, run.force_N)
    static = max(float(before), float(after)) / run.normal_load_N
    return replace(run, time_s=time, force_N=force, moving=moving, static_friction=min(static, run.static_friction))


@dataclass(frozen=True)
class Recorder:
    """What stands between the force at the machine and the numbers in an export.

    Parameters
    ----------
    rate_Hz : float
        Data points per second.
    noise_N : float
        Standard deviation of white noise in N.
    resolution_N : float
        Step of the recorded force in N; 0 for none.
    filter_Hz : float
        Corner of a low-pass filter of first order before sampling in Hz; 0 for none.
    """

    rate_Hz: float
    noise_N: float = 0.0
    resolution_N: float = 0.0
    filter_Hz: float = 0.0


def as_recorded(
    run: Run,
    recorder: Recorder,
    *,
    speed_m_s: float,
    stiffness_N_per_m: float = math.inf,
    nominal_area_m2: float = SLED_AREA_M2,
    slides_m: float = 0.0,
    seed: int = 0,
) -> Trace:
    """A run of the model as an export of a machine, which the readers of traces read as any other.

    The force is that of the whole sled. The drive moves on by the stretch of the machine as well
    (:func:`with_compliance`), so that most of a rise on a soft machine is the machine. A second of rest comes first.

    Parameters
    ----------
    run : Run
        A run of the model.
    recorder : Recorder
        Rate, noise, resolution and filter.
    speed_m_s : float
        Speed of the drive of the machine in m/s. The time of the model is not that of the machine: both agree in the
        way of the drive.
    stiffness_N_per_m : float
        Stiffness of machine and wire in N/m.
    nominal_area_m2 : float
        Nominal area of the sled in m2.
    slides_m : float
        Way in m by which the slide goes on at its mean force after the end of the run, which is short.
    seed : int
        Seed of the noise.

    Returns
    -------
    Trace
        Time in s, force in N and displacement of the drive in m.

    Examples
    --------
    >>> import tribo
    >>> from tribo.mechanisms_in_model import Recorder, as_recorded
    >>> run = tribo.simulate(tribo.SimConfig(blocks=(8, 8), dt_s=2e-7, duration_peaks=1.5))
    >>> trace = as_recorded(run, Recorder(50.0), speed_m_s=2e-4, stiffness_N_per_m=6000.0, slides_m=1e-3)
    >>> round(1e3 * trace.displacement_m[-1], 1)
    1.5
    """
    from scipy.signal import lfilter

    sleds = nominal_area_m2 * run.pressure_Pa / run.normal_load_N
    model_speed = float(run.parameters.get("speed_m_s", speed_m_s))
    force = run.force_N * sleds
    way = np.maximum.accumulate(run.time_s * model_speed + force / stiffness_N_per_m)
    level = run.sliding_friction * run.normal_load_N * sleds
    way, force = np.append(way, way[-1] + [0.0, max(slides_m, 1e-12)]), np.append(force, [level, level])
    rest_m = speed_m_s * 1.0
    fine = max(1, math.ceil(20.0 * recorder.filter_Hz / recorder.rate_Hz))  # a filter acts before the samples are taken
    displacement = np.arange(-rest_m, way[-1], speed_m_s / recorder.rate_Hz / fine)
    found = np.interp(displacement, way, force, left=0.0)
    if recorder.filter_Hz > 0:
        keeps = math.exp(-2.0 * math.pi * recorder.filter_Hz / (recorder.rate_Hz * fine))
        found = np.asarray(lfilter([1.0 - keeps], [1.0, -keeps], found))
    displacement, found = displacement[::fine], found[::fine]
    if recorder.noise_N > 0:
        found = found + recorder.noise_N * np.random.default_rng(seed).standard_normal(found.size)
    if recorder.resolution_N > 0:
        found = np.round(found / recorder.resolution_N) * recorder.resolution_N
    time = (displacement - displacement[0]) / speed_m_s
    return Trace(f"{run.sample}, model", time, found, displacement_m=displacement - displacement[0])


RECORDED = {
    "hold_s": 10.0, "specimen_run": 1.0, "temperature_C": 23.0, "humidity_pct": 50.0, "speed_m_s": 2e-4,
    "elapsed_s": 3600.0, "run_order": 1.0, "samples_in_rise": 100.0, "nominal_area_m2": SLED_AREA_M2,
}  # fmt: skip


Placed = tuple[Placement, Values]


Pulled = tuple[float, float]
"""Static and sliding T/N of the whole sample, on which some mechanisms depend."""
NOT_PULLED = (0.0, 0.0)


def run_with(
    config: SimConfig, acting: Mapping[str, Values], recorded: Mapping[str, float], pulled: Pulled
) -> Run:
    """One run whose blocks obey the mechanisms, given the friction of the whole sample so far."""
    changed = on_every_block(config, acting, recorded, pulled)
    placed = [(MECHANISMS[name].placement, values) for name, values in acting.items()]
    if not any(placement.on_single_blocks for placement, _ in placed):
        return simulate(changed)
    changed.check()
    conditions = conditions_of_run(changed, recorded)
    floors = min(sum(p.floors(values, conditions) for p, values in placed if p.floors is not None), 1.0)
    bare = changed.with_(pattern=Pattern("F")) if floors else changed
    lattice = lattice_of(bare)
    start = on_floors(changed, floors) if floors else even(lattice)
    static, sliding = (carried_along(changed, lattice, placed, ratio, start) for ratio in pulled)
    thresholds = weighted(bare, lattice, static, sliding)
    for placement, values in placed:
        if placement.rims is not None:
            thresholds = on_rims(changed, thresholds, placement.rims(values), conditions)
    integrate = ENGINES[changed.engine].integrate
    trajectory = integrate(changed, lattice, thresholds, 1)
    trajectory = until_it_slides(changed, trajectory, lambda longer: integrate(longer, lattice, thresholds, 1))
    return run_of(changed, trajectory, float(lattice_of(changed).area_fraction))


def on_every_block(
    config: SimConfig, acting: Mapping[str, Values], recorded: Mapping[str, float], pulled: Pulled
) -> SimConfig:
    """The configuration with the local friction and the springs that the mechanisms give every block alike."""
    traction_Pa = pulled[0] * config.pressure_Pa / config.cavities.area_fraction
    friction, stiffening = config.friction, 1.0
    for name, values in acting.items():
        placement = MECHANISMS[name].placement
        if placement.thresholds is not None:
            friction = scaled(friction, *placement.thresholds(values, pulled, traction_Pa))
        if placement.load is not None:
            friction = lighter(friction, *placement.load(values, pulled, traction_Pa))
        if placement.by_law:
            friction = by_law(config, friction, MECHANISMS[name], values, recorded)
        if placement.springs is not None:
            stiffening *= placement.springs(values, conditions_of_run(config, recorded))
    changed = config if friction == config.friction else config.with_(friction=friction)
    return changed if stiffening == 1.0 else changed.with_(modulus_Pa=float(config.modulus_Pa * stiffening))


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
    """Local friction changed by the mechanism's own law, under the recorded conditions of a run."""
    return by_law_under(friction, mechanism, values, conditions_of_run(config, recorded))


def by_law_under(
    friction: LocalFriction, mechanism: Mechanism, values: Values, conditions: Conditions
) -> LocalFriction:
    """Local friction changed by the mechanism's own law. The load of the contact blocks is p / AF, their area AF A."""
    choice = mechanism.choosing.in_one_run(conditions)
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
        sample=np.array([config.sample]), pattern=np.array([pattern.name]), specimen=np.array([""]),
        speed_m_s=one(known["speed_m_s"]),
        hold_s=one(known["hold_s"]), specimen_run=one(known["specimen_run"]), run_order=one(known["run_order"]),
        elapsed_s=one(known["elapsed_s"]), temperature_C=one(known["temperature_C"]),
        humidity_pct=one(known["humidity_pct"]), clip_N=one(0.0),
        columns={"column": np.array(["this"])},
    )  # fmt: skip


Carried = tuple[FloatArray, FloatArray]
"""Normal load and adhesion of every block over those of an even contact, (n,)."""


def even(lattice: Lattice) -> Carried:
    """Nothing changed."""
    ones = np.ones(lattice.contact.size)
    return ones, ones


def weighted(config: SimConfig, lattice: Lattice, static: Carried, sliding: Carried) -> Thresholds:
    """Thresholds of a configuration with load and adhesion of every block times what it carries."""
    whole = thresholds_of(config, lattice)
    no_adhesion = replace(config.friction, static_adhesion_Pa=0.0, sliding_adhesion_Pa=0.0)
    bare = thresholds_of(config.with_(friction=no_adhesion), lattice)
    return Thresholds(
        bare.static_N * static[0] + (whole.static_N - bare.static_N) * static[1],
        bare.sliding_N * sliding[0] + (whole.sliding_N - bare.sliding_N) * sliding[1],
    )


def on_floors(config: SimConfig, share: float) -> Carried:
    """In a lattice in contact everywhere: floors carry ``share`` of the load and adhesion of a flat block.

    The rest of the load stays on the lands. At share one the sample is flat.
    """
    contact = lattice_of(config).contact
    land = float(contact.mean())
    return np.where(contact, (1.0 - share * (1.0 - land)) / land, share), np.where(contact, 1.0, share)


def on_rims(
    config: SimConfig, thresholds: Thresholds, adhesion: tuple[float, float], conditions: Conditions
) -> Thresholds:
    """Extra adhesion on the blocks beside a cavity, by the number of their sides that face one.

    ``adhesion`` is static force per rim length, N/m, and the share of it left while sliding. The rim length per area
    is that of the pattern, so that square cavities have that of the round ones.
    """
    sides = _sides_at_cavities(config)
    if sides.sum() == 0:
        return thresholds
    whole_m = float(conditions.rim_per_m[0]) * len(sides) * config.spacing_m**2
    extra = adhesion[0] * whole_m * sides / sides.sum()
    return Thresholds(thresholds.static_N + extra, thresholds.sliding_N + adhesion[1] * extra)


def _sides_at_cavities(config: SimConfig) -> FloatArray:
    """Of every contact block the number of its four sides that face a cavity block, (n,)."""
    lattice = lattice_of(config)
    cavity = np.append(~lattice.contact, False)
    near = cavity[lattice.neighbours[:-1, SIDES]].sum(axis=1)
    return np.where(lattice.contact, near, 0).astype(float)


def carried_along(
    config: SimConfig, lattice: Lattice, placed: Sequence[Placed], ratio: float, carried: Carried
) -> Carried:
    """``carried`` with the profiles along the pull of all mechanisms, the sample being pulled with T/N = ``ratio``."""
    for placement, values in placed:
        if placement.along is not None:
            carried = with_profile(config, lattice, partial(placement.along, values, ratio), carried)
    return carried


def with_profile(
    config: SimConfig,
    lattice: Lattice,
    profile: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    carried: Carried,
) -> Carried:
    """``carried`` times load and adhesion that depend on the place along the pull; the total load stays.

    ``profile`` is given places from -1/2 (trailing edge) to 1/2, (n,), and returns load and adhesion, (n,) each.
    """
    angle = np.deg2rad(config.angle_deg)
    y, x = np.divmod(np.arange(lattice.contact.size), lattice.nx)
    along = x * np.cos(angle) + y * np.sin(angle)
    place = (along - along.min()) / max(float(np.ptp(along)), 1.0) - 0.5
    load, grip = profile(place)
    load = load * carried[0]
    return load * carried[0][lattice.contact].mean() / load[lattice.contact].mean(), grip * carried[1]


OF_THE_RUN = ("pressure_Pa", "contact_pressure_Pa")  # columns that a run has by itself


def with_law(
    config: SimConfig, law: tuple[Mechanism, Values], recorded: Mapping[str, float], columns: Mapping[str, str]
) -> SimConfig:
    """The configuration whose local friction follows a law, as if every contact block were a flat sample.

    ``columns`` are values of recorded columns that the model does not know. A law on T or on a term of it is a gain of
    coefficients and adhesion, so that it can act on every block; one that acts in static friction alone changes the
    static thresholds and leaves the sliding ones. Where it changes nothing, the configuration is the same to the bit.
    """
    mechanism, values = law
    conditions = conditions_under(config, recorded, columns)
    changed, same = (by_law_under(config.friction, mechanism, v, conditions) for v in (values, mechanism.zero()))
    return config if changed == same else config.with_(friction=changed)


def conditions_under(config: SimConfig, recorded: Mapping[str, float], columns: Mapping[str, str]) -> Conditions:
    """The run as one test with these values of further columns."""
    conditions = conditions_of_run(config, recorded)
    own = {name: np.array([text]) for name, text in columns.items() if name != "run_order"}
    order = np.array([float(columns["run_order"])]) if "run_order" in columns else conditions.run_order
    return replace(conditions, run_order=order, columns={**conditions.columns, **own})


def columns_from(text: str, names: Collection[str]) -> tuple[str, dict[str, str]]:
    """"film_um=3.2,hold_s=100" with the columns ``names`` of laws -> what is left for mechanisms, and their values.

    Raises
    ------
    SimulationError
        A column of a law has no value: every one that is missing.
    """
    items = [item.strip() for item in text.split(",") if item.strip()]
    wanted = [name for name in names if name not in RECORDED and name not in OF_THE_RUN]
    own = {key: value for key, _, value in (item.partition("=") for item in items) if key in wanted}
    if missing := [name for name in wanted if name not in own]:
        raise SimulationError(
            Problem("missing_condition", "the law depends on a column that the model does not have", found=name,
                    allowed=f"--given {name}=VALUE")
            for name in missing
        )  # fmt: skip
    rest = [item for item in items if item.partition("=")[0] not in own]
    return ",".join(rest), own


SIMULATED = tuple(MECHANISMS)
SETTLED = 2e-3  # relative change of T/N below which a run agrees with the friction it was given
MOST_ROUNDS = 12


def parse_with(text: str) -> dict[str, Values]:
    """"suction:dp=3000,run_in:c=0.2,n0=5" -> values by mechanism; parameters not given keep their start.

    A mechanism that replaces the sample names the other one in brackets, as a wrong label does with the sample that
    the specimen really is: ``NAME(C):share=1`` has the key ``NAME(C)``.

    Raises
    ------
    SimulationError
        An unknown mechanism or parameter, or a value outside its bounds: every fault with what is allowed.
    """
    problems: list[Problem] = []
    found: dict[str, Values] = {}
    name = ""
    for item in filter(None, (part.strip() for part in text.split(","))):
        head, colon, rest = item.rpartition(":")
        name, item = (head.strip(), rest.strip()) if colon else (name, item)
        mechanism = MECHANISMS.get(name_of(name))
        if mechanism is None:
            problems.append(_unknown(name or item))
            continue
        problems += _choice_problems(name)
        _set(found.setdefault(name, mechanism.start()), mechanism, item, problems)
    if problems:
        raise SimulationError(list(dict.fromkeys(problems)))
    return found


def name_of(key: str) -> str:
    """The mechanism of a key ``NAME``, ``NAME(SAMPLE)`` or ``NAME:COLUMN``."""
    return key.split("(")[0].split(":")[0]


def choice_of(key: str) -> str:
    """What stands in brackets behind a mechanism."""
    found = re.fullmatch(r"[^(]+\((.*)\)", key)
    return found[1] if found else ""


def _choice_problems(key: str) -> list[Problem]:
    name, choice = name_of(key), choice_of(key)
    swaps = name in MECHANISMS and MECHANISMS[name].placement.other_sample
    if swaps and pattern_of(choice) is None:
        return [
            Problem("unknown_sample", f"{name} requires the true sample of the specimen in brackets", found=key,
                    allowed=f"{name}(F), or A, B, C, Sx or Sy in the brackets")
        ]  # fmt: skip
    if choice and not swaps:
        return [Problem("unknown_choice", f"{name} does not allow brackets", found=key, allowed=name)]
    return []


def _unknown(name: str) -> Problem:
    what = "not a mechanism of the simulator"
    return Problem("unknown_mechanism", what, found=name, allowed=", ".join(MECHANISMS))


def _set(values: Values, mechanism: Mechanism, item: str, problems: list[Problem]) -> None:
    key, _, number = item.partition("=")
    names = [p.name for p in mechanism.parameters]
    if key not in names:
        problems.append(
            Problem("unknown_parameter", f"not a parameter of {mechanism.name}", found=key, allowed=", ".join(names))
        )
        return
    p = mechanism.parameters[names.index(key)]
    try:
        value = float(number)
    except ValueError:
        value = float("nan")
    if not p.low <= value <= p.high:
        allowed = f"{p.low:g} to {p.high:g} {p.unit}".rstrip()
        problems.append(Problem("bad_value", f"{mechanism.name}:{key} is out of range", found=number, allowed=allowed))
        return
    values[names.index(key)] = value


def parse_given(text: str) -> dict[str, float]:
    """"hold_s=100,temperature_C=25" -> conditions of a pull that mechanisms depend on.

    Raises
    ------
    SimulationError
        An unknown condition or no number: every fault with what is allowed.
    """
    problems: list[Problem] = []
    found: dict[str, float] = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        key, _, number = item.partition("=")
        if key not in RECORDED:
            allowed = ", ".join(f"{name} ({value:g})" for name, value in RECORDED.items())
            problems.append(Problem("unknown_condition", "not a condition of a pull", found=key, allowed=allowed))
            continue
        try:
            found[key] = float(number)
        except ValueError:
            problems.append(Problem("bad_value", f"{key} must be a number", found=number, allowed="a number"))
    if problems:
        raise SimulationError(problems)
    return found


def simulate_with(config: SimConfig, mechanisms: Mapping[str, Values], **recorded: float) -> Run:
    """One run with mechanisms in the model; with none, or with all at zero, bit for bit the run of ``config``.

    Parameters
    ----------
    config
        The run without mechanisms.
    mechanisms
        Values of the parameters of each mechanism by its name, in the units of its parameters, as :func:`parse_with`
        gives them.
    recorded
        Conditions of the pull that the model itself does not have: hold_s, specimen_run, temperature_C, humidity_pct,
        speed_m_s of the bench (the model's own clock is scaled), elapsed_s since the zero was taken, run_order of the
        test, samples_in_rise of the recorder, nominal_area_m2 of the sled.

    Returns
    -------
    Run
        As :func:`tribo.simulate` returns it, seen through the measuring chain where a mechanism acts in it.

    Raises
    ------
    SimulationError
        A mechanism that does not exist, or an impossible configuration.

    Examples
    --------
    >>> import tribo
    >>> from tribo.mechanisms_in_model import parse_with
    >>> config = tribo.SimConfig(sample="C", pressure_Pa=5e3, blocks=(12, 12), dt_s=1e-7, duration_peaks=1.5)
    >>> with_suction = tribo.simulate_with(config, parse_with("suction:dp=3000"))
    >>> with_suction.static_friction > tribo.simulate(config).static_friction
    True
    """
    acting = _acting(mechanisms)
    label = next((key for key in acting if MECHANISMS[name_of(key)].placement.other_sample), None)
    if label is None:
        return _simulate(config, acting, recorded)
    share = float(acting.pop(label)[0])
    other = config.with_(sample=choice_of(label), pattern=None)
    as_labelled, as_other = (_simulate(c, acting, recorded) for c in (config, other))
    return mixed(as_labelled, as_other, share)


def simulate_pair(
    config: SimConfig, mechanisms: Mapping[str, Values], recorded: Mapping[str, float]
) -> tuple[Run, Run]:
    """The run without mechanisms and the one with them, each computed once; parameters as :func:`simulate_with`."""
    before = run_with(config, {}, recorded, NOT_PULLED)
    acting = _acting(mechanisms)
    if not acting:
        return before, before
    if set(acting) <= set(_on_itself(acting)):
        return before, _simulate(config, acting, recorded, before)
    return before, simulate_with(config, acting, **recorded)


def _acting(mechanisms: Mapping[str, Values]) -> dict[str, Values]:
    """Those whose amplitude is not zero."""
    unknown = [key for key in mechanisms if name_of(key) not in MECHANISMS]
    if unknown:
        raise SimulationError([_unknown(key) for key in unknown])
    problems = [problem for key in mechanisms for problem in _choice_problems(key)]
    if problems:
        raise SimulationError(problems)
    by_key = {key if choice_of(key) else name_of(key): np.asarray(v, float) for key, v in mechanisms.items()}
    return {key: v for key, v in by_key.items() if v[0] != MECHANISMS[name_of(key)].amplitude.zero}


def _simulate(
    config: SimConfig, acting: Mapping[str, Values], recorded: Mapping[str, float], before: Run | None = None
) -> Run:
    run = settled(config, acting, recorded, before)
    return measured(run, config.speed_m_s, **chain_of(acting, recorded))


def settled(
    config: SimConfig, acting: Mapping[str, Values], recorded: Mapping[str, float], before: Run | None = None
) -> Run:
    """The run whose own friction is the one that was given to the mechanisms that depend on it.

    The first guess is the quick law on the run without them (``before``); then as many rounds as it takes.
    """
    on_itself = _on_itself(acting)
    if not on_itself:
        return run_with(config, acting, recorded, NOT_PULLED)
    others = {name: values for name, values in acting.items() if name not in on_itself}
    without = before if before is not None else run_with(config, others, recorded, NOT_PULLED)
    pulled = guessed(config, {n: acting[n] for n in on_itself}, recorded, without)
    for _ in range(MOST_ROUNDS):
        run = run_with(config, acting, recorded, pulled)
        off = max(abs(run.static_friction / pulled[0] - 1), abs(run.sliding_friction / pulled[1] - 1))
        if off < SETTLED:
            break
        pulled = 0.5 * (pulled[0] + run.static_friction), 0.5 * (pulled[1] + run.sliding_friction)
    return run


def _on_itself(acting: Mapping[str, Values]) -> list[str]:
    """Those that depend on the friction they change, in the order of the library."""
    return [name for name, m in MECHANISMS.items() if name in acting and m.placement.own_friction]


def guessed(config: SimConfig, acting: Mapping[str, Values], recorded: Mapping[str, float], before: Run) -> Pulled:
    """T/N that the quick laws expect, from a run without them whose mu and tau0 part as those of its blocks do."""
    f, conditions = config.friction, conditions_of_run(config, recorded)
    load = conditions.normal_load_N[0]
    contact = conditions.contact_pressure_Pa[0]
    parts = [
        (ratio, mu * contact / (mu * contact + adhesion))
        for ratio, mu, adhesion in (
            (before.static_friction, f.mu_s, f.static_adhesion_Pa),
            (before.sliding_friction, f.mu_d, f.sliding_adhesion_Pa),
        )
    ]  # fmt: skip
    (static_mu, static_N), (sliding_mu, sliding_N) = (
        (np.array([ratio * part]), np.array([ratio * (1 - part) * load])) for ratio, part in parts
    )
    base = Base(static_mu, static_N, sliding_mu, sliding_N)
    static, sliding = before.static_friction, before.sliding_friction
    for name, values in acting.items():
        after = MECHANISMS[name].law(values, base, conditions, "")
        static *= float(after.static_N[0] / load) / before.static_friction
        sliding *= float(after.sliding_N[0] / load) / before.sliding_friction
    return static, sliding


def chain_of(acting: Mapping[str, Values], recorded: Mapping[str, float]) -> dict[str, float]:
    """What :func:`measured` takes, of the mechanisms that act in the chain; what several set in one place adds up."""
    known = {**RECORDED, **recorded}
    fields = {"nominal_area_m2": known["nominal_area_m2"]}
    for name, values in acting.items():
        in_chain = MECHANISMS[name].placement.chain
        for field, value in in_chain(values, known).items() if in_chain is not None else ():
            fields[field] = fields.get(field, 0.0) + value
    return fields


def mixed(own: Run, other: Run, share: float) -> Run:
    """ln T between two runs, on the clock of the first in units of its peak time; at one the other's, to the bit."""
    if share == 1.0:
        return replace(other, sample=own.sample)
    force = np.interp(own.time_s / own.peak_s, other.time_s / other.peak_s, other.force_N)
    both = np.exp((1 - share) * np.log(np.maximum(own.force_N, 1e-30)) + share * np.log(np.maximum(force, 1e-30)))
    return replace(
        own, force_N=both,
        static_friction=own.static_friction ** (1 - share) * other.static_friction**share,
        sliding_friction=own.sliding_friction ** (1 - share) * other.sliding_friction**share,
    )  # fmt: skip
