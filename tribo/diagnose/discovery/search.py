"""The search: every law of the grammar scored on a fitted model, against campaigns that the model makes itself."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribo.diagnose.discovery.grammar import Group, groups_of, shapes_of
from tribo.diagnose.discovery.written_law import ADHESION_TERM, LOAD_TERM, Shape, WrittenLaw
from tribo.diagnose.search.screen import share_beyond
from tribo.diagnose.statistics.chance import as_measured, drawn_residuals, refit
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.gain import gain
from tribo.diagnose.statistics.interval import estimates
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Acting, log_forces
from tribo.diagnose.statistics.scatter import Replicates
from tribo.diagnose.statistics.scores import columns_in, scores
from tribo.diagnose.verdict import Estimate, Gain
from tribo.records import REGIMES, FloatArray

Progress = Callable[[str, int, int], None]
AT_ONCE = 20  # simulated campaigns at a time
CLOSE = 3.0  # log likelihood within which laws cannot be told apart: odds of 20 to 1
TRIED = 6  # forms that are fitted in full
SHOWN = 25  # of the best laws, in the table
MOST_LAWS = 3


@dataclass(frozen=True)
class Scored:
    """One law by its score: log likelihood gained, and what is left of it after paying for the choice."""

    law: WrittenLaw
    gain: float
    net: float


@dataclass(frozen=True)
class FoundLaw:
    """A law beyond chance, fitted, with those the design cannot distinguish from it.

    ``p`` is the chance that the best of all laws gains as much with nothing hidden. ``ties`` are the other forms within
    CLOSE of it, ``n_ties`` their number. ``model`` is the fit with all laws so far.
    """

    law: WrittenLaw
    parameters: dict[str, Estimate]
    effect_percent: tuple[float, float, float]
    p: float
    gain: Gain | None
    ties: tuple[WrittenLaw, ...]
    n_ties: int
    model: ModelFit


@dataclass(frozen=True)
class Discovery:
    """What the search found: laws in the order of their strength, and the best of the table of scores."""

    laws: tuple[FoundLaw, ...]
    scored: tuple[Scored, ...]
    searched: int


def discover_laws(
    model: ModelFit,
    *,
    level: float = 0.01,
    replicates: int = 60,
    rng: np.random.Generator | None = None,
    progress: Progress | None = None,
) -> Discovery:
    """Add the best law of the grammar while it is beyond what chance gives the best of all laws.

    A column has one law: what a second one would add is an error in the form of the first.

    Parameters
    ----------
    model : ModelFit
        A fitted campaign, with its causes if it has any.
    level : float
        Chance of writing a law where nothing is hidden.
    replicates : int
        Simulated campaigns, all of them searched in the same way.
    rng : numpy Generator, optional
        Of the simulated campaigns and the resamples behind the error of the gain.
    """
    rng = rng or np.random.default_rng(0)
    found: list[FoundLaw] = []
    table: tuple[Scored, ...] = ()
    searched = 0
    while len(found) < MOST_LAWS:
        used = {name for law in found for name in law.law.columns}
        scored, chance = _searched(model, used, replicates, rng, progress)
        table, searched = table or tuple(scored[:SHOWN]), len(scored)
        p = share_beyond(chance, scored[0].net) if scored else 1.0
        if p >= level:
            break
        law = _settled(model, scored, p, rng)
        found.append(law)
        model = law.model
    return Discovery(tuple(found), table, searched)


def _searched(
    model: ModelFit, used: Collection[str], replicates: int, rng: np.random.Generator, progress: Progress | None
) -> tuple[list[Scored], FloatArray]:
    """Every law scored, the best first, and the best net score in each simulated campaign."""
    c = model.setup.observations.conditions
    shapes, groups = shapes_of(c, used), groups_of(c)
    terms = _terms(model)
    measured = as_measured(model)
    best: list[Scored] = []
    batches = [refit(model, drawn_residuals(model, rng, AT_ONCE)) for _ in range(max(replicates // AT_ONCE, 1))]
    chance = np.full((len(batches), AT_ONCE), -np.inf)
    for k, group in enumerate(groups):
        laws, columns, spans, cost = _columns(model, shapes, group, terms)
        if not laws:
            continue
        gains = _gains(measured, columns, spans)[0]
        net = gains - cost
        best += [Scored(law, float(g), float(n)) for law, g, n in zip(laws, gains, net, strict=True)]
        for b, batch in enumerate(batches):
            chance[b] = np.maximum(chance[b], (_gains(batch, columns, spans) - cost).max(axis=1))
        if progress is not None:
            progress("discover", k + 1, len(groups))
    return sorted(best, key=lambda s: -s.net), chance.ravel()


def _gains(fitted: Replicates, columns: FloatArray, spans: list[slice]) -> FloatArray:
    """Log likelihood that each law gains, (r, laws); each column beyond the first costs one unit."""
    freedom = np.array([span.stop - span.start for span in spans])
    return 0.5 * scores(fitted, columns_in(columns, spans))[0] - (freedom - 1.0)


def _terms(model: ModelFit) -> dict[str, FloatArray]:
    """Share of the load term and of the adhesion term in the modelled T, (n, 2) each."""
    s = model.setup
    base = s.base(model.law)
    load = s.observations.conditions.normal_load_N
    adhesion = np.exp(log_forces(base.forces(np.zeros_like(load))) - log_forces(base.forces(load)))
    return {LOAD_TERM: 1.0 - adhesion, ADHESION_TERM: adhesion}


def _columns(
    model: ModelFit,
    shapes: Sequence[tuple[tuple[Shape, ...], float]],
    group: Group,
    terms: dict[str, FloatArray],
) -> tuple[list[WrittenLaw], FloatArray, list[slice], FloatArray]:
    """The laws of a group that change anything, their columns (n, 2, k), where each lies in them, and its cost."""
    c = model.setup.observations.conditions
    acts = terms.get(group.acts_on, np.ones((len(c.sample), 2)))
    acts = acts * np.array([group.regime != REGIMES[1], group.regime != REGIMES[0]])
    acts = acts * group.law(()).weight(c)[:, None]
    laws, columns, spans, cost, at = [], [], [], [], 0
    for shape, price in shapes:
        law = group.law(shape)
        column = law.course(c)[:, None, :] * acts[:, :, None]
        if np.ptp(column) < 1e-9:
            continue
        laws.append(law)
        columns.append(column)
        spans.append(slice(at, at + column.shape[2]))
        at += column.shape[2]
        cost.append(group.cost + price)
    return laws, np.concatenate(columns, axis=2) if columns else np.zeros((0, 2, 0)), spans, np.array(cost)


def _settled(model: ModelFit, scored: Sequence[Scored], p: float, rng: np.random.Generator) -> FoundLaw:
    """The best forms fitted in full, the best of them with its parameters, and what cannot be told apart."""
    forms: dict[tuple[object, ...], Scored] = {}
    for s in scored:
        forms.setdefault(s.law.form, s)
        if len(forms) > 10 * TRIED:
            break
    leading = list(forms.values())[:TRIED]
    fitted = [(s, _fitted(model, s.law)) for s in leading]
    ranked = sorted(fitted, key=lambda pair: -(pair[1].score - (pair[0].gain - pair[0].net)))
    first, after = ranked[0]
    net = after.score - (first.gain - first.net)
    ties = [s.law for s, f in ranked[1:] if f.score - (s.gain - s.net) > net - CLOSE]
    n_ties = sum(s.net > leading[0].net - CLOSE for s in forms.values()) - 1
    law = first.law.with_values(after.values[-1])
    parameters = estimates(after, len(after.acting) - 1)
    return FoundLaw(
        law, parameters, _percent(law, after, parameters), p, gain(model, after, rng), tuple(ties),
        max(n_ties, len(ties)), after,
    )  # fmt: skip


def _fitted(model: ModelFit, law: WrittenLaw) -> ModelFit:
    return fit(model.setup, (*model.acting, Acting(law.mechanism())), start=replace(model))


def _percent(law: WrittenLaw, f: ModelFit, parameters: dict[str, Estimate]) -> tuple[float, float, float]:
    """Change of T (or of the term) from the least to the most of the shape, where the law acts fully; 90 % interval."""
    c = f.setup.observations.conditions
    course = law.course(c)[law.weight(c) != 0]
    if course.shape[1] > 1:
        size = 2.0 * float(np.hypot(parameters["a"].value, parameters["b"].value))
        error = (parameters["a"].high - parameters["a"].low) / 1.0
        ends = (size - 0.5 * error, size, size + 0.5 * error)
    else:
        reach = float(np.ptp(course)) * float(np.abs(law.weight(c)).max())
        a = parameters["a"]
        ends = (a.low * reach, a.value * reach, a.high * reach)
    low, value, high = (100.0 * float(np.expm1(x)) for x in ends)
    return value, low, high
