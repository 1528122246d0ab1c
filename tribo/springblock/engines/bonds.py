"""The loops over strips where contact is elastic: each contact block is bound to the track by a spring that yields.

While all bonds hold, every block follows the slider at its quasi-static velocity w, and q is counted from w t as on
cavities. A bound block then is one that glides, with its bond k (w t + q - a) as one more force; the bond yields where
that exceeds the static threshold. From there on the block slides against its friction until its velocity w + q' is
zero. Its bond then begins with the force of friction it slid against, along the same line, so that no energy is gained.

In a strip that listens or sleeps no block moves beyond w t; it wakes where the force on one of its blocks exceeds
``Planes.wake`` or a bond its threshold. Otherwise these functions stand for those of
:mod:`tribo.springblock.engines.strips` of the same names.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.springblock.engines.jit import copied_into_callers, inner, inner_vectorised, widest_vectors
from tribo.springblock.engines.state import (
    Numerics,
    drag_rate,
    pace_after,
    pace_before,
    slider_time,
    sliding_threshold,
    static_threshold,
)
from tribo.springblock.engines.strips import CONTACT, LANES, NOTHING, BoolArray, IntArray, Planes, Sums, carried
from tribo.springblock.lattice import INNER

BELOW = 1.0 - 1e-12  # a bond that begins at its threshold does not yield by rounding


@inner
def bond_force(bond: float, frame: float, q: float, anchor: float, elapsed: float) -> float:
    """k (w t + q - a) along one axis; ``elapsed`` is t dt / m, as ``frame`` is m w / dt."""
    return bond * (frame * elapsed + q - anchor)


@inner_vectorised
def bound_forces(p: Planes, strips: IntArray, starts: BoolArray, c: Numerics, t: float) -> None:
    """Force on all blocks of these strips at time t; ``starts`` becomes true where one wakes or its bond yields."""
    widest_vectors()
    copied_into_callers()
    one, width = np.uint64(1), np.uint64(p.width)
    quarter = 0.25 * c.stiffness
    own = 4.0 * INNER[0] + 4.0 * c.inner_shear / c.stiffness
    elapsed, drag = slider_time(t, c.machine) * c.dt / c.mass, drag_rate(c.damping, c.machine) * c.dt
    for m in range(len(strips)):
        first = np.uint64(p.place[strips[m]])
        edge = p.edge[strips[m]]
        near = np.uint64(max(edge, 0))
        free_edge = 1.0 if edge >= 0 else 0.0
        begins = False
        for lane in range(LANES):
            i, j = first + np.uint64(lane), near + np.uint64(lane)
            up, down = i - width, i + width
            rising = p.q_sum[down + one] + p.q_sum[up - one]
            falling = p.q_gap[down - one] + p.q_gap[up + one]
            bent_x = 4.0 * (p.q_x[i + one] + p.q_x[i - one]) + rising + falling - own * p.q_x[i]
            bent_y = 4.0 * (p.q_y[up] + p.q_y[down]) + rising - falling - own * p.q_y[i]
            spare_x = p.spare_xx[j] * p.q_x[i] + p.spare_xy[j] * p.q_y[i]
            spare_y = p.spare_xy[j] * p.q_x[i] + p.spare_yy[j] * p.q_y[i]
            b_x = bond_force(p.bond[i], p.frame_x[i], p.q_x[i], p.anchor_x[i], elapsed)
            b_y = bond_force(p.bond[i], p.frame_y[i], p.q_y[i], p.anchor_y[i], elapsed)
            held = 1.0 if p.pace[i] == 0.0 else 0.0
            there = 1.0 if p.kind[i] != NOTHING else 0.0
            steady = p.bond[i] * elapsed - drag  # what the quasi-static motion alone leaves to a block without bond
            f_x = there * (quarter * bent_x + free_edge * spare_x) + steady * p.frame_x[i] - held * b_x
            f_y = there * (quarter * bent_y + free_edge * spare_y) + steady * p.frame_y[i] - held * b_y
            p.f_x[i] = f_x
            p.f_y[i] = f_y
            hold = static_threshold(p.hold[i], t - p.since[i], c.law)
            wake = p.wake[i]
            begins |= (b_x * b_x + b_y * b_y > hold * hold) | (f_x * f_x + f_y * f_y > wake * wake)
        if begins:
            starts[strips[m]] = True


@inner_vectorised
def bound_glides(p: Planes, strips: IntArray, calm: BoolArray, c: Numerics, sums: Sums) -> None:
    """Move all blocks of these strips, in which every bond holds; ``calm`` of a strip, whether they may rest."""
    widest_vectors()
    copied_into_callers()
    keep = 1.0 - c.damping * c.dt
    way = c.dt * c.dt / c.mass
    quiet = c.rest_force * c.rest_force
    slow = quiet * c.mass / (c.stiffness * c.dt * c.dt)
    for m in range(len(strips)):
        first = np.uint64(p.place[strips[m]])
        loud = False
        for lane in range(LANES):
            i = first + np.uint64(lane)
            f_x, f_y = p.f_x[i], p.f_y[i]
            a = keep * p.p_x[i] + f_x
            b = keep * p.p_y[i] + f_y
            squares = a * a + b * b
            loud |= (squares >= slow) | (f_x * f_x + f_y * f_y >= quiet)
            p.p_x[i] = a
            p.p_y[i] = b
            x = p.q_x[i] + way * a
            y = p.q_y[i] + way * b
            p.q_x[i] = x
            p.q_y[i] = y
            p.q_sum[i] = x + y
            p.q_gap[i] = x - y
            sums.along[lane] += a * c.direction_x + b * c.direction_y
            sums.squares[lane] += squares + carried(a, b, p.frame_x[i], p.frame_y[i], c.dt, c.machine)
        if calm[strips[m]] == loud:
            calm[strips[m]] = not loud


@inner_vectorised
def bound_slides(p: Planes, strips: IntArray, moving: IntArray, c: Numerics, step: int, sums: Sums) -> None:
    """Move all blocks of these strips; ``moving`` of a strip, how many contact blocks slide.

    Friction opposes the velocity w + q'. It stays the same through the step in which a block comes to rest: from where
    that is, the bond takes it over. A bond that yields loses the energy by which it was stretched beyond that force.
    """
    widest_vectors()
    copied_into_callers()
    t = c.start + step * c.dt
    keep = 1.0 - c.damping * c.dt
    way = c.dt * c.dt / c.mass
    elapsed = slider_time(t, c.machine) * c.dt / c.mass
    earlier, later = pace_before(c.machine), pace_after(c.dt, c.machine)
    for m in range(len(strips)):
        first = np.uint64(p.place[strips[m]])
        on_the_way = 0
        for lane in range(LANES):
            i = first + np.uint64(lane)
            w_x, w_y = p.frame_x[i], p.frame_y[i]
            b_x = bond_force(p.bond[i], w_x, p.q_x[i], p.anchor_x[i], elapsed)
            b_y = bond_force(p.bond[i], w_y, p.q_y[i], p.anchor_y[i], elapsed)
            slid = p.pace[i] > 0.0
            holding = static_threshold(p.hold[i], t - p.since[i], c.law)
            yields = (p.kind[i] == CONTACT) & (not slid) & (b_x * b_x + b_y * b_y > holding * holding)
            rubs = slid | yields
            part = 0.5 if yields else 1.0  # of the step that the new force acts on a velocity in the middle of steps
            released = part if yields else 0.0
            a = keep * p.p_x[i] + p.f_x[i] + released * b_x
            b = keep * p.p_y[i] + p.f_y[i] + released * b_y
            whole_x, whole_y = a + later * w_x, b + later * w_y
            before_x, before_y = p.p_x[i] + earlier * w_x, p.p_y[i] + earlier * w_y
            was = math.sqrt(before_x * before_x + before_y * before_y)
            drive = math.sqrt(whole_x * whole_x + whole_y * whole_y)
            sliding = sliding_threshold(p.sliding[i], c.dt / c.mass * was, c.law)
            excess = drive - part * sliding
            stops = rubs & (excess <= 0.0)
            along_x = (b_x if yields else before_x) if stops else whole_x
            along_y = (b_y if yields else before_y) if stops else whole_y
            amount = math.sqrt(along_x * along_x + along_y * along_y)
            per = 1.0 / (amount if amount > 0.0 else 1.0)
            rub = part * sliding * per if rubs else 0.0
            a -= rub * along_x
            b -= rub * along_y
            middle = was + excess
            way_to_rest = 0.125 * middle * middle / (was - excess if was > excess else 1.0)
            length = (way_to_rest if stops else excess) if rubs else 0.0
            stretch = min(sliding, p.again[i]) * BELOW / (p.bond[i] if rubs else 1.0) - way * way_to_rest
            p.anchor_x[i] = p.q_x[i] + w_x * elapsed - stretch * per * along_x if stops else p.anchor_x[i]
            p.anchor_y[i] = p.q_y[i] + w_y * elapsed - stretch * per * along_y if stops else p.anchor_y[i]
            x = p.q_x[i] + way * a
            y = p.q_y[i] + way * b
            p.q_x[i] = x
            p.q_y[i] = y
            p.q_sum[i] = x + y
            p.q_gap[i] = x - y
            p.p_x[i] = a
            p.p_y[i] = b
            sums.along[lane] += a * c.direction_x + b * c.direction_y
            sums.squares[lane] += a * a + b * b + carried(a, b, w_x, w_y, c.dt, c.machine)
            lost = 0.5 * (b_x * b_x + b_y * b_y - sliding * sliding) / ((p.bond[i] if rubs else 1.0) * way)
            sums.work[lane] += length * sliding + (lost if yields else 0.0)
            slides = rubs & (not stops)
            p.pace[i] = max(length, 1e-300) if slides else 0.0
            rested = p.again[i] if stops else p.hold[i]
            p.hold[i] = np.inf if slides else rested
            if c.law is not None:
                p.since[i] = t if stops else p.since[i]
            on_the_way += 1 if slides else 0
        if moving[strips[m]] != on_the_way:
            moving[strips[m]] = on_the_way


def energy_of_bonds(p: Planes, inside: NDArray[np.int64], elapsed: float) -> float:
    """Energy in the bonds; that of a sliding block is stretched by its friction."""
    k = p.bond[inside]
    x, y = (
        np.asarray(bond_force(k, frame[inside], q[inside], anchor[inside], elapsed))  # type: ignore[arg-type]
        for frame, q, anchor in ((p.frame_x, p.q_x, p.anchor_x), (p.frame_y, p.q_y, p.anchor_y))
    )
    force: FloatArray = np.where(p.pace[inside] > 0.0, p.sliding[inside], np.hypot(x, y))
    return float(0.5 * (force[k > 0.0] ** 2 / k[k > 0.0]).sum())
