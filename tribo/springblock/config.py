"""The configuration of one run: friction of single blocks, named readings of the paper, all else, and its checks.

The reading "text" is the letter of Berardo et al. (2019), with the choices of docs/concepts/model.md where it is
silent; "berardo2019" is the set that comes closest to the simulated column of its Table 2
(docs/results/table2-search.md).
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal

from tribo.display import displayed
from tribo.errors import Problem, SimulationError
from tribo.input_files import LARGEST_NUMBER, MOST_BLOCKS, MOST_STEPS, SMALLEST_NUMBER
from tribo.records import Pattern
from tribo.springblock.engines import ENGINES, engines_with
from tribo.springblock.lattice import STIFFEST, contact_mask, pattern_of, touching_share


@displayed()
@dataclass(frozen=True)
class LocalFriction:
    """Friction of single blocks: Gaussian coefficients and adhesion per area (Berardo 2019, Model parameters).

    A block of normal force F_n holds up to mu_s F_n + F_as and slides against mu_d F_n + F_ad; the adhesion
    tractions here are F_as / l2 and F_ad / l2 in Pa. Coefficients drawn below zero are set to zero.
    """

    mu_s: float = 5.5
    mu_s_sd: float = 0.195
    mu_d: float = 2.9
    mu_d_sd: float = 0.15
    static_adhesion_Pa: float = 23.45e3
    sliding_adhesion_Pa: float = 11.60e3


PAPER = LocalFriction()
"""The local friction of Berardo 2019, fitted there to the flat sample."""


@displayed()
@dataclass(frozen=True)
class FrictionTerms:
    """Local friction that changes during a run; amplitudes of zero, the default, leave the baseline unchanged.

    The laws are in :mod:`tribo.springblock.engines.state`.

    Parameters
    ----------
    ageing_b, ageing_t0_s
        Static friction grows by ``b ln(1 + t / t0)`` with the time t at rest (Dieterich-Ruina), b >= 0.
    hold_s
        Time at rest before the pull starts.
    speed_a, speed_v0_m_s
        Sliding friction changes by ``a ln(1 + v / v0)`` with the slip speed v of a block.
    """

    ageing_b: float = 0.0
    ageing_t0_s: float = 1e-3
    hold_s: float = 0.0
    speed_a: float = 0.0
    speed_v0_m_s: float = 2e-4

    @property
    def active(self) -> bool:
        return self.ageing_b != 0.0 or self.speed_a != 0.0


NO_TERMS = FrictionTerms()


OPEN_CHOICES: dict[str, Any] = {
    "thickness_m": None,
    "block_mass": "layer",
    "shear_factor": 1.0,
    "normal_force": "redistributed",
    "edges": "free",
    "pattern_first": None,
    "restrengthening": 1.0,
    "sticking": "turned",
    "stick_interval_s": None,
    "contact_stiffness_Pa_per_m": None,
    "friction_patch_m": None,
    "pulled_edge": None,
    "machine_stiffness_N_per_m": None,
}
"""What the text leaves open and changes a run, with the values of the reading "text"."""

READINGS: dict[str, dict[str, Any]] = {"text": {}, "berardo2019": {"thickness_m": 8.5e-6, "restrengthening": 0.3}}
"""Fields of :class:`tribo.springblock.SimConfig` that each reading sets; the rest is as in "text"."""

ANGLES: dict[str, str] = {"text": "midpoints", "berardo2019": "nominal"}
"""The law of the pull angle of each reading, as :func:`tribo.springblock.stratified_design` takes it."""


PAPER_SAMPLES = ("F", "A", "B", "C", "Sx", "Sy")
PAPER_PRESSURES_PA = (3e3, 5e3, 8e3, 11e3, 14e3, 17.5e3, 21e3, 25e3)
"""Eight pressures over the range of the paper, which does not list its own."""


def reading_of(choices: Mapping[str, Any]) -> str:
    """The name of the reading with these values of the open choices, "own" where none has them."""
    for name, changes in READINGS.items():
        if all(choices[key] == value for key, value in (OPEN_CHOICES | changes).items()):
            return name
    return "own"


NormalForce = Literal["redistributed", "uniform"]
Edges = Literal["free", "periodic"]
Rotation = Literal["small", "finite"]
Sticking = Literal["turned", "slow", "never"]
BlockMass = Literal["layer", "cube"]
PulledEdge = Literal["leading", "trailing"]
STANDARD_GRAVITY_M_S2 = 9.80665


@displayed(lambda c: f"{c.sample} at {c.pressure_Pa / 1e3:.4g} kPa, seed {c.seed}")
@dataclass(frozen=True)
class SimConfig:
    """One run. Lengths, times and pressures in SI units; the defaults are the baseline of Berardo 2019.

    Parameters
    ----------
    sample, pattern
        Name of the sample, and its cavities; without ``pattern`` the paper's pattern of that name.
    pressure_Pa, angle_deg
        Nominal pressure, and pull direction against x.
    seed
        Draws the local friction. Equal seeds give equal numbers on every sample.
    friction
        Coefficients and adhesion (Pa) of single blocks, as :func:`tribo.calibrate` returns them.
    terms
        What changes the local friction during the run; nothing by default.
    restrengthening
        Share, 0 to 1, of the excess of static over sliding friction that a block regains once it has slipped: 1, it
        sticks as firmly as before; 0, it keeps its sliding threshold.
    sticking, stick_speed_m_s, stick_interval_s
        When a sliding block comes to rest: "turned", once a step turns its velocity by more than 90 degrees; "slow",
        once it is slower than ``stick_speed_m_s``; "never", friction follows the velocity at every stage of a step.
        Tested every ``stick_interval_s``, at every step by default. Only the reference engine has others than "turned".
    contact_stiffness_Pa_per_m
        Stiffness kappa of contact per area: a spring kappa l2 binds each contact block to the track and yields at its
        static threshold. None, the reading of the paper, is rigid contact. A stiffer one needs a shorter step.
    friction_patch_m
        Side of the squares in which all blocks have one draw of the local friction. None, the reading of the paper, is
        one draw for each block: a finer mesh then has more draws, hence a weaker weakest one.
    pulled_edge
        "leading" or "trailing": the slider pulls only the row of blocks at that edge, each by K_s. None, the reading of
        the paper, is a slider over all blocks. The row is the one across x or y, whichever is nearer to the pull.
    machine_stiffness_N_per_m, slider_mass_kg, machine_damping_N_s_per_m
        A spring and a damper (none by default) between the drive, which moves at ``speed_m_s``, and the slider, which
        has this mass (by default that of the nominal load). They are those of the machine times the share of the
        nominal area that is simulated. The force of a run is then that between drive and slider. None is a slider that
        moves at ``speed_m_s`` whatever the force. The run begins on the even rise, without the swing of the start.
    blocks, spacing_m, thickness_m
        Blocks along x and y, their distance l, and the layer thickness l_z (l by default).
    block_mass
        "layer": rho l2 l_z; "cube": rho l3, as printed. They differ only where l_z is not l.
    modulus_Pa, density_kg_m3, damping_per_s, speed_m_s
        Young's modulus, density, damping rate, and speed of the slider.
    shear_factor
        K_s over K_int (l / l_z)^2. The paper prints 1; G = 3/8 E would give 0.5.
    normal_force
        "redistributed": contact blocks carry p l2 / AF and cavities nothing; "uniform": p l2 on every block.
    edges, pattern_first, cavity_shape
        Free or periodic edges, first block of the first cavity, and whether circles become squares. "exact", as for
        shapes and lattices that the paper does not have: a block that touches in part has that part of friction.
    rotation
        "small" for linearised springs, "finite" for the full r_ij of the paper (engine reference; the peaks differ
        by under 0.5 %).
    engine
        "fast", or "reference" for the algorithm of the paper.
    dt_s, sample_interval_s
        Time step, and time between two samples of the trace. Steps of 5e-8 s move the sliding mean by under 1 %
        against 1e-8 s; see docs/results/simulator-accuracy.md.
    duration_s, duration_peaks
        The run ends at ``duration_s``, or where that is None at ``duration_peaks`` times the time of the peak.
    window_start_peaks, window_end_peaks
        Sliding window in units of the peak time; the end is that of the run by default.
    peak_rule, peak_drop
        "highest" takes the largest force of the run as static friction, "first" the first maximum after which
        the force fell by the share ``peak_drop``.
    rest_tolerance
        A cavity block rests once its force is below this share of the mean sliding threshold. At 2e-3 static
        friction of single runs stays within 0.1 % of the reference engine (docs/results/simulator-accuracy.md).

    Raises
    ------
    SimulationError
        Not here but by :meth:`check`, with which every run begins: everything that is wrong, all at once.

    Examples
    --------
    >>> import tribo
    >>> config = tribo.SimConfig(sample="B", pressure_Pa=5e3)
    >>> config.with_(blocks=(40, 40)).check().cavities.name
    'B'
    """

    sample: str = "F"
    pressure_Pa: float = 10e3
    angle_deg: float = 0.0
    seed: int = 0
    pattern: Pattern | None = None
    friction: LocalFriction = PAPER
    terms: FrictionTerms = NO_TERMS
    restrengthening: float = 1.0
    sticking: Sticking = "turned"
    stick_speed_m_s: float = 2e-4
    stick_interval_s: float | None = None
    contact_stiffness_Pa_per_m: float | None = None
    friction_patch_m: float | None = None
    pulled_edge: PulledEdge | None = None
    machine_stiffness_N_per_m: float | None = None
    slider_mass_kg: float | None = None
    machine_damping_N_s_per_m: float | None = None
    blocks: tuple[int, int] = (85, 85)
    spacing_m: float = 5e-6
    thickness_m: float | None = None
    block_mass: BlockMass = "layer"
    modulus_Pa: float = 0.8e6
    density_kg_m3: float = 1012.0
    damping_per_s: float = 5e5
    speed_m_s: float = 0.2e-3
    shear_factor: float = 1.0
    normal_force: NormalForce = "redistributed"
    edges: Edges = "free"
    pattern_first: tuple[int, int] | None = None
    cavity_shape: Literal["square", "round", "exact"] = "square"
    rotation: Rotation = "small"
    engine: str = "fast"
    dt_s: float = 5e-8
    duration_s: float | None = None
    duration_peaks: float = 3.0
    window_start_peaks: float = 1.05
    window_end_peaks: float | None = None
    peak_rule: Literal["highest", "first"] = "highest"
    peak_drop: float = 0.01
    rest_tolerance: float = 2e-3
    sample_interval_s: float = 1e-6

    def with_(self, **changes: Any) -> SimConfig:
        """A copy with some fields changed."""
        return replace(self, **changes)

    def of_reading(self, name: str) -> SimConfig:
        """A copy with every open choice as the named reading of the paper has it; KeyError for an unknown name."""
        return replace(self, **(OPEN_CHOICES | READINGS[name]))

    @property
    def reading(self) -> str:
        """Name of the reading of the paper that this configuration follows: text, berardo2019, or own."""
        return reading_of({name: getattr(self, name) for name in OPEN_CHOICES})

    @property
    def cavities(self) -> Pattern:
        """The pattern of this run; raises SimulationError where neither pattern nor sample names one."""
        pattern = self.pattern or pattern_of(self.sample)
        if pattern is None:
            raise SimulationError(_unknown_sample(self.sample))
        return pattern

    @property
    def layer_m(self) -> float:
        return self.spacing_m if self.thickness_m is None else self.thickness_m

    @property
    def stiffness_N_m(self) -> float:
        """K_int = 3/4 E l_z, of the springs along the axes; the diagonals have half of it."""
        return 0.75 * self.modulus_Pa * self.layer_m

    @property
    def shear_stiffness_N_m(self) -> float:
        """K_s = K_int (l / l_z)^2, times ``shear_factor``."""
        return self.shear_factor * self.stiffness_N_m * (self.spacing_m / self.layer_m) ** 2

    @property
    def bond_stiffness_N_m(self) -> float:
        """kappa l2, the stiffness of the contact of one block; zero where contact is rigid."""
        return (self.contact_stiffness_Pa_per_m or 0.0) * self.spacing_m**2

    @property
    def mass_kg(self) -> float:
        height_m = self.spacing_m if self.block_mass == "cube" else self.layer_m
        return self.density_kg_m3 * self.spacing_m**2 * height_m

    @property
    def normal_load_N(self) -> float:
        """Nominal load p l2 Nx Ny of the whole domain."""
        return self.pressure_Pa * self.spacing_m**2 * self.blocks[0] * self.blocks[1]

    @property
    def moved_mass_kg(self) -> float:
        """Mass of the slider on a machine of finite stiffness: by default that whose weight is the nominal load."""
        return self.normal_load_N / STANDARD_GRAVITY_M_S2 if self.slider_mass_kg is None else self.slider_mass_kg

    @property
    def pulled_side(self) -> tuple[int, int] | None:
        """Axis (0, x; 1, y) and end (0 or -1) of the row that is pulled; None where all blocks are."""
        if self.pulled_edge is None:
            return None
        along = (math.cos(math.radians(self.angle_deg)), math.sin(math.radians(self.angle_deg)))
        axis = 0 if abs(along[0]) >= abs(along[1]) else 1
        return axis, -1 if (along[axis] > 0.0) == (self.pulled_edge == "leading") else 0

    @property
    def largest_dt_s(self) -> float:
        """Where the explicit step turns unstable: the stiffest lattice mode, or the slider on its machine."""
        slider = math.inf
        if self.machine_stiffness_N_per_m is not None:
            springs = self.blocks[0] * self.blocks[1] * self.shear_stiffness_N_m
            omega2 = (self.machine_stiffness_N_per_m + springs) / self.moved_mass_kg
            slider = _stable_step(omega2, (self.machine_damping_N_s_per_m or 0.0) / self.moved_mass_kg)
        omega2 = (
            STIFFEST * self.stiffness_N_m + self.shear_stiffness_N_m + self.bond_stiffness_N_m
        ) / self.mass_kg
        return min(slider, _stable_step(omega2, self.damping_per_s))

    def check(self) -> SimConfig:
        """This configuration, or SimulationError with everything that is wrong with it."""
        problems = list(_problems(self))
        if problems:
            raise SimulationError(problems)
        return self

    def parameters(self) -> dict[str, Any]:
        """Every input as a flat mapping of plain values, units in the names."""
        flat: dict[str, Any] = {}
        for name, value in asdict(replace(self, pattern=None)).items():
            if isinstance(value, dict):
                flat |= {f"{name}_{k}": v for k, v in value.items()}
            elif value is not None:
                flat[name] = value
        flat["reading"] = self.reading
        pattern = self.cavities
        flat["pattern"] = pattern.name
        flat["cavity"] = pattern.cavity
        if pattern.size_m is not None and pattern.pitch_m is not None:
            flat |= {"cavity_size_m": pattern.size_m, "cavity_pitch_m": pattern.pitch_m}
            flat["cavity_staggered"] = pattern.staggered
        if pattern.is_drawn:
            flat |= {"feature": pattern.feature, "pattern_lattice": pattern.lattice}
        if pattern.picture is not None:
            flat["picture"] = hashlib.sha256(pattern.picture.encode()).hexdigest()[:16]
        flat["thickness_m"] = self.layer_m
        return flat


def _stable_step(omega2: float, g: float) -> float:
    """v' = (1 - g dt) v - w2 dt x, x' = x + dt v' is stable while (w dt)^2 < 4 - 2 g dt."""
    return (math.sqrt(g**2 + 4.0 * omega2) - g) / omega2


def _unknown_sample(sample: str) -> Problem:
    return Problem(
        "unknown_sample", "not a sample of the paper, and no pattern is given", column="sample", found=sample,
        allowed="F, A, B, C, Sx, Sy, or any name with a pattern",
    )  # fmt: skip


# numbers of a configuration, its friction and its terms, and the bound that each lies above
_POSITIVE = {
    "stick_speed_m_s", "stick_interval_s", "pressure_Pa", "spacing_m", "thickness_m", "modulus_Pa", "density_kg_m3",
    "speed_m_s", "shear_factor", "dt_s", "duration_s", "sample_interval_s", "rest_tolerance", "ageing_t0_s",
    "speed_v0_m_s", "contact_stiffness_Pa_per_m", "friction_patch_m", "machine_stiffness_N_per_m",
    "slider_mass_kg",
}  # fmt: skip
_NOT_NEGATIVE = {
    "damping_per_s", "mu_s", "mu_s_sd", "mu_d", "mu_d_sd", "ageing_b", "hold_s", "machine_damping_N_s_per_m",
}  # fmt: skip
_BEYOND_THE_PEAK = {"duration_peaks", "window_start_peaks", "window_end_peaks"}
_CHOICES: dict[str, tuple[str | None, ...]] = {
    "normal_force": ("redistributed", "uniform"),
    "edges": ("free", "periodic"),
    "cavity_shape": ("square", "round", "exact"),
    "rotation": ("small", "finite"),
    "peak_rule": ("highest", "first"),
    "block_mass": ("layer", "cube"),
    "sticking": ("turned", "slow", "never"),
    "pulled_edge": (None, "leading", "trailing"),
}
_OF_THE_STEP = {
    "dt_s", "spacing_m", "thickness_m", "modulus_Pa", "density_kg_m3", "damping_per_s", "shear_factor",
    "contact_stiffness_Pa_per_m", "machine_stiffness_N_per_m", "slider_mass_kg", "machine_damping_N_s_per_m",
}  # fmt: skip
_OF_THE_GEOMETRY = {"spacing_m", "edges", "cavity_shape"}
_OF_THE_WINDOW = {"window_start_peaks", "window_end_peaks"}


def _problems(config: SimConfig) -> Iterator[Problem]:
    """Every fault of a configuration; what follows from several numbers is checked where each of them is possible."""
    faults = [
        *_number_problems(config),
        *_number_problems(config.friction),
        *_number_problems(config.terms),
        *_choice_problems(config),
    ]
    yield from faults
    faulty = {problem.column for problem in faults}
    if not faulty & _OF_THE_GEOMETRY:
        yield from _geometry_problems(config)
    for name in ("slider_mass_kg", "machine_damping_N_s_per_m"):
        if getattr(config, name) is not None and config.machine_stiffness_N_per_m is None:
            yield Problem(
                "no_machine", "needs the stiffness of the machine", column=name, found=f"{getattr(config, name):g}",
                allowed="machine_stiffness_N_per_m beside it",
            )  # fmt: skip
    patch = config.friction_patch_m
    if patch is not None and not faulty & {"friction_patch_m", "spacing_m"}:
        blocks = patch / config.spacing_m
        if round(blocks) < 1 or abs(blocks - round(blocks)) > 1e-6:
            yield Problem(
                "not_whole_blocks", "a patch holds a whole number of blocks", column="friction_patch_m",
                found=f"{patch * 1e6:g} um", allowed=f"multiples of {config.spacing_m * 1e6:g} um",
            )  # fmt: skip
    if config.pulled_edge is not None and config.edges == "periodic":
        yield Problem(
            "no_edge", "periodic edges leave no edge to pull", column="pulled_edge", found=config.pulled_edge,
            allowed="edges free",
        )  # fmt: skip
    of_the_step = _OF_THE_STEP if config.machine_stiffness_N_per_m is None else _OF_THE_STEP | {"pressure_Pa", "blocks"}
    if not faulty & of_the_step and config.dt_s > config.largest_dt_s:
        yield Problem(
            "unstable_step", "the time step exceeds the stability limit", column="dt_s",
            found=f"{config.dt_s:g}", allowed=f"at most {config.largest_dt_s:.3g} s for these springs and masses",
        )  # fmt: skip
    if not faulty & {"dt_s", "duration_s"} and (config.duration_s or 0.0) > MOST_STEPS * config.dt_s:
        yield Problem(
            "too_many_steps", "the run has too many time steps", column="duration_s",
            found=f"{config.duration_s:g} s", allowed=f"at most {MOST_STEPS} steps of {config.dt_s:g} s",
        )  # fmt: skip
    end = config.window_end_peaks
    if not faulty & _OF_THE_WINDOW and end is not None and end <= config.window_start_peaks:
        yield Problem(
            "empty_window", "the sliding window ends before it starts", column="window_end_peaks",
            found=f"{end:g}", allowed=f"more than {config.window_start_peaks:g}",
        )  # fmt: skip
    if not faulty & {"engine", "rotation", "sticking"}:
        yield from _unsupported(config)


def _unsupported(config: SimConfig) -> Iterator[Problem]:
    """What the engine of a configuration cannot do."""
    engine = ENGINES[config.engine]
    if config.rotation == "finite" and not engine.finite_rotation:
        yield Problem(
            "unsupported", f"the {config.engine} engine requires linear forces", column="rotation",
            found="finite", allowed=f"rotation small, or engine {engines_with('finite_rotation')}",
        )  # fmt: skip
    for name, found in (("sticking", config.sticking), ("stick_interval_s", config.stick_interval_s)):
        if found not in ("turned", None) and not engine.sticking_rules:
            yield Problem(
                "unsupported", f"the {config.engine} engine supports only the default", column=name,
                found=str(found), allowed=f"the default, or engine {engines_with('sticking_rules')}",
            )  # fmt: skip
    if config.contact_stiffness_Pa_per_m is not None and not engine.elastic_contact:
        yield Problem(
            "unsupported", f"the {config.engine} engine has rigid contact only", column="contact_stiffness_Pa_per_m",
            found=f"{config.contact_stiffness_Pa_per_m:g}", allowed=f"engine {engines_with('elastic_contact')}",
        )  # fmt: skip
    if config.terms.active and not engine.friction_terms:
        yield Problem(
            "unsupported", f"the {config.engine} engine supports only the friction law of the paper", column="engine",
            found=config.engine, allowed=engines_with("friction_terms"),
        )  # fmt: skip


def _number_problems(part: SimConfig | LocalFriction | FrictionTerms) -> Iterator[Problem]:
    """Numbers that are not finite, out of their bounds, or so large or small that products leave double precision."""
    for field in fields(part):
        name, value = field.name, getattr(part, field.name)
        if isinstance(value, bool) or not isinstance(value, float | int) or name == "seed":
            continue
        if isinstance(value, float) and not math.isfinite(value):
            yield Problem("not_finite", "not a finite number", column=name, found=str(value), allowed="a number")
        elif abs(value) > LARGEST_NUMBER or (name in _POSITIVE and 0 < value < SMALLEST_NUMBER):
            found = f"{value:g}" if abs(value) < 1e300 else "more than 1e300"
            allowed = f"{SMALLEST_NUMBER:g} to {LARGEST_NUMBER:g}"
            yield Problem("impossible_number", "not a possible value", column=name, found=found, allowed=allowed)
        elif name in _POSITIVE and value <= 0:
            yield Problem("not_positive", "must be positive", column=name, found=f"{value:g}", allowed="> 0")
        elif name in _NOT_NEGATIVE and value < 0:
            yield Problem("negative", "must not be negative", column=name, found=f"{value:g}", allowed=">= 0")
        elif name in _BEYOND_THE_PEAK and value <= 1.0:
            yield Problem("too_short", "must extend beyond the peak", column=name, found=f"{value:g}", allowed="> 1")


def _choice_problems(config: SimConfig) -> Iterator[Problem]:
    """Names that are none of those allowed, a seed that is none, and shares that are not between 0 and 1."""
    for name, allowed in {**_CHOICES, "engine": tuple(ENGINES)}.items():
        value = getattr(config, name)
        if value not in allowed:
            yield Problem(
                "unknown_choice", f"unknown {name}", column=name, found=str(value),
                allowed=" or ".join(filter(None, allowed)),
            )  # fmt: skip
    if not (isinstance(config.seed, int) and config.seed >= 0):
        yield Problem("seed", "not a seed", column="seed", found=str(config.seed), allowed="a whole number >= 0")
    for name, possible in (
        ("restrengthening", 0 <= config.restrengthening <= 1), ("peak_drop", 0 < config.peak_drop < 1)
    ):  # fmt: skip
        if not possible:
            found = f"{getattr(config, name):g}"
            yield Problem("share", "not a fraction", column=name, found=found, allowed="0 to 1")


def _geometry_problems(config: SimConfig) -> Iterator[Problem]:
    nx, ny = config.blocks
    if not (isinstance(nx, int) and isinstance(ny, int) and min(nx, ny) >= 3):
        yield Problem(
            "too_small", "too few blocks", column="blocks", found=f"{nx} x {ny}", allowed="3 x 3 or more"
        )
        return
    if nx * ny > MOST_BLOCKS:
        allowed = f"at most {MOST_BLOCKS} blocks"
        yield Problem("too_many_blocks", "too many blocks", column="blocks", found=f"{nx} x {ny}", allowed=allowed)
        return
    pattern = config.pattern or pattern_of(config.sample)
    if pattern is None:
        yield _unknown_sample(config.sample)
        return
    if pattern.cavity == "none":
        return
    if pattern.size_m is None or pattern.pitch_m is None:
        yield Problem("no_geometry", "size or pitch of the cavities is missing", column="pattern", found=pattern.name)
        return
    if pattern.picture is not None:
        if config.edges == "periodic":
            yield from _periodic_problems(config, pattern)
        return
    domain = (nx * config.spacing_m, ny * config.spacing_m)
    for axis, size, pitch, width in zip("xy", pattern.size_m, pattern.pitch_m, domain, strict=True):
        if pattern.cavity in ("ridge", "chevron") and axis == "y":
            continue
        if axis in pattern.too_wide_along or not (size > 0 or pattern.is_drawn):
            yield Problem(
                "impossible_geometry", f"the cavities are too large for their pitch along {axis}", column="pattern",
                found=f"{size * 1e6:g} um in {pitch * 1e6:g} um", allowed="0 < size < pitch",
            )  # fmt: skip
        elif size < 0.5 * config.spacing_m:
            yield Problem(
                "too_coarse", f"the cavities are smaller than half a block along {axis}", column="spacing_m",
                found=f"{config.spacing_m * 1e6:g} um", allowed=f"at most {size * 1e6:g} um",
            )  # fmt: skip
        elif size >= width:
            yield Problem(
                "too_small", f"the domain is smaller than one cavity along {axis}", column="blocks",
                found=f"{width * 1e6:g} um", allowed=f"more than {size * 1e6:g} um",
            )  # fmt: skip
    if config.edges == "periodic":
        yield from _periodic_problems(config, pattern)


def _periodic_problems(config: SimConfig, pattern: Pattern) -> Iterator[Problem]:
    """Under periodic edges a whole number of pitches must fit (two rows of a staggered pattern)."""
    assert pattern.pitch_m is not None
    rows = 1 if pattern.cavity == "ridge" else pattern.pitch_m[1] * (2 if pattern.staggered else 1) / config.spacing_m
    repeat = (pattern.pitch_m[0], rows * config.spacing_m)
    for axis, blocks, length in zip("xy", config.blocks, repeat, strict=True):
        periods = blocks * config.spacing_m / length
        if abs(periods - round(periods)) > 1e-6:
            yield Problem(
                "impossible_geometry", f"the pattern does not repeat over periodic edges along {axis}",
                column="blocks", found=str(blocks),
                allowed=f"multiples of {length / config.spacing_m:g}",
            )  # fmt: skip


def mask_of(config: SimConfig) -> Any:
    """Contact mask of a configuration, shape (ny, nx), True where a block touches; its share where it does in part."""
    drawn = config.cavities.is_drawn or (config.cavity_shape == "exact" and not config.cavities.is_flat)
    if drawn:
        return touching_share(config.cavities, config.blocks, config.spacing_m, config.pattern_first)
    return contact_mask(
        config.cavities, config.blocks, config.spacing_m, config.pattern_first, config.cavity_shape
    )
