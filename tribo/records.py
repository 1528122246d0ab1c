"""The frozen records passed between stages, in SI units; names end in the unit.

In the order of the stages: exports and pulls; fitted laws, runs and their comparison; the campaign and its study.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribo.display import displayed
from tribo.errors import CampaignError, FitError, Problem
from tribo.outputs import product
from tribo.zeroing import DEFAULT, ZeroChoice

if TYPE_CHECKING:
    import pandas as pd


FloatArray = NDArray[np.float64]


@displayed()
@dataclass(frozen=True)
class ExportFormat:
    """How an export was read, in enough detail to read it again by hand."""

    family: str
    encoding: str
    delimiter: str
    decimal: str
    header_rows: int
    columns: Mapping[str, str]  # quantity -> "name [unit]" as the file spells it
    reasons: Mapping[str, str] = field(default_factory=dict)  # quantity -> why that column


@displayed(lambda t: f"{t.name}, {len(t.time_s)} points")
@dataclass(frozen=True)
class Trace:
    """Force against time of one export, in SI units, as recorded (never resampled).

    Arrays share one length n >= 1. ``columns`` holds further quantities by SI name ("normal_force_N"),
    ``metadata`` the file's own header untouched, ``flags`` doubts of the reader. ``first_row`` is the line of the
    file, counted from 1, with the first data point.
    """

    name: str
    time_s: FloatArray
    force_N: FloatArray
    displacement_m: FloatArray | None = None
    columns: Mapping[str, FloatArray] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)
    source: ExportFormat | None = None
    file: str = ""
    flags: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()
    first_row: int = 1


@displayed(lambda p: f"{p.name}, {p.start_s:.4g} to {p.end_s:.4g} s")
@dataclass(frozen=True)
class Phase:
    """A part of a record by what the rig did, from ``start_s`` to ``end_s`` on the clock of the trace."""

    name: str
    start_s: float
    end_s: float


@displayed(lambda r: f"hold {r.hold_s:.4g} s, static {r.static_N:.4g} N")
@dataclass(frozen=True)
class Restart:
    """The static friction of one restart: the peak after the drive stood still for ``hold_s``."""

    hold_s: float
    stop_s: float
    peak_s: float
    static_N: float
    static_u_N: float
    sliding_N: float
    sliding_u_N: float


@displayed()
@dataclass(frozen=True)
class Oscillation:
    """How the force varies while sliding: its regime, and its cycles where it has any.

    ``regime`` is "steady", "stick-slip", "inertial oscillation" or "irregular". ``peak_N`` is the force at the end of a
    stick, ``trough_N`` that after the slip, ``drop_N`` the force lost, ``loading_N_per_s`` the slope while the force
    rises: medians over ``cycles`` with standard uncertainties ``*_u``. ``stuck_share`` is the share of time spent
    stuck. NaN where there are no cycles.
    """

    regime: str
    cycles: int = 0
    peak_N: float = float("nan")
    peak_u_N: float = float("nan")
    trough_N: float = float("nan")
    trough_u_N: float = float("nan")
    drop_N: float = float("nan")
    drop_u_N: float = float("nan")
    period_s: float = float("nan")
    period_u_s: float = float("nan")
    loading_N_per_s: float = float("nan")
    loading_u_N_per_s: float = float("nan")
    stuck_share: float = float("nan")
    stuck_share_u: float = float("nan")


@displayed(lambda p: f"{p.test_id}, static {p.static_N:.4g} N, sliding {p.sliding_N:.4g} N")
@dataclass(frozen=True)
class Pull:
    """Static peak and mean sliding force of one trace, by a named rule. Times as recorded in the trace.

    ``*_u_N`` are standard uncertainties (k = 1) of the reading within the trace. ``zero_N`` was subtracted
    from every force. ``window_s`` is the sliding window (start, end). NaN where a trace does not determine a value.
    ``first_maximum_N``, ``highest_N`` and ``first_drop_N`` are three readings of the static peak: where they differ,
    ``static_u_N`` includes the difference.
    """

    test_id: str
    rule: str
    static_N: float
    static_u_N: float
    sliding_N: float
    sliding_u_N: float
    zero_N: float
    zero_u_N: float
    onset_s: float
    peak_s: float
    window_s: tuple[float, float]
    rise_N_per_s: float = float("nan")
    rise_stiffness_N_per_m: float = float("nan")
    stick_slip_amplitude_N: float = float("nan")
    stick_slip_period_s: float = float("nan")
    noise_N: float = float("nan")
    drift_N_per_s: float = float("nan")
    flags: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()
    first_maximum_N: float = float("nan")
    highest_N: float = float("nan")
    first_drop_N: float = float("nan")
    zero_rule: str = ""
    recorded_load_N: float = float("nan")
    recorded_load_u_N: float = float("nan")
    oscillation: Oscillation | None = None
    restarts: tuple[Restart, ...] = ()
    phases: tuple[Phase, ...] = ()


Regime = Literal["static", "sliding"]
REGIMES: tuple[Regime, ...] = ("static", "sliding")
PA_PER_KPA = 1e3


@displayed(lambda fit: f"{fit.sample}, {fit.regime}: {fit.in_numbers()}")
@dataclass(frozen=True)
class LawFit:
    """A friction law fitted to one sample in one regime, with the covariance of its parameters.

    ``values`` and ``covariance`` follow ``parameters``: mu and tau0_Pa for T = mu N + tau0 A; mu and T0_N for
    T = mu N + T0, where no nominal area is known (``nominal_area_m2`` is None).

    The covariance of a fit that a study states is the combined one (GUM): ``type_a``, that of the mean over specimens
    with ``dof`` degrees of freedom, plus what all pulls share (type B: gain, zero, load, area, angle), which counts as
    known. ``largest`` holds, for each parameter and for T, the component with the largest share of the variance and
    that share in percent. ``alone`` is then the fit by the tests of the sample alone (type A), without the scatter of
    other samples and without the instrument: samples of one campaign are compared by it. A fit that is one by the tests
    of the sample alone has neither.
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
    specimens: Mapping[str, FloatArray] = field(default_factory=dict)  # specimen -> its own values
    notes: tuple[str, ...] = ()
    bent: bool = False  # the load means deviate from a straight line beyond chance
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
        return str(self.table()[["sample", "regime", "mu", "mu_u", "tau0_kPa", "tau0_u_kPa", "T0_N"]]._repr_html_())


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

    ``static_friction`` and ``sliding_friction`` are T/N (dimensionless), ``window_s`` the sliding window,
    ``parameters`` every input with its unit in the name, ``moving`` the number of moving blocks.
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


STANDARD_GRAVITY = 9.80665  # m/s2, CGPM 1901
CLOSED_TRACK_M = 10.0  # a longer slide runs over its own track again and again; no sled has so long a track


@displayed(lambda p: f"{p.name}, {'flat' if p.is_flat else p.cavity}")
@dataclass(frozen=True)
class Pattern:
    """Geometry of one cavity pattern, lengths in metres; ``cavity`` is none, circle, square or rectangle.

    ``size_m`` is (x, y) of the cavity (the diameter twice for a circle); ``pitch_m`` the lattice spacing;
    ``staggered`` shifts every other row by half a pitch in x. ``measured_area_fraction``, where given,
    replaces the nominal one.
    """

    name: str
    cavity: str = "none"
    size_m: tuple[float, float] | None = None
    pitch_m: tuple[float, float] | None = None
    staggered: bool = False
    measured_area_fraction: float | None = None

    @property
    def area_fraction(self) -> float:
        """Contact area fraction AF: contact area over nominal area, 1 for a flat sample."""
        if self.measured_area_fraction is not None:
            return self.measured_area_fraction
        if self.cavity == "none" or self.size_m is None or self.pitch_m is None:
            return 1.0
        share = np.pi / 4 if self.cavity == "circle" else 1.0
        return float(1.0 - share * self.size_m[0] * self.size_m[1] / (self.pitch_m[0] * self.pitch_m[1]))

    @property
    def is_flat(self) -> bool:
        """Whether the sample has no cavities."""
        return self.cavity == "none"

    @property
    def rim_per_m(self) -> float:
        """Rim length of the cavities per nominal area, 1/m; 0 for a flat sample."""
        if self.cavity == "none" or self.size_m is None or self.pitch_m is None:
            return 0.0
        x, y = self.size_m
        rim = np.pi * x if self.cavity == "circle" else 2.0 * (x + y)
        return float(rim / (self.pitch_m[0] * self.pitch_m[1]))


@displayed()
@dataclass(frozen=True)
class Correction:
    """What a user states about the numbers of an export; applied once, at the end of reading.

    The friction force is multiplied by ``sign`` (1 or -1) and ``gain``; a torque becomes a force over ``lever_arm_m``.
    ``sampling_rate_Hz`` gives the time where the export has none, else ``speed_m_s`` does for a recorded path.
    """

    sign: float = 1.0
    gain: float = 1.0
    lever_arm_m: float | None = None
    sampling_rate_Hz: float | None = None
    speed_m_s: float | None = None


UNCORRECTED = Correction()


@displayed()
@dataclass(frozen=True)
class Evaluated:
    """Forces of one test that were evaluated elsewhere, with standard uncertainties; NaN where one is not given."""

    static_N: float = float("nan")
    static_u_N: float = float("nan")
    sliding_N: float = float("nan")
    sliding_u_N: float = float("nan")


@displayed(lambda t: f"{t.test_id}, {t.sample}, {t.normal_load_N:.4g} N")
@dataclass(frozen=True)
class Test:
    """One row of tests.csv: one pull, its load and its covariates.

    ``correction`` is what was stated about the numbers of its export; ``evaluated`` holds its forces where it has none.
    """

    __test__ = False  # not a pytest class

    test_id: str
    file: str
    sample: str
    normal_load_N: float
    specimen: str
    direction: str = ""
    speed_m_s: float | None = None
    hold_s: float | None = None
    repeat: int | None = None
    run_order: int | None = None
    specimen_run: int | None = None
    started_at: str = ""
    temperature_C: float | None = None
    humidity_pct: float | None = None
    operator: str = ""
    exclude: str = ""
    covariates: Mapping[str, str] = field(default_factory=dict)
    row: int | None = None
    correction: Correction = UNCORRECTED
    evaluated: Evaluated | None = None
    zero: ZeroChoice = DEFAULT
    load_zero: ZeroChoice = DEFAULT
    stiffness_N_per_m: float | None = None  # of the spring, wire or beam through which the slider is pulled
    load_from: str = ""  # column of tests.csv that gave the load; empty where the export did
    mass_kg: float | None = None  # put on the slider, as tests.csv states it


@displayed(lambda s: f"{s.test_id}: {s.reason}")
@dataclass(frozen=True)
class SetAside:
    """A test that is not used in the results, with the reason."""

    test_id: str
    reason: str
    problems: tuple[Problem, ...] = ()


@displayed(lambda d: f"{d.name}: {d.found}")
@dataclass(frozen=True)
class Doubt:
    """A number outside its broad physical bounds, or a design that cannot give the number it is for.

    ``quantity`` is its name for programs, ``name`` that for people; ``found`` and ``plausible`` are texts with units,
    ``place`` is where to look, ``slip`` the question that may explain it, ``source`` where the bounds are from, and
    ``material_class`` the class they hold for.
    """

    quantity: str
    name: str
    found: str
    plausible: str
    place: str
    slip: str = ""
    source: str = ""
    material_class: str = ""

    def __str__(self) -> str:
        return f"{self.without_slip()}. Likely slip: {self.slip}" if self.slip else self.without_slip()

    def without_slip(self) -> str:
        """The number, its bounds and its place as a sentence."""
        kind = f" ({self.material_class})" if self.material_class else ""
        return f"{self.name} is {self.found}; plausible{kind}: {self.plausible}; see {self.place}"


@displayed(lambda c: f"{c.title}, {len(c.tests)} tests of {len(c.samples)} samples")
@dataclass(frozen=True)
class Campaign:
    """A campaign as described by campaign.toml and tests.csv; the exports in raw/ are not read yet.

    ``tests`` are the usable rows, ``set_aside`` the rows with faults or an ``exclude`` reason.
    ``samples`` maps each sample name to its pattern (``Sx`` is pattern S pulled along x).
    ``chosen_flat`` names the flat sample that calibrates the model where a user chose one; every stage asks
    :attr:`flat_sample`. ``inputs`` maps each input file that was read, by its path in the campaign, to the SHA-256 of
    the bytes that were read.
    """

    title: str
    root: Path
    nominal_area_m2: float | None
    tests: tuple[Test, ...]
    samples: Mapping[str, Pattern]
    material: str = ""
    counterface: str = ""
    slider_mass_kg: float = 0.0
    pull_speed_m_s: float | None = None
    set_aside: tuple[SetAside, ...] = ()
    problems: tuple[Problem, ...] = ()
    columns: Mapping[str, str | list[str]] = field(default_factory=dict)
    columns_by_file: Mapping[str, Mapping[str, str | list[str]]] = field(default_factory=dict)
    instrument: Mapping[str, float] = field(default_factory=dict)
    chosen_flat: str = ""
    zero: ZeroChoice = DEFAULT
    load_zero: ZeroChoice = DEFAULT
    contact: str = ""  # as stated: sled, pin_on_disc, ball_on_disc, ring_shear, reciprocating or rotary
    material_class: str = ""  # as stated: elastomer, polymer, metal, ceramic, lubricated or granular
    plausible: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # bounds stated in place of the usual
    measured: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # amplitude of a mechanism, and its u
    inputs: Mapping[str, str] = field(default_factory=dict, compare=False)

    @property
    def has_area(self) -> bool:
        """Whether the nominal area is stated; without one the adhesion term is a force, T0 in newton."""
        return self.nominal_area_m2 is not None

    @property
    def area_m2(self) -> float:
        """The nominal area, for what cannot do without; a CampaignError where none is stated."""
        if self.nominal_area_m2 is None:
            what = "the nominal area is not stated, so there is no pressure"
            allowed = "nominal_area_mm2 in campaign.toml"
            raise CampaignError(Problem("no_area", what, file="campaign.toml", allowed=allowed))
        return self.nominal_area_m2

    @property
    def flat_samples(self) -> tuple[str, ...]:
        """Every measured sample without cavities, in alphabetical order."""
        measured = {test.sample for test in self.tests}
        return tuple(sorted(s for s in measured if s in self.samples and self.samples[s].is_flat))

    @property
    def flat_sample(self) -> str:
        """The sample that calibrates the model: the chosen one, else F, else the only flat one, else empty."""
        flat = self.flat_samples
        if self.chosen_flat or "F" in flat:
            return self.chosen_flat or "F"
        return flat[0] if len(flat) == 1 else ""

    def area_fraction(self, sample: str) -> float:
        """Contact area fraction of a sample."""
        return self.samples[sample].area_fraction

    def nominal_pressure_Pa(self, normal_load_N: float) -> float:
        """p = N / A with A the nominal area."""
        return normal_load_N / self.area_m2


@displayed(lambda o: f"{o.test_id}: {o.action}")
@dataclass(frozen=True)
class Override:
    """A decision made by hand about one test: exclude it, or move its static peak or sliding window.

    Times as recorded in the trace; None where the automatic value is kept. ``row`` is its line in overrides.csv.
    """

    test_id: str
    action: Literal["exclude", "move"]
    reason: str = ""
    window_s: tuple[float, float] | None = None
    peak_s: float | None = None
    row: int | None = None


@displayed(lambda b: f"{b.override.test_id}: {b.override.action}")
@dataclass(frozen=True)
class ByHand:
    """A test with a decision made by hand, its trace and its automatic result."""

    override: Override
    trace: Trace
    automatic: Pull


@displayed(lambda i: f"{i.campaign.title}, {len(i.pulls)} pulls, {len(i.set_aside)} tests set aside")
@dataclass(frozen=True)
class Ingested:
    """A campaign with its exports read: one trace and one pull per usable test, the rest set aside.

    A test whose forces were evaluated elsewhere has a pull and no trace.

    ``by_hand`` holds every test with a decision made by hand: an excluded test is also in ``set_aside``; a moved one
    has its new result in ``pulls``.
    """

    campaign: Campaign
    traces: Mapping[str, Trace]
    pulls: Mapping[str, Pull]
    set_aside: tuple[SetAside, ...]
    by_hand: Mapping[str, ByHand] = field(default_factory=dict)

    def _file_of(self, test_id: str) -> str:
        """The export of a test; "" where its forces were evaluated elsewhere."""
        trace = self.traces.get(test_id)
        return trace.file if trace else ""

    def _trace_problems(self, test_id: str) -> tuple[Problem, ...]:
        trace = self.traces.get(test_id)
        return trace.problems if trace else ()

    def doubts(self) -> tuple[SetAside, ...]:
        """Tests that were used although their row, export or pull is doubtful, for example because of a spike."""
        found = []
        for test_id, pull in self.pulls.items():
            problems = tuple(
                replace(p, file=self._file_of(test_id) or p.file, test_id=test_id)
                for p in dict.fromkeys((*self._trace_problems(test_id), *pull.problems))
            )
            problems += tuple(note for note in self.campaign.problems if note.test_id == test_id)
            if problems:
                found.append(SetAside(test_id, "; ".join(map(str, problems)), problems))
        return tuple(found)

    def table(self) -> pd.DataFrame:
        """One row per usable test: test_id, sample, specimen, normal_load_N and the results of the pull."""
        import pandas as pd

        rows = [
            {
                "test_id": test.test_id,
                "sample": test.sample,
                "specimen": test.specimen,
                "normal_load_N": test.normal_load_N,
                "static_N": pull.static_N,
                "static_u_N": pull.static_u_N,
                "sliding_N": pull.sliding_N,
                "sliding_u_N": pull.sliding_u_N,
            }
            for test in self.campaign.tests
            if (pull := self.pulls.get(test.test_id)) is not None
        ]
        return pd.DataFrame(rows)


@displayed(lambda s: f"{s.ingested.campaign.title}, {len(s.ingested.pulls)} pulls, {len(s.fits)} fits")
@dataclass(frozen=True)
class Study:
    """One campaign with the results of all stages.

    ``fits`` holds the measured law of every sample and regime (T = mu N + tau0 A, the default weights) with its
    combined uncertainty, which is what the report states, ``other_fits`` the same by the tests of each sample alone
    under other weights or laws. ``simulated`` is the ensemble, one row per run: sample, pressure_Pa, normal_load_N (p
    times the nominal area of the campaign), angle_deg, seed, static_N, sliding_N. ``example_runs`` holds one full force
    trace of the model per sample. ``budget`` is the uncertainty budget of every fitted number, one row per component.
    ``power`` states the differences this campaign could detect, ``outlying`` the outlying pulls and specimens.
    ``differences`` holds the differences between samples measured on the same specimens, one row per pair of samples,
    regime and number. ``laws`` compares the candidate laws of every sample by held-out loads, ``dependence`` states
    how T/N changes with each recorded variable. ``doubts`` are the numbers outside their broad physical bounds.
    """

    ingested: Ingested
    fits: Fits = field(default_factory=Fits)
    other_fits: tuple[LawFit, ...] = ()
    comparison: Comparison | None = None
    simulated: pd.DataFrame | None = None
    example_runs: tuple[Run, ...] = ()
    budget: pd.DataFrame | None = None
    power: tuple[str, ...] = ()
    outlying: tuple[str, ...] = ()
    differences: pd.DataFrame | None = None
    laws: pd.DataFrame | None = None
    dependence: pd.DataFrame | None = None
    notes: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    undiagnosed: str = ""  # why there is no diagnosis

    def __post_init__(self) -> None:
        object.__setattr__(self, "fits", Fits(self.fits))  # the record is frozen

    @property
    def combined(self) -> Fits:
        """The same as ``fits``, which hold the combined uncertainty."""
        return self.fits


__all__ = [
    "CLOSED_TRACK_M",
    "REGIMES",
    "STANDARD_GRAVITY",
    "UNCORRECTED",
    "ByHand",
    "Campaign",
    "Comparison",
    "ComparisonRow",
    "Correction",
    "Doubt",
    "Evaluated",
    "ExportFormat",
    "Fits",
    "FloatArray",
    "Ingested",
    "LawFit",
    "Oscillation",
    "Override",
    "Pattern",
    "Phase",
    "Pull",
    "Regime",
    "Restart",
    "Run",
    "SetAside",
    "Study",
    "Test",
    "Trace",
]
