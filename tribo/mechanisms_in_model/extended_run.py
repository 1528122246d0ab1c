"""Putting a mechanism into the spring-block model itself: ``tribo simulate --with suction:dp=3000``.

Every mechanism of the library can be simulated. Its placement says whether it acts on the blocks or in the measuring
chain (:mod:`tribo.mechanisms_in_model.on_blocks`), or replaces the sample by another one. At zero amplitude a run is
that of the baseline to the bit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Base, Mechanism, Values
from tribo.mechanisms_in_model.on_blocks import NOT_PULLED, RECORDED, Pulled, conditions_of_run, measured, run_with
from tribo.records import Run
from tribo.springblock.config import SimConfig
from tribo.springblock.lattice import pattern_of

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
