"""Certified least-squares problems of the NIST Statistical Reference Datasets (StRD), public domain.

https://www.itl.nist.gov/div898/strd/ : linear Norris, Pontius, NoInt1, NoInt2; nonlinear DanWood, Misra1a.
Values and standard deviations of the estimates are as certified (15 and 11 digits).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Certified:
    """Data (n,), certified values (k,), their standard deviations (k,) and the residual standard deviation."""

    x: np.ndarray
    y: np.ndarray
    values: np.ndarray
    deviations: np.ndarray
    residual: float


def _numbers(text: str) -> np.ndarray:
    return np.array(text.split(), float)


def _pairs(text: str) -> tuple[np.ndarray, np.ndarray]:
    y, x = _numbers(text).reshape(-1, 2).T
    return x, y


NORRIS = Certified(
    *_pairs(
        """
        0.1 0.2  338.8 337.4  118.1 118.2  888.0 884.6  9.2 10.1  228.1 226.5  668.5 666.3  998.5 996.3
        449.1 448.6  778.9 777.0  559.2 558.2  0.3 0.4  0.1 0.6  778.1 775.5  668.8 666.9  339.3 338.0
        448.9 447.5  10.8 11.6  557.7 556.0  228.3 228.1  998.0 995.8  888.8 887.6  119.6 120.2  0.3 0.3
        0.6 0.3  557.6 556.8  339.3 339.1  888.0 887.2  998.5 999.0  778.9 779.0  10.2 11.1  117.6 118.3
        228.9 229.2  668.4 669.1  449.2 448.9  0.2 0.5
        """
    ),
    np.array([-0.262323073774029, 1.00211681802045]),
    np.array([0.232818234301152, 0.429796848199937e-3]),
    0.884796396144373,
)

_PONTIUS_LOAD = np.arange(1, 21) * 150000.0
PONTIUS = Certified(
    np.tile(_PONTIUS_LOAD, 2),
    _numbers(
        """
        .11019 .21956 .32949 .43899 .54803 .65694 .76562 .87487 .98292 1.09146 1.20001 1.30822 1.41599 1.52399
        1.63194 1.73947 1.84646 1.95392 2.06128 2.16844
        .11052 .22018 .32939 .43886 .54798 .65739 .76596 .87474 .98300 1.09150 1.20004 1.30818 1.41613 1.52408
        1.63159 1.73965 1.84696 1.95445 2.06177 2.16829
        """
    ),
    np.array([0.673565789473684e-3, 0.732059160401003e-6, -0.316081871345029e-14]),
    np.array([0.107938612033077e-3, 0.157817399981659e-9, 0.486652849992036e-16]),
    0.205177424076185e-3,
)

NOINT1 = Certified(
    np.arange(60.0, 71.0),
    np.arange(130.0, 141.0),
    np.array([2.07438016528926]),
    np.array([0.0165289256198347]),
    3.56753034006338,
)

NOINT2 = Certified(
    np.array([4.0, 5.0, 6.0]),
    np.array([3.0, 4.0, 4.0]),
    np.array([0.727272727272727]),
    np.array([0.0420827318078432]),
    0.369274472937998,
)

DANWOOD = Certified(
    np.array([1.309, 1.471, 1.490, 1.565, 1.611, 1.680]),
    np.array([2.138, 3.421, 3.597, 4.340, 4.882, 5.660]),
    np.array([7.6886226176e-01, 3.8604055871]),
    np.array([1.8281973860e-02, 5.1726610913e-02]),
    3.2853114039e-02,
)

MISRA1A = Certified(
    _numbers("77.6 114.9 141.1 190.8 239.9 289.0 332.8 378.4 434.8 477.3 536.8 593.1 689.1 760.0"),
    _numbers("10.07 14.73 17.94 23.93 29.61 35.18 40.02 44.82 50.76 55.05 61.01 66.40 75.47 81.78"),
    np.array([2.3894212918e02, 5.5015643181e-04]),
    np.array([2.7070075241, 7.2668688436e-06]),
    1.0187876330e-01,
)
