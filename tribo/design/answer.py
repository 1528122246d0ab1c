"""Answers: each design with its prediction, an interval with its parts, what moves it most, and what cannot be had."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import softmax

from tribo.berardo2019.published_tables import load_table2, load_table2_simulated_anew
from tribo.design import rounds
from tribo.design.rounds import (
    FINE_SEED,
    Aim,
    Lengths,
    Response,
    Rounds,
    Say,
    Surrogate,
    Surrogates,
    Tried,
    designed,
    friction_of,
    involved,
    kernel,
    misses,
    model_sd,
    on_mesh,
    reached,
    responses,
    search,
)
from tribo.design.target import Space, Target, Want, corrections_of_report, laws_of_report
from tribo.errors import CampaignError, Problem, SimulationError
from tribo.records import Campaign, FloatArray, LawFit, Pattern
from tribo.springblock.calibration import CalibrationRuns, calibrate
from tribo.springblock.config import LocalFriction, SimConfig
from tribo.springblock.design_file import with_parameters
from tribo.springblock.kept_runs import run_stored
from tribo.springblock.lattice import pattern_of

if TYPE_CHECKING:
    import pandas as pd

NINETY = 1.645


@dataclass(frozen=True)
class Prediction:
    """One wanted quantity of one design; the parts are standard deviations of its logarithm."""

    want: str
    value: float
    low: float
    high: float
    goal: str
    met: bool
    off_percent: float
    parts: dict[str, float]


@dataclass(frozen=True)
class Answer:
    """One design: lengths in um, predictions, the length that moves it most, and its distance from the target."""

    rank: int
    space: int
    lengths_um: Lengths
    area_fraction: float
    predictions: list[Prediction]
    moves_most: str
    met: bool


@dataclass(frozen=True)
class Outcome:
    """All answers, best first; ``refusal`` says why the target cannot be had, empty where it can."""

    answers: list[Answer]
    refusal: list[str]
    model_error: dict[str, tuple[float, float]]
    notes: list[str]
    lessons: list[Lesson]
    learnt: list[str]


def design(
    target: Target, folder: Path, kept: Path, seed: int, jobs: int, say: Say, measured: Sequence[Measured] = ()
) -> tuple[Outcome, list[Space]]:
    """Search the families of a target; reports of its material are taken relative to ``folder``.

    ``measured`` are samples of campaigns on earlier designs: what the model missed on them corrects the prediction of
    every design, the more the closer it is to one of them.

    Raises
    ------
    SimulationError
        No pattern of a family can be made, the material has no laws, or a run failed.
    """
    spaces = [Space(family, k) for k, family in enumerate(target.pattern)]
    if unmakeable := [_unmakeable(space) for space in spaces if not space.candidates(1, seed)]:
        raise SimulationError(unmakeable)
    names = {f.name for part in (SimConfig, LocalFriction) for f in fields(part)}
    if unknown := [name for name in target.parameters if name not in names]:
        raise SimulationError(Problem("unknown_key", "unknown parameter", column="parameters", found=unknown[0]))
    base = with_parameters(SimConfig(duration_peaks=2.0, cavity_shape="exact"), target.parameters)
    report = None if target.material.report is None else folder / target.material.report
    laws = {} if report is None else laws_of_report(report, target.material.flat)
    for regime in ("static", "sliding"):
        if (stated := getattr(target.material, regime)) is not None:
            laws[regime] = (stated[0], 1e3 * stated[1])
    if len(laws) == 1:
        raise SimulationError(Problem("no_laws", "a material has a static and a sliding law", column="material"))
    if laws:
        few = CalibrationRuns(repeats=2, iterations=3, seed=seed)
        base = base.with_(friction=calibrate(laws["static"], laws["sliding"], base, few, jobs))
    all_rounds = Rounds(spaces, responses(target), kept, seed, jobs)
    errors = model_errors(target, report)
    lessons = lessons_of(measured, all_rounds, base, say)
    learnt = Learnt.of(lessons, errors, target, spaces)
    aim = Aim(target, spaces, learnt.missed, bool(learnt.lessons))
    coarse, fine, finer, surrogates = search(all_rounds, aim, base, say)
    mesh = {r: finer[1].logs[r] - finer[0].logs[r] for r in responses(target)}
    answers = [answered(k + 1, t, surrogates, aim, mesh) for k, t in enumerate(fine)]
    best = fine[0]
    answers.sort(key=lambda a: (not a.met, a.rank))
    refusal = [] if any(a.met for a in answers) else refused([*coarse, *fine], aim, answers[0])
    contact = "rigid" if base.contact_stiffness_Pa_per_m is None else "elastic"
    moved = ", ".join(f"{r[0]} along {r[2]} {100 * (math.exp(v) - 1):+.1f} %" for r, v in mesh.items())
    notes = [f"contact is {contact}; halving the mesh of 2.5 um moves {moved}"]
    said = learnt_text(lessons, target) + (correction_text(learnt, best) if learnt.lessons else [])
    return Outcome(answers, refusal, errors, notes, lessons, said), spaces


def _unmakeable(space: Space) -> Problem:
    middle = space.lengths_um(np.full(len(space.free), 0.5))
    return Problem(
        "cannot_be_made", f"no pattern within these bounds can be made: {space.fault(middle)}",
        column=f"pattern.{space.number}", found=", ".join(f"{k} = {v:g}" for k, v in middle.items()),
    )  # fmt: skip


def model_errors(target: Target, report: Path | None) -> dict[str, tuple[float, float]]:
    """By regime, the mean of ln(measured over predicted) to be added, and its standard deviation for a new pattern.

    From the patterns of a report; else from those of the paper, whose mean is not taken over to other materials: the
    deviation then is the root of the mean square.
    """
    found = {} if report is None else corrections_of_report(report, target.material.flat)
    p = float(np.mean([target.pressure_Pa(w) for w in target.target]))
    for regime, off in published_misses(p).items():
        found.setdefault(regime, (0.0, math.sqrt(float(np.mean([v**2 for v in off.values()])))))
        if target.material.model_error_percent is not None:
            found[regime] = (found[regime][0], math.log1p(target.material.model_error_percent / 100))
    return found


def published_misses(pressure_Pa: float) -> dict[str, dict[str, float]]:
    """ln(measured over predicted) of the paper's patterns at a pressure, relative to its flat sample, by regime."""
    measured = load_table2().query("source == 'experiment'").set_index(["sample", "regime"])
    simulated = load_table2_simulated_anew().set_index(["sample", "regime"])

    def log_ratio(table: pd.DataFrame, sample: str, regime: str) -> float:
        row: Any = table.loc[(sample, regime)]
        return math.log(float(row["mu"]) + 1e3 * float(row["tau0_kPa"]) / pressure_Pa)

    def off(sample: str, regime: str) -> float:
        return log_ratio(measured, sample, regime) - log_ratio(simulated, sample, regime)

    return {
        regime: {s: off(s, regime) - off("F", regime) for s in ("A", "B", "C", "Sx", "Sy")}
        for regime in ("static", "sliding")
    }


@dataclass(frozen=True)
class Measured:
    """The measured laws of one sample of a campaign: its pattern, and its direction "x", "y" or "all"."""

    campaign: str
    sample: str
    pattern: Pattern
    direction: str
    fits: tuple[LawFit, ...]


@dataclass(frozen=True)
class Lesson:
    """Measured over predicted of one sample: T/N of both, 100 (measured / predicted - 1) and its standard uncertainty,
    which is that of the measured law and of the scatter of the runs."""

    campaign: str
    sample: str
    pattern: Pattern
    regime: str
    pressure_kPa: float
    direction: str
    measured: float
    predicted: float
    percent: float
    u_percent: float

    @property
    def response(self) -> Response:
        """What was measured of the pattern."""
        return self.regime, 1e3 * self.pressure_kPa, self.direction

    @property
    def log(self) -> float:
        """ln(measured over predicted)."""
        return math.log(self.measured / self.predicted)

    @property
    def u(self) -> float:
        """Standard uncertainty of the same."""
        return self.u_percent / (100 + self.percent)


def measured_of(campaign: Campaign, fits: Sequence[LawFit], name: str) -> list[Measured]:
    """The samples of a measured campaign with their laws, flat ones too.

    Parameters
    ----------
    campaign : Campaign
        The campaign as read.
    fits : sequence of LawFit
        Its laws, from :func:`tribo.fit`.
    name : str
        What the campaign is called in the answer.

    Raises
    ------
    CampaignError
        It states no nominal area, or no patterned sample has a law.

    Examples
    --------
    >>> from tribo.design.answer import measured_of
    >>> ingested = tribo.ingest(tribo.load_campaign(tribo.data_dir() / "example"))
    >>> [m.sample for m in measured_of(ingested.campaign, tribo.fit(ingested), "example")]
    ['F', 'A', 'B', 'C', 'Sx', 'Sy']
    """
    if campaign.nominal_area_m2 is None:
        what = "a campaign that a design learns from states its nominal area"
        raise CampaignError(Problem("no_area", what, file=name, column="nominal_area_mm2"))
    found = []
    for sample, pattern in campaign.samples.items():
        own = tuple(f for f in fits if f.sample == sample and f.has_area and f.adhesion in f.parameters)
        ways = {t.direction for t in campaign.tests if t.sample == sample}
        if own:
            found.append(Measured(name, sample, pattern, next(iter(ways)) if ways in ({"x"}, {"y"}) else "all", own))
    if all(m.pattern.is_flat for m in found):
        raise CampaignError(Problem("no_laws", "no patterned sample of this campaign has a law", file=name))
    return found


def lessons_of(measured: Sequence[Measured], all_rounds: Rounds, base: SimConfig, say: Say) -> list[Lesson]:
    """Measured over predicted of every sample, at the pressures and in the direction that are wanted.

    The patterns are run as the designs are: on the fine mesh, with the same random numbers.
    """
    ways: dict[str, list[Measured]] = {}
    for m in measured:
        ways.setdefault("all" if m.pattern.is_flat else m.direction, []).append(m)
    found = []
    for way, own in ways.items():
        wanted = [r for r in all_rounds.wanted if r[2] == way or all(m.pattern.is_flat for m in own)]
        if not wanted:
            continue
        configs = designed([m.pattern for m in own], wanted, on_mesh(base, "fine"), rounds.FINE_RUNS,
                           all_rounds.seed + FINE_SEED)  # fmt: skip
        table = run_stored(
            configs, all_rounds.folder / f"measured-{way}.h5", all_rounds.jobs,
            progress=lambda k, n: say("running what was measured", k, n),
        )  # fmt: skip
        for m, (logs, errors) in zip(own, friction_of(table, wanted, rounds.FINE_RUNS), strict=True):
            for fit in m.fits:
                for r in wanted:
                    if r[0] != fit.regime or not (m.pattern.is_flat or r[2] == m.direction):
                        continue
                    assert fit.nominal_area_m2 is not None
                    load = fit.nominal_area_m2 * r[1]
                    force, u = float(fit.force_N(load)), float(fit.force_u_N(load))
                    if force > 0:
                        ratio = force / load / math.exp(logs[r])
                        found.append(Lesson(
                            m.campaign, m.sample, m.pattern, r[0], r[1] / 1e3, r[2], force / load, math.exp(logs[r]),
                            100 * (ratio - 1), 100 * ratio * math.hypot(u / force, errors[r]),
                        ))  # fmt: skip
    return found


# A correction has a part that all patterns share, one that those of a family share, and one that is alike for
# neighbours. The share of the first and the reach of the last, in ln of the lengths and in the area fraction, lie
# between those of the patterns of the paper (0.3 and 0.5, the most likely at 10 kPa) and those of changes of the open
# parameters of the model (up to 0.9 and 2.9 in `benchmarks/design_exam.py reach`, with room above). What those of a
# family share of the rest is not known: `benchmarks/design_exam.py carried` shows what it does.
SHARES = np.linspace(0.3, 0.9, 7)
SHARES_OF_FAMILY = np.array([0.3, 0.6, 0.9])
REACHES = np.geomspace(0.5, 4.0, 7)
LEAST_NOISE = 1e-3  # of ln(T/N), so that equal patterns can be solved for
OWN_SHAPES = ("A", "B", "C", "Sx")  # Sy has the shape of Sx


def place_of(pattern: Pattern) -> tuple[tuple[object, ...], FloatArray]:
    """The family of a pattern, and where it lies in it: ln of its lengths in um, and its area fraction."""
    lengths = np.log(np.array([*(pattern.size_m or (1e-6, 1e-6)), *(pattern.pitch_m or (1e-6, 1e-6))]) / 1e-6)
    family = (pattern.cavity, pattern.feature, pattern.lattice, pattern.staggered)
    return family, np.append(lengths, pattern.area_fraction)


def likenesses(one: Sequence[Pattern], other: Sequence[Pattern]) -> FloatArray:
    """How alike two rows of patterns are beyond what all share, 1 for the same pattern, 0 for other families.

    Of shape (shares of a family, reaches, n, m).
    """
    a, b = [place_of(p) for p in one], [place_of(p) for p in other]
    same = np.array([[f == g for g, _ in b] for f, _ in a], float)
    x, y = np.array([x for _, x in a]), np.array([y for _, y in b])
    near = np.array([kernel(x, y, np.full(x.shape[1], reach)) for reach in REACHES])
    of_family = SHARES_OF_FAMILY[:, None, None, None]
    return np.asarray(same * (of_family + (1 - of_family) * near))


def mixed(likeness: FloatArray) -> FloatArray:
    """Correlations of corrections, (shares, shares of a family, reaches, n, m), from how alike patterns are."""
    shares = SHARES[:, None, None, None, None]
    return np.asarray(shares + (1 - shares) * likeness)


def log_likelihood(correlation: FloatArray, y: FloatArray) -> FloatArray:
    """Of values y (n,) of mean zero with this covariance (..., n, n)."""
    solved = np.linalg.solve(correlation, np.broadcast_to(y[:, None], (*correlation.shape[:-1], 1)))[..., 0]
    return np.asarray(-0.5 * solved @ y - 0.5 * np.linalg.slogdet(correlation)[1])


@dataclass(frozen=True)
class Learnt:
    """What campaigns on earlier designs say of the model: a Gaussian process of ln(measured over predicted).

    ``prior`` is its mean and standard deviation by regime before. ``weights`` are those of every share and reach by
    what was measured: they give the correction. ``weights_of_paper`` count the patterns of the paper as well, whose
    errors differ more from pattern to pattern: they give the doubt that is left.
    """

    lessons: dict[Response, list[Lesson]]
    prior: Mapping[str, tuple[float, float]]
    weights: FloatArray  # (shares, shares of a family, reaches)
    weights_of_paper: FloatArray
    spaces: Sequence[Space]
    wanted: Sequence[Response]

    @classmethod
    def of(
        cls, lessons: Sequence[Lesson], prior: Mapping[str, tuple[float, float]], target: Target,
        spaces: Sequence[Space],
    ) -> Learnt:  # fmt: skip
        """From measured patterns; a prior that is narrower than what was measured is widened to it."""
        by_response: dict[Response, list[Lesson]] = {}
        for lesson in lessons:
            if not lesson.pattern.is_flat:
                by_response.setdefault(lesson.response, []).append(lesson)
        prior = dict(prior)
        for regime, (mean, sd) in prior.items():
            squares = [(x.log - mean) ** 2 for r, own in by_response.items() if r[0] == regime for x in own]
            prior[regime] = mean, max(sd, math.sqrt(float(np.mean(squares)))) if squares else sd
        of_paper = np.zeros((len(SHARES), len(SHARES_OF_FAMILY), len(REACHES)))
        shapes = [p for p in map(pattern_of, OWN_SHAPES) if p is not None]
        published = mixed(likenesses(shapes, shapes)) + LEAST_NOISE * np.eye(len(shapes))
        pressure = float(np.mean([target.pressure_Pa(w) for w in target.target]))
        for off in published_misses(pressure).values():
            y = np.array([off[s] for s in OWN_SHAPES])
            of_paper += log_likelihood(published * float(np.mean(y**2)), y)
        of_measured = np.zeros_like(of_paper)
        for r, own in by_response.items():
            # pressures of one regime are measured on the same specimens: together they count once
            alike = sum(other[0] == r[0] for other in by_response)
            y = np.array([x.log for x in own]) - prior[r[0]][0]
            of_measured += log_likelihood(covariance_of(own, prior[r[0]][1]), y) / alike
        weights = softmax(of_measured), softmax(of_measured + of_paper)
        return cls(by_response, prior, *weights, spaces, responses(target))

    def missed(self, number: int, lengths: Sequence[Lengths]) -> dict[Response, tuple[FloatArray, FloatArray]]:
        """For designs of a family, ln(measured over predicted) of every response and its standard deviation."""
        patterns = [self.spaces[number].pattern(one) for one in lengths]
        return {r: self.at(patterns, r) for r in self.wanted}

    def at(self, patterns: Sequence[Pattern], r: Response) -> tuple[FloatArray, FloatArray]:
        """The same of any patterns: of a response that was not measured, what was known before."""
        (mean, sd), own = self.prior[r[0]], self.lessons.get(r, [])
        if not own:
            return np.full(len(patterns), mean), np.full(len(patterns), sd)
        y = np.array([x.log for x in own]) - mean
        between = sd**2 * mixed(likenesses(patterns, [x.pattern for x in own]))
        solved = np.linalg.solve(covariance_of(own, sd), np.swapaxes(between, -1, -2))  # (..., n, m)
        means = y @ solved
        variances = np.maximum(sd**2 - np.einsum("...mn,...nm->...m", between, solved), 0.0)
        middle = np.tensordot(self.weights, means, 3)
        return mean + middle, np.sqrt(np.tensordot(self.weights_of_paper, variances + (means - middle) ** 2, 3))


def covariance_of(own: Sequence[Lesson], sd: float) -> FloatArray:
    """Of what was measured of one response, by shares and reach: what the model misses, and the uncertainty of each."""
    patterns = [x.pattern for x in own]
    noise = np.diag([max(x.u, LEAST_NOISE) ** 2 for x in own])
    return np.asarray(sd**2 * mixed(likenesses(patterns, patterns)) + noise)


def learnt_text(lessons: Sequence[Lesson], target: Target) -> list[str]:
    """What was measured beside what was predicted, sample by sample, and whether it meets the target already."""
    said = []
    samples: dict[tuple[str, str], list[Lesson]] = {}
    for x in lessons:
        samples.setdefault((x.campaign, x.sample), []).append(x)
    for (name, sample), own in samples.items():
        own = list({(x.regime, x.pressure_kPa): x for x in own}.values()) if own[0].pattern.is_flat else own
        words = ", ".join(
            f"{x.regime} T/N at {x.pressure_kPa:g} kPa is {x.measured:.3g} measured over {x.predicted:.3g} predicted "
            f"({x.percent:+.0f} ± {x.u_percent:.0f} %)"
            for x in own
        )
        what = f"{name}, flat sample {sample}" if own[0].pattern.is_flat else f"{name}, {sample}"
        said.append(f"{what}: {words}")
        if own[0].pattern.is_flat and any(abs(x.log) > 2 * x.u for x in own):
            said.append("the flat sample is off as well: state its laws under [material]")
        logs = {x.response: math.log(x.measured) for x in own}
        if not own[0].pattern.is_flat and all(r in logs for r in responses(target)):
            off = [w for w in target.target if w.best is None and float(misses(w, target, logs)) > 1]
            missed = "misses " + ", ".join(w.text() for w in off)
            said.append(f"{what}: as measured, it {missed if off else 'meets the target'}")
    return said


def correction_text(learnt: Learnt, best: Tried) -> list[str]:
    """By how much the measured patterns move the prediction of the best design, and what they leave of its error."""
    said = []
    for r, (mean, sd) in learnt.missed(best.space, [best.lengths_um]).items():
        before, u = learnt.prior[r[0]]
        what = f"{r[0]} friction" + (f" along {r[2]}" if r[2] != "all" else "") + f" at {r[1] / 1e3:g} kPa"
        if r in learnt.lessons:
            moved = 100 * math.expm1(float(mean[0]) - before)
            said.append(
                f"{what} of the first design: what was measured moves the prediction by {moved:+.1f} %; the model may "
                f"still be off by {100 * float(sd[0]):.0f} % (before: {100 * u:.0f} %)"
            )
        else:
            said.append(f"{what}: not measured in this direction; the model may be off by {100 * u:.0f} %")
    return said


def answered(rank: int, t: Tried, surrogates: Surrogates, aim: Aim, mesh: dict[Response, float]) -> Answer:
    """The prediction of one design for everything that is wanted."""
    target, space = aim.target, aim.spaces[t.space]
    logs = aim.corrected_design(t)
    sds = {r: sd for r, (_, sd) in aim.missed(t.space, [t.lengths_um]).items()}
    own = surrogates.get(t.space)
    slopes = {want.text(): slopes_of(want, aim, t, own) for want in target.target}
    predictions = []
    for want in target.target:
        value = float(reached(want, target, logs))
        parts = {
            # of the prediction, and of as many that check it
            "runs": math.sqrt(2 * sum(t.errors[r] ** 2 for r in involved(want, target))),
            "mesh": abs(float(reached(want, target, mesh))),
            "model": float(model_sd(want, target, sds)[0]),
            "making": space.family.tolerance_um * math.sqrt(sum(s**2 for s in slopes[want.text()].values())),
        }
        width = NINETY * math.sqrt(sum(v**2 for v in parts.values()))
        miss = float(misses(want, target, logs))
        predictions.append(Prediction(
            want.text(), math.exp(value), math.exp(value - width), math.exp(value + width), goal_text(want, target),
            want.best is not None or miss <= (1.0 if target.goal(want) is not None else 1e-9),
            0.0 if want.best else 100 * math.expm1(miss * math.log1p(want.tolerance_percent / 100)), parts,
        ))  # fmt: skip
    first = slopes[target.target[0].text()]
    moves = max(first, key=lambda name: abs(first[name]), default="")
    words = f"{moves}: {100 * first[moves]:+.1f} % per um" if moves else "no length is free"
    area = space.pattern(t.lengths_um).area_fraction
    return Answer(rank, t.space, t.lengths_um, area, predictions, words, all(p.met for p in predictions))


def slopes_of(want: Want, aim: Aim, t: Tried, surrogates: dict[Response, Surrogate] | None) -> dict[str, float]:
    """Change of ln of the wanted quantity per um of every free length, from the surrogate and what was measured."""
    if surrogates is None:
        return {}
    found, space = {}, aim.spaces[t.space]
    for name, (low, high) in space.free.items():
        step = 0.05 * (high - low)
        ends = [t.lengths_um | {name: max(low, t.lengths_um[name] - step)}]
        ends.append(t.lengths_um | {name: min(high, t.lengths_um[name] + step)})
        x = np.array([space.at(end) for end in ends])
        logs, _ = aim.corrected(t.space, ends, {r: s(x) for r, s in surrogates.items()})
        value = reached(want, aim.target, logs)
        found[name] = float((value[1] - value[0]) / (ends[1][name] - ends[0][name]))
    return found


def goal_text(want: Want, target: Target) -> str:
    goal = target.goal(want)
    if want.best is not None:
        return f"the {want.best}"
    if goal is not None:
        return f"{goal:.4g} within {want.tolerance_percent:g} %"
    bounds = {"at least": want.at_least, "at most": want.at_most}
    return " and ".join(f"{word} {bound:g}" for word, bound in bounds.items() if bound)


def refused(known: Sequence[Tried], aim: Aim, nearest: Answer) -> list[str]:
    """Why no design meets the target: what was reached at most, the nearest, and the limits it lies at."""
    said = []
    corrected = [aim.corrected_design(t) for t in known]
    for want, p in zip(aim.target.target, nearest.predictions, strict=True):
        values = np.exp([float(reached(want, aim.target, logs)) for logs in corrected])
        if not p.met:
            said.append(
                f"{p.want}: wanted {p.goal}; {len(values)} patterns of these families reach {values.min():.3g} to "
                f"{values.max():.3g}; the nearest has {p.value:.3g} ({p.off_percent:.0f} % off)"
            )
    limits = aim.spaces[nearest.space].limits_at(nearest.lengths_um)
    said.append("what holds it back: " + ("; ".join(limits) if limits else "the other targets, not a length"))
    return said
