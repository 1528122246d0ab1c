"""What this processor can do at most, and how near the step of all blocks comes to it.

    python benchmarks/simulator_roofline.py

One core, float64, best of several rounds in processor time: products and sums, roots and quotients on numbers that lie
in the nearest cache, and the traffic of a sum of arrays that together are as large as the planes of 85 x 85 blocks, or
far larger than any cache. Then what the step needs of each, counted from the two loops in
``tests/support/dense_engine.py``.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tribo.records import FloatArray
from tribo.springblock.engines.jit import vectorised, widest_vectors

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from support.dense_engine import dense_rate

# of one block and step: sums and products of both loops, roots, quotients, bytes read and written (planes of float64)
FLOPS, ROOTS, QUOTIENTS = 26 + 24, 1, 1
BYTES = 8 * ((2 + 2 + 2) + (2 + 2 + 1 + 2) + (2 + 2 + 1) + 2)  # loop 1; loop 2 read, written, fetched to be written


@vectorised
def products(a: FloatArray, rounds: int) -> None:
    """Twenty-one a number, most of them fused in pairs, few of which wait for each other."""
    widest_vectors()
    for _ in range(rounds):
        for i in range(len(a)):
            b = a[i]
            c, d, e = b * 0.51 + 0.11, b * 0.52 + 0.12, b * 0.53 + 0.13
            f, g, h = b * 0.54 + 0.14, b * 0.55 + 0.15, b * 0.56 + 0.16
            a[i] = ((c * d + e) + (f * g + h) + (c * e + f)) * 0.25


@vectorised
def roots(a: FloatArray, b: FloatArray, rounds: int) -> None:
    widest_vectors()
    for r in range(rounds):
        for i in range(len(a)):
            b[i] = math.sqrt(a[i] + r)


@vectorised
def quotients(a: FloatArray, b: FloatArray, rounds: int) -> None:
    widest_vectors()
    for r in range(rounds):
        for i in range(len(a)):
            b[i] = r / a[i]


@vectorised
def sums(a: FloatArray, b: FloatArray, c: FloatArray, rounds: int) -> None:
    """Two numbers read and one written."""
    widest_vectors()
    for _ in range(rounds):
        for i in range(len(a)):
            c[i] = a[i] + 0.5 * b[i]


def seconds(work: Callable[[], None], rounds: int = 7) -> float:
    """Processor time of the fastest of several rounds, the first of which compiles."""
    work()
    best = math.inf
    for _ in range(rounds):
        began = time.process_time()
        work()
        best = min(best, time.process_time() - began)
    return best


def numbers(n: int) -> FloatArray:
    return np.random.default_rng(0).random(n) + 1.0


def main() -> None:
    near, far, n = 1024, 8_000_000, 20_000
    a, b = numbers(near), numbers(near)
    peak = 21 * near * n / seconds(lambda: products(a, n))
    root = near * n / seconds(lambda: roots(a, b, n))
    quotient = near * n / seconds(lambda: quotients(a, b, n))
    planes = 85 * 85 * 10 // 3
    p, q, r = numbers(planes), numbers(planes), numbers(planes)
    second_cache = 32 * planes * 1000 / seconds(lambda: sums(p, q, r, 1000))  # what is written is fetched first
    x, y, z = numbers(far), numbers(far), numbers(far)
    memory = 32 * far / seconds(lambda: sums(x, y, z, 1), 3)
    print(f"products and sums {peak:.3g}/s, roots {root:.3g}/s, quotients {quotient:.3g}/s")
    print(f"bytes/s from planes of 85 x 85 blocks {second_cache:.3g}, from memory {memory:.3g}")
    bounds = {
        "products and sums": FLOPS / peak,
        "root and quotient": ROOTS / root + QUOTIENTS / quotient,
        "traffic, 85 x 85": BYTES / second_cache,
        "traffic, 1000 x 1000": BYTES / memory,
    }
    print(f"a block and step: {FLOPS} products and sums, one root, one quotient, {BYTES} bytes; at most by")
    for name, bound in bounds.items():
        print(f"    {name:22s} {1e9 * bound:6.2f} ns   {1 / bound:.3g} blocks/s")
    timing = next(iter(dense_rate()))
    print(f"the step of all blocks        {1e9 / timing.value:6.2f} ns   {timing.value:.3g} blocks/s ({timing.note})")


if __name__ == "__main__":
    main()
