"""One run of a slider on a machine, from a configuration to its motion and force."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from tribo.display import displayed
from tribo.errors import Problem, SimulationError
from tribo.input_files import LARGEST_NUMBER, MOST_STEPS, SMALLEST_NUMBER
from tribo.records import FloatArray
from tribo.slider.contact_laws import SLIDER_LAWS, Contact, SlipContact, StateContact
from tribo.slider.motion import Drive, SliderMachine, constant_speed, path_of, slide_exactly, slide_integrated
from tribo.user_text import did_you_mean

WINDOW_FROM_PEAKS = 1.05  # as for blocks: sliding friction is a mean from 1.05 times the time of the peak on
_SLOW = 0.01  # share of the largest speed of the drive below which a slider that never rests counts as stuck


@displayed(lambda c: f"a slider under {c.law}, {c.drive.label}")
@dataclass(frozen=True)
class SliderConfig:
    """One run of a slider that a machine pulls through a spring. SI units.

    Parameters
    ----------
    mass_kg
        Mass of the slider and what moves with it; 0, without inertia, for rate-and-state laws only.
    stiffness_N_per_m, damping_N_s_per_m
        Spring and damper between drive and slider, side by side.
    normal_load_N
        Normal load.
    law : str
        Name of a law in :data:`tribo.slider.SLIDER_LAWS`.
    values : mapping
        Its parameters by name.
    drive : tribo.slider.Drive
        What the machine does.
    backlash_m
        Gap through which the spring engages: it carries no force while drive and slider are less than half of it from
        its middle.
    duration_s, rate_Hz
        Length of the run, and samples per second in the result.
    begins_sliding : bool
        Begin in steady sliding with the drive, and not at rest with a slack spring. Rate-and-state laws always do.
    noise_N, seed
        Standard deviation of white noise that the load cell adds to the force, and the seed that draws it.
    method : str
        "fast", or "integrated" for the readable twin by scipy.

    Examples
    --------
    >>> import tribo
    >>> config = tribo.SliderConfig(values={"mu_s": 0.4, "mu_d": 0.3}, duration_s=20.0)
    >>> round(tribo.simulate_slider(config).static_friction, 2)
    0.4
    """

    mass_kg: float = 0.03
    stiffness_N_per_m: float = 170.0
    damping_N_s_per_m: float = 0.0
    normal_load_N: float = 0.3
    law: str = "coulomb"
    values: Mapping[str, Any] = field(default_factory=dict)
    drive: Drive = field(default_factory=lambda: constant_speed(100e-6))
    backlash_m: float = 0.0
    duration_s: float = 10.0
    rate_Hz: float = 2000.0
    begins_sliding: bool = False
    noise_N: float = 0.0
    seed: int = 0
    method: str = "fast"

    def with_(self, **changes: Any) -> SliderConfig:
        """A copy with fields, parameters of the law, or the constant speed ``speed_m_s`` changed."""
        own = {f.name for f in fields(self)}
        given = {name: value for name, value in changes.items() if name in own}
        if "speed_m_s" in changes:
            given["drive"] = constant_speed(changes["speed_m_s"])
        law = {name: value for name, value in changes.items() if name not in own and name != "speed_m_s"}
        if law:
            given["values"] = {**self.values, **given.get("values", {}), **law}
        return replace(self, **given)

    def contact(self) -> Contact:
        """The contact that the law makes of its values and the load; SimulationError with everything that is wrong."""
        law = SLIDER_LAWS.get(self.law)
        if law is None:
            allowed = did_you_mean(self.law, list(SLIDER_LAWS)) or ", ".join(SLIDER_LAWS)
            raise SimulationError(Problem("unknown_law", "no such law", column="law", found=self.law, allowed=allowed))
        values, problems = law.checked(self.values)
        if problems:
            raise SimulationError(problems)
        return law.contact(values, self.normal_load_N)

    def check(self) -> SliderConfig:
        """This configuration, or SimulationError with everything that is wrong with it."""
        problems = [
            Problem("out_of_range", "not possible", column=name, found=f"{getattr(self, name)!r}", allowed=allowed)
            for name, allowed, low in _LIMITS
            if not _within(getattr(self, name), low)
        ]
        if self.method not in ("fast", "integrated"):
            problems.append(Problem("wrong_value", "no such method", column="method", found=str(self.method),
                                    allowed="fast or integrated"))  # fmt: skip
        if not problems and (samples := self.duration_s * self.rate_Hz) > MOST_STEPS:
            problems.append(Problem("too_long", "too many samples", column="rate_Hz", found=f"{samples:.3g}",
                                    allowed=f"at most {MOST_STEPS}"))  # fmt: skip
        try:
            contact = self.contact()
            if isinstance(contact, StateContact):
                problems += _faults_of_state(self)
            elif not self.mass_kg > 0.0:
                problems.append(Problem("out_of_range", "this law needs inertia", column="mass_kg",
                                        found=f"{self.mass_kg!r}", allowed="above 0"))  # fmt: skip
        except SimulationError as refused:
            problems += refused.problems
        if problems:
            raise SimulationError(problems)
        return self

    def parameters(self) -> dict[str, Any]:
        """Every input as a flat mapping of plain values, units in the names; those of the law begin with ``law_``."""
        flat = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("values", "drive", "law")}
        values = SLIDER_LAWS[self.law].checked(self.values)[0]
        drive = {"drive": self.drive.label, "amplitude_m": self.drive.amplitude_m,
                 "frequency_Hz": self.drive.frequency_Hz}  # fmt: skip
        if len(self.drive.knots_s) <= 1000:
            drive |= {"drive_knots_s": self.drive.knots_s, "drive_speeds_m_s": self.drive.speeds_m_s}
        return {**flat, "law": self.law, **drive, **{f"law_{name}": value for name, value in values.items()}}


_LIMITS = (
    ("mass_kg", "0 or more", 0.0), ("stiffness_N_per_m", "above 0", None), ("damping_N_s_per_m", "0 or more", 0.0),
    ("normal_load_N", "above 0", None), ("backlash_m", "0 or more", 0.0), ("duration_s", "above 0", None),
    ("rate_Hz", "above 0", None), ("noise_N", "0 or more", 0.0),
)  # fmt: skip


def _within(value: Any, low: float | None) -> bool:
    """Whether a number is finite, not beyond what a computer can square, and above zero, or zero where that is low."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating) or not math.isfinite(value):
        return False
    return bool(value == low or SMALLEST_NUMBER <= value <= LARGEST_NUMBER)


def _faults_of_state(config: SliderConfig) -> list[Problem]:
    """What a rate-and-state run cannot have."""
    problems = []
    if config.drive.amplitude_m:
        what = "rate-and-state laws know sliding forwards only: no sinusoid"
        problems.append(Problem("wrong_drive", what, column="drive", found=config.drive.label))
    for name in ("damping_N_s_per_m", "backlash_m"):
        if config.mass_kg == 0.0 and getattr(config, name):
            problems.append(Problem("out_of_range", "without mass this must be 0", column=name,
                                    found=f"{getattr(config, name):g}"))  # fmt: skip
    if config.drive.speeds_m_s[0] <= 0.0 and not config.drive.amplitude_m:
        what = "a rate-and-state slider begins in steady sliding: the first speed of the drive must be positive"
        problems.append(Problem("wrong_drive", what, column="drive", found=f"{config.drive.speeds_m_s[0]:g} m/s"))
    return problems


@displayed(lambda run: f"a slider under {run.config.law}: {run.starts_s.size} slips in {run.time_s[-1]:g} s")
@dataclass(frozen=True)
class SliderRun:
    """The motion of a slider and the force that the machine reads.

    Parameters
    ----------
    config : SliderConfig
        What was asked for.
    time_s, force_N, drive_m, position_m, velocity_m_s, stuck : arrays, shape (n,)
        Time, force of spring and damper on the slider (N), position of drive and slider (m), speed of the slider (m/s),
        and whether it is at rest; where it never rests (rate and state), whether it is slower than a hundredth of the
        drive.
    starts_s, stops_s : arrays, shape (slips,) each
        When it began to slide and came to rest, exact; empty where it never rests.
    static_friction, sliding_friction : float
        Force over normal load: its highest value before the second slip, and its mean over ``window_s``.
    peak_s : float
        When that force is reached.
    window_s : (float, float)
        From 1.05 times the peak time to the end.
    states_s : array, shape (states, n)
        State variables of a rate-and-state law in s; no rows for other laws.

    Examples
    --------
    >>> import tribo
    >>> run = tribo.simulate_slider(tribo.SliderConfig(values={"mu_s": 0.4, "mu_d": 0.3}, duration_s=20.0))
    >>> run.starts_s.size, bool(run.stuck[0])
    (4, True)
    """

    config: SliderConfig
    time_s: FloatArray
    force_N: FloatArray
    drive_m: FloatArray
    position_m: FloatArray
    velocity_m_s: FloatArray
    stuck: np.ndarray
    starts_s: FloatArray
    stops_s: FloatArray
    static_friction: float
    sliding_friction: float
    peak_s: float
    window_s: tuple[float, float]
    states_s: FloatArray


def simulate_slider(config: SliderConfig) -> SliderRun:
    """Simulate a slider on a machine.

    With friction that depends on the slip (coulomb, ageing, adhesion, slip_weakening, viscous) the motion is exact from
    event to event. With friction that depends on the speed (stribeck) sliding is integrated by scipy's DOP853 to
    relative 1e-11. Rate and state (dieterich, ruina) is integrated without inertia by a compiled method of order 5 to
    1e-11, with inertia by scipy's Radau to 1e-9.

    Parameters
    ----------
    config
        Mass, machine, load, law, drive and duration.

    Returns
    -------
    SliderRun
        Force and motion over time.

    Raises
    ------
    SimulationError
        The configuration is impossible (every fault is listed), or the motion cannot be integrated.

    Examples
    --------
    >>> import tribo
    >>> config = tribo.SliderConfig(values={"mu_s": 0.36, "mu_d": 0.30}, duration_s=30.0)
    >>> run = tribo.simulate_slider(config)
    >>> print(f"{run.starts_s.size} slips, {100 * run.stuck.mean():.0f} % of the time stuck")
    11 slips, 98 % of the time stuck
    """
    config.check()
    contact, drive = config.contact(), config.drive
    machine = SliderMachine(config.mass_kg, config.stiffness_N_per_m, config.damping_N_s_per_m, config.backlash_m)
    time = np.arange(int(config.duration_s * config.rate_Hz * (1 + 1e-12)) + 1) / config.rate_Hz
    place, pace = drive.position_m(time), drive.speed_m_s(time)
    states, starts, stops = np.zeros((0, time.size)), np.zeros(0), np.zeros(0)
    if isinstance(contact, StateContact):
        from tribo.slider.rate_and_state import friction_path

        _, v, x, states = friction_path(machine, contact, drive, time, config.method == "integrated")
        stuck = v < _SLOW * float(np.max(np.abs(pace)))
    else:
        exact = isinstance(contact, SlipContact) and config.method == "fast"
        slide: Any = slide_exactly if exact else slide_integrated
        path = path_of(machine, contact, drive, time, config.begins_sliding, slide)
        x, v, stuck = path.position_m, path.velocity_m_s, path.stuck
        starts, stops = np.array(path.starts_s), np.array(path.stops_s)
    force = machine.spring_N(place - x) + config.damping_N_s_per_m * (pace - v)
    static, peak_s = _static(machine, config, time, force, starts)
    if config.noise_N:
        force = force + config.noise_N * np.random.default_rng(config.seed).standard_normal(time.size)
    start = min(WINDOW_FROM_PEAKS * peak_s, float(time[-1]))
    window = time >= start
    return SliderRun(
        config, time, force, place, x, v, stuck, starts, stops, static / config.normal_load_N,
        float(force[window].mean()) / config.normal_load_N, peak_s, (start, float(time[-1])), states,
    )  # fmt: skip


def _static(
    machine: SliderMachine, config: SliderConfig, time: FloatArray, force: FloatArray, starts: FloatArray
) -> tuple[float, float]:
    """The highest force before the second slip and when it is reached: exact where it is the start of the first one."""
    until = starts[1] if starts.size > 1 else time[-1]
    before = np.abs(force[time <= until])
    highest = int(np.argmax(before))
    if starts.size and not config.begins_sliding:
        first = float(starts[0])  # the slider is still at 0
        place, speed = config.drive.position_m(first), config.drive.speed_m_s(first)
        pull = machine.spring_N(place) + machine.damping_N_s_per_m * speed
        if abs(pull) >= before[highest]:
            return float(abs(pull)), first
    return float(before[highest]), float(time[highest])
