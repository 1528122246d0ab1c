"""The same time step on all blocks at once, laid out so that the processor's vector units can be used."""

from __future__ import annotations

import math

import numpy as np

from tribo.records import FloatArray
from tribo.simulate import kernels as k
from tribo.simulate.friction import sliding_threshold, static_threshold
from tribo.simulate.jit import compiled
from tribo.simulate.kernels import (
    CODE,
    DENSE_STEPS,
    RUNNING,
    STEP,
    Numerics,
    Samples,
    State,
    last_stretch,
    observe,
)
from tribo.simulate.lattice import Lattice
from tribo.simulate.masks import BoolArray

# planes of the dense layout, each (ny, nx)
VX, VY, RX, RY, OX, OY, FS, FD, KXX, KYY, KXY, SINCE, GOES, PLANES = range(14)
_FROM_CELLS = {
    VX: k.VX, VY: k.VY, RX: k.RX, RY: k.RY, FS: k.FS, FD: k.FD, KXX: k.KXX, KYY: k.KYY, KXY: k.KXY, SINCE: k.SINCE
}  # fmt: skip


def advance_dense(state: State, out: Samples, numerics: Numerics, until_step: int, lattice: Lattice) -> None:
    """Integrate all blocks until few enough move, then hand them back to the active set."""
    ny, nx = lattice.ny, lattice.nx
    cells = state.cells[:-1]
    q = np.zeros((2, ny + 2, nx + 2))
    q[:, 1:-1, 1:-1] = cells[:, k.QX : k.QY + 1].T.reshape(2, ny, nx)
    planes = np.zeros((PLANES, ny, nx))
    for plane, column in _FROM_CELLS.items():
        planes[plane] = cells[:, column].reshape(ny, nx)
    # what of G does not come from q: the constant drag on cavities that follow the slider
    constant = cells[:, k.GX : k.GY + 1] - numerics.stiffness * lattice.spring_forces(cells[:, k.QX : k.QY + 1])
    constant[lattice.contact] = 0.0
    planes[[OX, OY]] = constant.T.reshape(2, ny, nx)
    state.counts[CODE] = RUNNING
    integrate(q[0], q[1], planes, lattice.contact.reshape(ny, nx), np.zeros((4, nx)), state, out, numerics, until_step)
    cells[:, k.QX : k.QY + 1] = q[:, 1:-1, 1:-1].reshape(2, -1).T
    with np.errstate(over="ignore", invalid="ignore"):  # the caller refuses a run that met such a number
        cells[:, k.GX : k.GY + 1] = numerics.stiffness * lattice.spring_forces(cells[:, k.QX : k.QY + 1]) + constant
    for plane, column in ((VX, k.VX), (VY, k.VY), (SINCE, k.SINCE)):
        cells[:, column] = planes[plane].ravel()
    _rest_cavities(cells, lattice, numerics)
    k.start_lists(state, numerics)


def _rest_cavities(cells: FloatArray, lattice: Lattice, numerics: Numerics) -> None:
    speed, force = np.hypot(*cells[:, k.VX : k.VY + 1].T), np.hypot(*cells[:, k.GX : k.GY + 1].T)
    rest_speed = numerics.rest_force / math.sqrt(numerics.stiffness * numerics.mass)
    calm = ~lattice.contact & (speed < rest_speed) & (force < numerics.rest_force)
    cells[calm, k.VX : k.VY + 1] = 0.0


@compiled
def integrate(
    qx: FloatArray,
    qy: FloatArray,
    planes: FloatArray,
    contact: BoolArray,
    sums: FloatArray,
    s: State,
    out: Samples,
    c: Numerics,
    until_step: int,
) -> None:
    """Steps of all blocks up to ``until_step``, or fewer once the active set would be faster."""
    while s.counts[STEP] < until_step and s.counts[CODE] == RUNNING:
        if c.periodic:
            wrap(qx)
            wrap(qy)
        kick_all(qx, qy, planes, sums, c.start + s.counts[STEP] * c.dt, c)
        move_all(qx, qy, planes, sums, c)
        for x in range(c.nx):
            s.totals[k.ALONG] += sums[0, x]
            s.totals[k.FRICTION_WORK] += sums[1, x]
            s.totals[k.VISCOUS_WORK] += sums[2, x] * c.mass * c.damping / c.dt
        s.counts[DENSE_STEPS] += 1
        moving = 0
        active = c.nx * c.ny
        check = (s.counts[STEP] + 1) % 16 == 0
        if check or (s.counts[STEP] + 1) % c.stride == 0:
            moving, active = count_moving(planes, contact, c)
        observe(1, moving, s, out, c)
        if check and active < c.dense_above // 2:
            break


@compiled
def wrap(a: FloatArray) -> None:
    """Fill the frame of a padded array with the opposite sides."""
    ny, nx = a.shape
    for x in range(nx):
        a[0, x] = a[ny - 2, x]
        a[ny - 1, x] = a[1, x]
    for y in range(ny):
        a[y, 0] = a[y, nx - 2]
        a[y, nx - 1] = a[y, 1]


@compiled
def kick_all(qx: FloatArray, qy: FloatArray, planes: FloatArray, sums: FloatArray, t: float, c: Numerics) -> None:
    """As :func:`tribo.simulate.kernels.kick`, the forces gathered from the eight neighbours.

    One root and one quotient a block, no branch: what a block needs to stop is rare and left to a second look.
    """
    stiffness = c.stiffness
    quarter = 0.25 * stiffness
    gain = c.dt / c.mass
    keep = 1.0 - c.damping * c.dt
    sums[:] = 0.0
    work = sums[1]
    before2 = sums[3]
    for y in range(c.ny):
        x_up, x_row, x_down = qx[y + 2], qx[y + 1], qx[y]
        y_up, y_row, y_down = qy[y + 2], qy[y + 1], qy[y]
        v_x, v_y, r_x, r_y = planes[VX, y], planes[VY, y], planes[RX, y], planes[RY, y]
        o_x, o_y = planes[OX, y], planes[OY, y]
        fs, fd, since, goes = planes[FS, y], planes[FD, y], planes[SINCE, y], planes[GOES, y]
        kxx, kyy, kxy = planes[KXX, y], planes[KYY, y], planes[KXY, y]
        stops = 0
        for x in range(c.nx):
            rising = quarter * (x_up[x + 2] + y_up[x + 2] + x_down[x] + y_down[x])
            falling = quarter * (x_up[x] - y_up[x] + x_down[x + 2] - y_down[x + 2])
            fx = stiffness * (x_row[x + 2] + x_row[x]) + rising + falling + o_x[x] + r_x[x] * t
            fy = stiffness * (y_up[x + 1] + y_down[x + 1]) + rising - falling + o_y[x] + r_y[x] * t
            fx -= kxx[x] * x_row[x + 1] + kxy[x] * y_row[x + 1]
            fy -= kxy[x] * x_row[x + 1] + kyy[x] * y_row[x + 1]
            speed2 = v_x[x] * v_x[x] + v_y[x] * v_y[x]
            vx = keep * v_x[x] + gain * fx
            vy = keep * v_y[x] + gain * fy
            drive = math.sqrt(vx * vx + vy * vy)
            sliding = gain * sliding_threshold(fd[x], math.sqrt(speed2), c.law)
            holding = gain * static_threshold(fs[x], t - since[x], c.law)
            slides = drive > sliding
            resting = (speed2 == 0.0) & (fs[x] > 0.0)
            stopping = (speed2 > 0.0) & (fs[x] > 0.0) & (drive <= sliding)
            share = 1.0 - sliding / drive if slides else 0.0
            start = 0.5 * share if drive > holding else 0.0
            share = start if resting else share
            work[x] += share * drive * fd[x]
            share = 1.0 if stopping else share
            v_x[x] = share * vx
            v_y[x] = share * vy
            before2[x] = speed2
            goes[x] = 0.0 if stopping else 1.0
            stops += 1 if stopping else 0
        if stops > 0:
            stop_row(v_x, v_y, fd, before2, goes, since, work, t, c)
    for x in range(c.nx):
        work[x] *= c.dt


@compiled
def stop_row(
    v_x: FloatArray,
    v_y: FloatArray,
    fd: FloatArray,
    before2: FloatArray,
    goes: FloatArray,
    since: FloatArray,
    work: FloatArray,
    t: float,
    c: Numerics,
) -> None:
    """Give the blocks of a row that stop in this step the last stretch of their way."""
    gain = c.dt / c.mass
    for x in range(len(v_x)):
        if goes[x] == 0.0:
            speed = math.sqrt(before2[x])
            drive = math.sqrt(v_x[x] * v_x[x] + v_y[x] * v_y[x])
            share = last_stretch(speed, drive, gain * sliding_threshold(fd[x], speed, c.law))
            work[x] += share * drive * fd[x]
            v_x[x] *= share
            v_y[x] *= share
            since[x] = t


@compiled
def move_all(qx: FloatArray, qy: FloatArray, planes: FloatArray, sums: FloatArray, c: Numerics) -> None:
    """Displace all blocks; ``sums`` receives by column the displacement along the pull and the way squared."""
    along, ways2 = sums[0], sums[2]
    for y in range(c.ny):
        x_row, y_row, v_x, v_y = qx[y + 1], qy[y + 1], planes[VX, y], planes[VY, y]
        goes = planes[GOES, y]
        for x in range(c.nx):
            dx = c.dt * v_x[x]
            dy = c.dt * v_y[x]
            x_row[x + 1] += dx
            y_row[x + 1] += dy
            along[x] += dx * c.direction_x + dy * c.direction_y
            ways2[x] += dx * dx + dy * dy
            v_x[x] *= goes[x]
            v_y[x] *= goes[x]


@compiled
def count_moving(planes: FloatArray, contact: BoolArray, c: Numerics) -> tuple[int, int]:
    """Contact blocks that move, and with them the cavity blocks faster than their rest speed."""
    rest2 = c.rest_force * c.rest_force / (c.stiffness * c.mass)
    contacts = 0
    cavities = 0
    for y in range(c.ny):
        for x in range(c.nx):
            speed2 = planes[VX, y, x] * planes[VX, y, x] + planes[VY, y, x] * planes[VY, y, x]
            if contact[y, x]:
                contacts += speed2 > 0.0
            else:
                cavities += speed2 > rest2
    return contacts, contacts + cavities
