"""Threads that share the strips of a large lattice: each works on the strips that lie in its part of the lattice.

One thread leads: it keeps the lists of strips, and alone moves strips from one to another. For the forces, and again
for the motion, it gives an order, works on its own part and waits until the others have done theirs. Within an order no
block is written by two threads, and none is read by one while another writes it. The lattice is cut into the same
:data:`SHARES` whatever the number of threads, and each share has sums of its own, so that the result does not depend
on how many threads there are.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, cast

import numpy as np
from numba import types
from numba.core.cgutils import get_item_pointer
from numba.extending import intrinsic
from numpy.typing import NDArray

from tribo.springblock.engines.jit import compiled, copied_into_callers, inner
from tribo.springblock.engines.strips import LINE

SHARES = 4
FEWEST_BLOCKS = 100_000  # a smaller lattice fits into the cache of one core, and a step takes less than an order
SPINS = 2000  # looks at an order before the core is offered to others
FORCES, MOTION, END = range(3)
ORDER, KIND = 0, 1  # places in the orders of a team: number and kind of the last one; then what each thread has done
IntArray = NDArray[np.int64]  # the orders have LINE places a thread: each number waited for has its own cache line


def _place_of(context: Any, builder: Any, array_type: Any, array: Any, index: Any) -> Any:
    made = context.make_array(array_type)(context, builder, array)
    return get_item_pointer(context, builder, array_type, made, [index])


def _seen(typing_context: Any, array: Any, index: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load_atomic(_place_of(context, builder, array, *arguments), "acquire", 8)

    return types.int64(array, types.intp), code


def _shown(typing_context: Any, array: Any, index: Any, value: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array_value, place, number = arguments
        builder.store_atomic(number, _place_of(context, builder, array, array_value, place), "release", 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.int64), code


seen = cast(Callable[[NDArray[np.int64], int], int], cast(Any, intrinsic)(_seen))
shown = cast(Callable[[NDArray[np.int64], int, int], None], cast(Any, intrinsic)(_shown))
sched_yield = types.ExternalFunction("sched_yield", types.int32())


def shares_of(blocks: int) -> int:
    """Parts into which a lattice of so many blocks is cut."""
    return SHARES if blocks >= FEWEST_BLOCKS else 1


def orders_for(threads: int, shares: int) -> IntArray:
    """The orders of a team of as many threads as were asked for, at most one for each share and for each core."""
    return np.zeros(LINE * max(1, min(threads, shares, cores())), np.int64)


@inner
def team_size(orders: IntArray) -> int:
    """How many threads these orders are for."""
    return len(orders) // LINE


def cores() -> int:
    """Cores this process may use; 1 where a waiting thread cannot offer its core to others."""
    if not hasattr(os, "sched_yield"):
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def helped(orders: IntArray, assist: Callable[[int], None]) -> Iterator[None]:
    """``assist(thread)`` runs beside the leader for every other thread of the team, until the block is left."""
    team = len(orders) // LINE
    if team > 1:
        dismiss(orders)
        assist(1)  # compiled here: a thread that fails to would be waited for without end
        orders[:] = 0
    threads = [threading.Thread(target=assist, args=(k,), daemon=True) for k in range(1, team)]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        if threads:
            dismiss(orders)
        for thread in threads:
            thread.join()


@inner
def give(kind: int, orders: IntArray) -> None:
    """The leader asks the others for something."""
    copied_into_callers()
    orders[KIND] = kind
    shown(orders, ORDER, orders[ORDER] + 1)


@compiled
def dismiss(orders: IntArray) -> None:
    """The leader has no more orders."""
    give(END, orders)


@inner
def wait_for_all(orders: IntArray) -> None:
    """The leader waits until the others have done what it asked for."""
    copied_into_callers()
    for thread in range(1, team_size(orders)):
        wait_until(orders, LINE * thread, orders[ORDER])


@inner
def done(thread: int, orders: IntArray) -> None:
    """A thread says that it has done what was asked for last."""
    copied_into_callers()
    shown(orders, LINE * thread, orders[LINE * thread] + 1)


@inner
def next_order(thread: int, orders: IntArray) -> int:
    """Wait for the order after the last one this thread has done, and return its kind."""
    copied_into_callers()
    wait_until(orders, ORDER, orders[LINE * thread] + 1)
    return orders[KIND]


@inner
def wait_until(orders: NDArray[np.int64], place: int, number: int) -> None:
    """Wait until another thread shows this number."""
    looks = 0
    while seen(orders, place) != number:
        looks += 1
        if looks >= SPINS:
            sched_yield()
            looks = 0
