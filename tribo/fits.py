"""Friction laws fitted to samples, runs of the model, and their comparison; SI units, names end in the unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribo.display import displayed
from tribo.errors import FitError, Problem
from tribo.outputs import product

if TYPE_CHECKING:
    import pandas as pd

FloatArray = NDArray[np.float64]
Regime = Literal["static", "sliding"]
REGIMES: tuple[Regime, ...] = ("static", "sliding")
PA_PER_KPA = 1e3


@displayed(lambda fit: f"{fit.sample}, {fit.regime}: {fit.in_numbers()}")
@dataclass(frozen=True)
class LawFit:
    """A friction law fitted to one sample in one regime, with the covariance of its parameters.

    The covariance of a fit that a study states is the combined one (GUM): ``type_a`` and what all pulls share (type B:
    gain, zero, load, area, angle), which counts as known. Samples of one campaign are compared by the fit in ``alone``,
    which is without the scatter of other samples and without the instrument.

    Parameters
    ----------
    sample : str
        Name of the sample.
    regime : "static" or "sliding"
        Whether the law is that of static or of sliding friction.
    law : str
        Name of the law, such as "coulomb_adhesion".
    parameters : tuple of str, shape (p,)
        Names of the parameters: mu and tau0_Pa for T = mu N + tau0 A; mu and T0_N for T = mu N + T0, where no nominal
        area is known. mu has no unit.
    values : ndarray, shape (p,)
        Fitted parameters, in the unit that their names end in.
    covariance : ndarray, shape (p, p)
        Their covariance, in the products of these units.
    dof : float
        Degrees of freedom of the scatter between specimens.
    n_specimens, n_tests : int
        Number of specimens and of tests in the fit.
    method : str
        How the law was fitted, in words.
    chi2_red : float
        Reduced chi-squared of the load means about the line of each specimen.
    nominal_area_m2 : float or None
        Nominal area in m2; None where it is not stated.
    specimens : mapping of str to ndarray, shape (p,)
        The parameters of each specimen by itself.
    notes : tuple of str
        What is doubtful about the fit, as sentences.
    bent : bool
        Whether the load means deviate from a straight line beyond chance.
    type_a : ndarray, shape (p, p), optional
        Part of the covariance that is of the mean over specimens, with ``dof`` degrees of freedom.
    largest : mapping of str to (str, float)
        For each parameter and for T, the component with the largest share of the variance, and that share in percent;
        "wire angle, assumed" where the instrument is not stated.
    alone : LawFit, optional
        The fit by the tests of the sample alone (type A). That fit itself has no ``type_a``, ``largest`` and ``alone``.

    Examples
    --------
    >>> fit = tribo.fit(tribo.ingest(tribo.load_campaign(tribo.data_dir() / "example")))["F", "static"]
    >>> print(f"mu = {fit.mu:.2f} ± {fit.mu_u:.2f}, T = {fit.force_N(1.0):.2f} ± {fit.force_u_N(1.0):.2f} N at 1 N")
    mu = 4.74 ± 0.27, T = 6.05 ± 0.33 N at 1 N
    """

    sample: str
    regime: Regime
    law: str
    parameters: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    dof: float
    n_specimens: int
    n_tests: int
    method: str
    chi2_red: float
    nominal_area_m2: float | None
    specimens: Mapping[str, FloatArray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    bent: bool = False
    type_a: FloatArray | None = None
    largest: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    alone: LawFit | None = None

    @property
    def has_area(self) -> bool:
        """Whether the nominal area is known, and with it tau0."""
        return self.nominal_area_m2 is not None

    @property
    def adhesion(self) -> str:
        """The name of the adhesion term among the parameters: tau0_Pa, or T0_N where no area is known."""
        return "tau0_Pa" if self.has_area else "T0_N"

    def value(self, parameter: str) -> float:
        """A parameter by its name."""
        return float(self.values[self._place(parameter)])

    def standard_uncertainty(self, parameter: str) -> float:
        """Standard uncertainty (k = 1) of a parameter."""
        k = self._place(parameter)
        return float(np.sqrt(self.covariance[k, k]))

    def _place(self, parameter: str) -> int:
        if parameter in self.parameters:
            return self.parameters.index(parameter)
        allowed = ", ".join(self.parameters)
        what = f"the law of {self.sample}, {self.regime}, has no such parameter"
        raise FitError(Problem("unknown_parameter", what, found=parameter, allowed=allowed))

    @property
    def mu(self) -> float:
        """Friction coefficient: the slope of T over N."""
        return self.value("mu")

    @property
    def mu_u(self) -> float:
        """Standard uncertainty of mu."""
        return self.standard_uncertainty("mu")

    @property
    def mu_type_a_u(self) -> float:
        """Standard uncertainty of mu from the specimens and repeats of the sample alone."""
        return self.by_itself.standard_uncertainty("mu")

    @property
    def tau0_Pa(self) -> float:
        """Adhesion per nominal area."""
        return self.value("tau0_Pa")

    @property
    def tau0_u_Pa(self) -> float:
        """Standard uncertainty of tau0."""
        return self.standard_uncertainty("tau0_Pa")

    @property
    def tau0_type_a_u_Pa(self) -> float:
        """Standard uncertainty of tau0 from the specimens and repeats of the sample alone."""
        return self.by_itself.standard_uncertainty("tau0_Pa")

    @property
    def T0_N(self) -> float:
        """Force at no load, tau0 A; without a nominal area the parameter itself."""
        return self.value(self.adhesion) * self._per_adhesion

    @property
    def T0_u_N(self) -> float:
        """Standard uncertainty of T0, with the area as stated."""
        return self.standard_uncertainty(self.adhesion) * self._per_adhesion

    @property
    def _per_adhesion(self) -> float:
        """Newtons of T for each unit of the adhesion term: the area, or 1 for a force."""
        return 1.0 if self.nominal_area_m2 is None else self.nominal_area_m2

    @property
    def by_itself(self) -> LawFit:
        """The fit by the tests of the sample alone."""
        return self if self.alone is None else self.alone

    def in_numbers(self) -> str:
        """Every parameter with its standard uncertainty, in a line."""
        found = ((name, self.value(name), self.standard_uncertainty(name)) for name in self.parameters)
        return ", ".join(f"{name} = {value:.4g} ± {u:.2g}" for name, value, u in found)

    def effective_dof(self, by: FloatArray) -> float:
        """Degrees of freedom of a combination ``by`` (k,) of the parameters.

        Of a combined uncertainty by Welch and Satterthwaite (GUM, G.4), type B being known; else ``dof``.
        """
        if self.type_a is None:
            return self.dof
        type_a = float(by @ self.type_a @ by)
        return self.dof * (float(by @ self.covariance @ by) / type_a) ** 2 if type_a > 0 else float("inf")

    def interval(self, parameter: str, level: float = 0.95) -> tuple[float, float]:
        """Two-sided t interval of a parameter at ``level``."""
        from scipy.special import stdtrit  # quantile of t, without the start of scipy.stats

        dof = self.effective_dof(np.eye(len(self.values))[self._place(parameter)])
        half = float(stdtrit(dof, 0.5 + level / 2)) * self.standard_uncertainty(parameter)
        return self.value(parameter) - half, self.value(parameter) + half

    def force_N(self, normal_load_N: float | FloatArray) -> FloatArray:
        """T = mu N + tau0 A (or + T0) of the fitted law in newton; N in newton, any shape."""
        n = np.asarray(normal_load_N, float)
        return np.asarray(self.mu * n + self.value(self.adhesion) * self._per_adhesion)

    def force_u_N(self, normal_load_N: float | FloatArray) -> FloatArray:
        """Standard uncertainty of :meth:`force_N`, from the full covariance."""
        n = np.asarray(normal_load_N, float)
        a = self._per_adhesion
        c = self.covariance
        return np.asarray(np.sqrt(c[0, 0] * n**2 + 2 * c[0, 1] * n * a + c[1, 1] * a**2))

    def force_half_width_N(self, normal_load_N: float | FloatArray, level: float = 0.95) -> FloatArray:
        """Half width of the t interval of :meth:`force_N` at ``level``, for loads of shape (n,)."""
        from scipy.special import stdtrit

        loads = np.atleast_1d(np.asarray(normal_load_N, float))
        dof = np.array([self.effective_dof(np.array([n, self._per_adhesion])) for n in loads])
        return np.asarray(stdtrit(dof, 0.5 + level / 2) * self.force_u_N(loads))


class Fits(tuple[LawFit, ...]):
    """The fitted laws of a campaign, by number or by name.

    ``fits[0]`` is the first, ``fits["A", "static"]`` that of a sample in a regime, ``fits["A"]`` both of a sample.
    """

    def __getitem__(self, which: Any) -> Any:
        if isinstance(which, int):
            return super().__getitem__(which)
        if isinstance(which, slice):
            return Fits(super().__getitem__(which))
        sample, regime = which if isinstance(which, tuple) else (which, None)
        found = Fits(f for f in self if f.sample == sample and regime in (None, f.regime))
        if found:
            return found if regime is None else found[0]
        known = ", ".join(dict.fromkeys(f.sample for f in self)) or "none"
        asked = sample if regime is None else f"{sample}, {regime}"
        raise FitError(Problem("unknown_fit", "no such fit", found=asked, allowed=f"{known}; static or sliding"))

    def of(self, sample: str, regime: str) -> LawFit | None:
        """The fit of a sample in a regime; None where there is none."""
        return next((f for f in self if f.sample == sample and f.regime == regime), None)

    def table(self) -> pd.DataFrame:
        """One row per fit, as in fits.csv: combined uncertainties, and those of type A under names of their own.

        ``cov`` is cov(mu, tau0) in kPa; ``*_low`` to ``*_high`` are 95 % intervals. ``*_type_a_*`` are of the specimens
        and repeats of the sample alone, with ``dof_type_a``. Without a nominal area the columns of tau0 are empty.
        """
        import pandas as pd

        rows = [_fit_row(f) for f in self if f.adhesion in f.parameters]
        return pd.DataFrame(rows, columns=product("fits.csv").column_names)

    def __repr__(self) -> str:
        return "\n".join(["Fits:", *(f"  {fit._headline()}" for fit in self)])  # type: ignore[attr-defined]

    def _repr_html_(self) -> str:
        return str(self.table()[["sample", "regime", "mu", "mu_u", "tau0_kPa", "tau0_u_kPa", "T0_N"]].to_html())


def _fit_row(fit: LawFit) -> dict[str, object]:
    alone = fit.by_itself
    row: dict[str, object] = {
        "sample": fit.sample, "regime": fit.regime, "mu": fit.mu, "n_specimens": fit.n_specimens,
        "n_tests": fit.n_tests, "method": fit.method, "chi2_red": fit.chi2_red, "law": fit.law,
        "notes": "; ".join(fit.notes), "T0_N": fit.T0_N, "largest_mu": fit.largest.get("mu", ("",))[0],
        "largest_tau0": fit.largest.get(fit.adhesion, ("",))[0], "dof_type_a": alone.dof,
    }  # fmt: skip
    for one, name in ((fit, ""), (alone, "type_a_")):
        row |= {f"mu_{name}u": one.mu_u, f"T0_{name}u_N": one.T0_u_N}
        row[f"mu_{name}low"], row[f"mu_{name}high"] = one.interval("mu")
        if fit.has_area:
            row[f"tau0_{name}u_kPa"] = one.tau0_u_Pa / PA_PER_KPA
            row[f"cov_{name}".rstrip("_")] = float(one.covariance[0, 1]) / PA_PER_KPA
            low, high = one.interval("tau0_Pa")
            row |= {f"tau0_{name}low_kPa": low / PA_PER_KPA, f"tau0_{name}high_kPa": high / PA_PER_KPA}
    if fit.has_area:
        row["tau0_kPa"] = fit.tau0_Pa / PA_PER_KPA
    return row


@displayed(lambda r: f"{r.sample} at {r.pressure_Pa / 1e3:.4g} kPa, seed {r.seed}")
@dataclass(frozen=True)
class Run:
    """One run of the spring-block model: force of the slider along the pull, with static and sliding friction.

    Parameters
    ----------
    sample : str
        Name of the sample.
    pressure_Pa, angle_deg : float
        Nominal pressure in Pa, and pull direction against x in degrees.
    seed : int
        Seed of the local friction.
    time_s, force_N : ndarray, shape (n,)
        Time in s and force of the slider in N.
    moving : ndarray of int, shape (n,)
        Number of blocks in contact that move.
    normal_load_N : float
        Nominal load of the lattice in N.
    static_friction, sliding_friction : float
        T/N at the peak and as a mean over the window (dimensionless).
    peak_s : float
        Time of the peak in s.
    window_s : tuple of float, shape (2,)
        Start and end of the sliding window in s.
    engine : str
        Engine that computed the run.
    parameters : mapping of str to object
        Every input, with its unit in the name.

    Examples
    --------
    >>> run = tribo.simulate(tribo.SimConfig(blocks=(12, 12), dt_s=1e-7, duration_peaks=1.5))
    >>> print(f"T/N = {run.static_friction:.1f} after {1e3 * run.peak_s:.1f} ms, then {run.sliding_friction:.1f}")
    T/N = 7.4 after 3.1 ms, then 3.5
    """

    sample: str
    pressure_Pa: float
    angle_deg: float
    seed: int
    time_s: FloatArray
    force_N: FloatArray
    moving: NDArray[np.int64]
    normal_load_N: float
    static_friction: float
    sliding_friction: float
    peak_s: float
    window_s: tuple[float, float]
    engine: str
    parameters: Mapping[str, Any] = field(default_factory=dict)


@displayed(lambda r: f"{r.sample}, {r.regime}, {r.normal_load_N:.4g} N")
@dataclass(frozen=True)
class ComparisonRow:
    """Measured and simulated friction force of one sample at one load, with standard uncertainties."""

    sample: str
    regime: Regime
    normal_load_N: float
    measured_N: float
    measured_u_N: float
    simulated_N: float
    simulated_u_N: float


@displayed(lambda c: f"{len(c.rows)} forces, calibrated on {c.flat}")
@dataclass(frozen=True)
class Comparison:
    """Comparison of experiment and model: fits of the model, and the forces of both at each measured load."""

    simulated: tuple[LawFit, ...]
    rows: tuple[ComparisonRow, ...]
    calibration: Mapping[str, float] = field(default_factory=dict)
    flat: str = "F"
