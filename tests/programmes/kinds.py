"""Forty and more kinds of programme, each with the channels that a rig of its kind records."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from .rig import Contact, Noise, Record, Segment, recorded

Made = Callable[[np.random.Generator], Record]
MM = 1e-3


def _noise(rng: np.random.Generator, **more: float) -> Noise:
    """Sizes as measured on the records of real rigs: 1 to 5 % rough, correlated over one to eight samples."""
    drawn = Noise(float(rng.uniform(0.008, 0.04)), float(rng.uniform(0.8, 6.0)), float(rng.uniform(0.001, 0.005)))
    return replace(drawn, **more)


def _contact(rng: np.random.Generator, **more: float) -> Contact:
    return replace(
        Contact(float(rng.uniform(0.15, 0.6)), float(rng.uniform(0.15, 0.5)), length_m=float(rng.uniform(0.5e-4, 3e-4)),
                relaxes=float(rng.uniform(0.05, 0.25)), relaxes_s=float(rng.uniform(0.1, 1.0))), **more
    )  # fmt: skip


def _offset(rng: np.random.Generator) -> float:
    return float(rng.uniform(-0.3, 0.3))


def pull(
    kind: str, channels: str, rng: np.random.Generator, *, stops: bool = False, lost: bool = False, shaken: bool = False
) -> Record:  # fmt: skip
    """A sled from rest, at 1 to 5 mm/s, with or without a stop of the drive at its end.

    ``shaken``: noise of 2 to 4 % that grows with the force from the first of its rise, on a soft spring.
    """
    load, v = float(rng.uniform(2, 20)), float(rng.uniform(1, 5)) * MM
    parts = [Segment("rest", rng.uniform(2, 6), 0, load), Segment("slide", rng.uniform(20, 60), v, load)]
    parts += [Segment("end", rng.uniform(4, 12), 0, load)] if stops else []
    contact = _contact(rng, stiffness=float(load * rng.uniform(200, 1500)))
    noise = _noise(rng)
    if shaken:
        noise = replace(noise, rough=(size := float(rng.uniform(0.02, 0.04))), rough_rise=size)
        contact = replace(contact, stiffness=float(load * np.exp(rng.uniform(np.log(30), np.log(500)))))
    return recorded(kind, parts, contact, noise, channels, rng, offset_N=_offset(rng), lost=lost)


def loaded_pull(kind: str, channels: str, rng: np.random.Generator) -> Record:
    """A pin that is lowered, loaded, drawn, stopped, unloaded and lifted."""
    load, v = float(rng.uniform(2, 20)), float(rng.uniform(1, 5)) * MM
    parts = [
        Segment("approach", rng.uniform(3, 8), 0, 0), Segment("loading", rng.uniform(2, 5), 0, load, ramp=True),
        Segment("rest", rng.uniform(2, 6), 0, load), Segment("slide", rng.uniform(20, 60), v, load),
        Segment("end", rng.uniform(3, 8), 0, load), Segment("unloading", rng.uniform(1, 3), 0, 0, ramp=True),
        Segment("lift-off", rng.uniform(3, 8), 0, 0),
    ]  # fmt: skip
    contact = _contact(rng, stiffness=float(load * rng.uniform(200, 1500)))
    found = recorded(kind, parts, contact, _noise(rng), channels, rng, offset_N=_offset(rng))
    if "L" not in channels:  # nothing tells when the bodies touch, nor of a load that is taken off
        found.parts = [("rest", 0.0, found.parts[2][2]), found.parts[3], ("end", found.parts[4][1], found.time_s[-1])]
    return found


def ladder(
    kind: str, channels: str, rng: np.random.Generator, *, down: bool = False, rpm: bool = False, rest: bool = False,
    ramp_s: float = 0.0,
) -> Record:  # fmt: skip
    """Levels of speed, three to nine of them, a factor of 1.3 to 3 apart, up or up and down again."""
    load, levels = float(rng.uniform(2, 20)), int(rng.integers(3, 6))
    speeds = 2 * MM * np.cumprod([1.0, *rng.uniform(1.3, 3.0, levels - 1)])
    speeds = np.array([*speeds, *speeds[-2::-1]]) if down else speeds
    parts = [Segment("rest", rng.uniform(3, 6), 0, load)] if rest else []
    for k, v in enumerate(speeds):
        if k and ramp_s:
            parts.append(Segment("step", ramp_s, float(v), load, ramp=True))
        parts.append(Segment("slide", rng.uniform(15, 30), float(v), load))
    contact = _contact(
        rng, slope=float(rng.uniform(-0.25, 0.25)), excess=float(rng.uniform(0, 0.3)),
        stiffness=float(load * rng.uniform(1500, 3000)), length_m=2e-4,
    )  # fmt: skip
    found = recorded(
        kind, parts, contact, _noise(rng, tachometer=float(rng.choice([0.001, 0.01, 0.05]))), channels, rng,
        sliding_already=not rest, rpm_at_m=10 * MM if rpm else 0.0, rate_Hz=25.0,
    )  # fmt: skip
    found.from_rest = rest
    found.told = bool(set("SPR") & set(channels))
    return found


def load_ladder(kind: str, channels: str, rng: np.random.Generator, *, rest: bool = True) -> Record:
    """Levels of load at one speed."""
    v, levels = float(rng.uniform(2, 10)) * MM, int(rng.integers(3, 7))
    loads = float(rng.uniform(2, 5)) * np.cumprod([1.0, *rng.uniform(1.25, 2.0, levels - 1)])
    parts = [Segment("rest", rng.uniform(3, 6), 0, float(loads[0]))] if rest else []
    for k, load in enumerate(loads):
        if k:
            parts.append(Segment("step", rng.uniform(0.5, 2), v, float(load), ramp=True))
        parts.append(Segment("slide", rng.uniform(15, 30), v, float(load)))
    contact = _contact(rng, stiffness=float(loads[0] * rng.uniform(1500, 3000)))
    found = recorded(
        kind, parts, contact, _noise(rng), channels, rng, sliding_already=not rest, rate_Hz=25.0, offset_N=0.0
    )
    found.from_rest, found.told = rest, "L" in channels
    return found


def strokes(kind: str, channels: str, rng: np.random.Generator, *, dead: bool = False, sine: bool = False) -> Record:
    """Strokes to and fro, with a dead time at every end, or as a sinusoid."""
    load, v, count = float(rng.uniform(2, 20)), float(rng.uniform(1, 5)) * MM, 2 * int(rng.integers(3, 7))
    lasts = float(rng.uniform(4, 8))
    parts: list[Segment] = []
    for k in range(count):
        way = 1.0 if k % 2 == 0 else -1.0
        parts.append(Segment("stroke", lasts, way * v, load))
        if dead and k < count - 1:
            parts.append(Segment("hold", lasts * rng.uniform(0.2, 0.5), 0, load))
    # a rig whose slider has been going to and fro already; its spring gives by a hundredth of the stroke
    stiff = 0.6 * load / (0.005 * v * lasts)
    contact = _contact(rng, excess=float(rng.uniform(0.0, 0.1)), stiffness=stiff, length_m=0.002 * v * lasts)
    found = recorded(
        kind, parts, contact, _noise(rng, position_m=2e-5 * v * lasts), channels, rng, sliding_already=True,
        offset_N=0.1 * contact.sliding * load * float(rng.uniform(-1, 1)),
    )  # fmt: skip
    if sine:
        found = _sinusoid(found, channels, v, lasts, rng)
    found.from_rest = True  # every stroke begins at a standstill
    beyond = found.channels["friction force (N)"] - found.clean_N
    found.truth["offset_N"] = float(beyond[found.slides].mean())
    return found


def _sinusoid(found: Record, channels: str, v: float, lasts: float, rng: np.random.Generator) -> Record:
    """The same strokes on a crank: force as before, position and speed as a crank has them."""
    time = found.time_s
    speed = v * np.pi / 2 * np.sin(np.pi * time / lasts)
    if "S" in channels:
        found.channels["speed (mm/s)"] = 1e3 * speed * (1 + 0.002 * rng.normal(size=time.size))
    if "P" in channels:
        found.channels["displacement (mm)"] = 1e3 * v * lasts / 2 * (1 - np.cos(np.pi * time / lasts))
    found.speed = speed
    return found


def disc(
    kind: str, channels: str, rng: np.random.Generator, *, runs_in: float = 0.0, drift: float = 0.0,
    tachometer: float = 0.002, lost: bool = False,
) -> Record:  # fmt: skip
    """A disc that turns from the first row to the last, half an hour at 1 to 5 Hz."""
    load, v, rate = float(rng.uniform(3, 60)), float(rng.uniform(30, 200)) * MM, float(rng.choice([1.0, 2.0]))
    lasts = float(rng.uniform(1500, 2400))
    contact = _contact(
        rng, runs_in=runs_in, runs_in_m=v * lasts * float(rng.uniform(0.04, 0.1)), per_m=drift / (v * lasts),
        round_m=float(rng.uniform(0.03, 0.1)), round_share=float(rng.uniform(0, 0.03)), stiffness=load * 2e4,
    )  # fmt: skip
    noise = _noise(rng, rough=float(rng.uniform(0.005, 0.025)), tachometer=tachometer)
    found = recorded(
        kind, [Segment("slide", lasts, v, load)], contact, noise, channels, rng, rate_Hz=rate, sliding_already=True,
        rpm_at_m=12 * MM, lost=lost,
    )  # fmt: skip
    found.from_rest = False
    found.truth |= {"run_in_m": contact.runs_in_m, "sliding_N": contact.sliding * load, "drift": drift}
    return found


def speed_steps(kind: str, channels: str, rng: np.random.Generator) -> Record:
    """A sheared layer that is stepped in speed, tenfold up and down, with a change at once and one over a length."""
    load, v = float(rng.uniform(5, 20)), float(rng.uniform(0.3, 1.0)) * 1e-6
    steps = [v, 10 * v, v] if rng.random() < 0.5 else [v, 10 * v]
    parts = [Segment("slide", 60e-6 / u + 40, u, load) for u in steps]
    contact = _contact(
        rng, slope=float(rng.uniform(-0.05, 0.03)), direct=float(rng.uniform(0.01, 0.03)), length_m=5e-6,
        stiffness=load * 1e6,
    )  # fmt: skip
    noise = _noise(rng, rough=float(rng.uniform(0.0005, 0.002)), recorder_N=1e-3, position_m=2e-8)
    found = recorded(kind, parts, contact, noise, channels, rng, rate_Hz=10.0, sliding_already=True)
    found.from_rest, found.told = False, bool(set("SP") & set(channels))
    return found


def slide_hold_slide(kind: str, channels: str, rng: np.random.Generator) -> Record:
    """Slides with holds of 3 to 100 s between them; the static force grows with their logarithm."""
    load, v = float(rng.uniform(2, 20)), float(rng.uniform(1, 3)) * MM
    holds = np.geomspace(3, float(rng.uniform(40, 100)), int(rng.integers(3, 6)))
    parts = [Segment("rest", 5, 0, load), Segment("slide", 20, v, load)]
    for hold in holds:
        parts += [Segment("hold", float(hold), 0, load), Segment("slide", 20, v, load)]
    contact = _contact(
        rng, excess=0.1, healing=float(rng.uniform(0.05, 0.12)), stiffness=float(load * rng.uniform(400, 1500)),
        relaxes=float(rng.uniform(0.1, 0.3)),
    )  # fmt: skip
    noise = _noise(rng, rough=float(rng.uniform(0.004, 0.012)))
    found = recorded(kind, parts, contact, noise, channels, rng, offset_N=_offset(rng))
    found.truth["healing_N"] = contact.healing * contact.sliding * load
    return found


def _of(make: Callable[..., Record], name: str, channels: str, **how: object) -> tuple[str, Made]:
    told = {"S": "speed", "P": "position", "L": "load", "R": "rpm"}
    kind = f"{name}, {' and '.join(told[c] for c in channels) or 'force'} only"
    return kind, partial(make, kind, channels, **how)


KINDS: dict[str, Made] = dict(
    [
        *(_of(pull, "pull", c) for c in ("S", "P", "")),
        *(_of(pull, "pull and stop", c, stops=True) for c in ("S", "P", "")),
        *(_of(pull, "pull with lost rows", c, stops=True, lost=True) for c in ("S", "P", "")),
        *(_of(loaded_pull, "loaded pull", c) for c in ("SL", "L", "P", "")),
        *(_of(ladder, "ladder of speed", c) for c in ("S", "P", "SL", "")),
        *(_of(ladder, "ladder of speed from rest", c, rest=True) for c in ("S", "P")),
        *(_of(ladder, "ladder up and down", c, down=True, ramp_s=1.0) for c in ("S", "P")),
        *(_of(ladder, "ladder of rpm", c, rpm=True, down=True) for c in ("R", "RL")),
        *(_of(load_ladder, "ladder of load", c) for c in ("SL", "L")),
        _of(load_ladder, "ladder of load in motion", "L", rest=False),
        *(_of(strokes, "strokes", c) for c in ("S", "P", "")),
        *(_of(strokes, "strokes of a crank", c, sine=True) for c in ("S", "P")),
        *(_of(strokes, "strokes with dead time", c, dead=True) for c in ("S", "P", "")),
        *(_of(disc, "disc", c) for c in ("S", "")),
        _of(disc, "disc with a noisy tachometer", "R", tachometer=0.15),
        *(_of(disc, "disc that runs in", c, runs_in=0.4) for c in ("S", "R")),
        _of(disc, "disc that drifts", "S", drift=0.2),
        _of(disc, "disc with lost rows", "S", runs_in=0.2, lost=True),
        *(_of(speed_steps, "steps of speed", c) for c in ("S", "P", "")),
        *(_of(slide_hold_slide, "slide-hold-slide", c) for c in ("S", "P", "")),
        *(_of(pull, "pull with a rough rise", c, shaken=True) for c in ("S", "P", "")),
    ]
)
