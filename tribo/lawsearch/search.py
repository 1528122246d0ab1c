"""The search: every law of the grammar scored on a fitted model, against campaigns that the model makes itself."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from tribo.diagnostics.contrasts import allowed_wrong_form, decided, share_beyond
from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.replicates import as_measured, drawn_residuals, refit
from tribo.diagnostics.scatter import Replicates
from tribo.diagnostics.score_statistics import columns_in, scores
from tribo.lawsearch.grammar import Group, corrects_a_pattern, groups_of, shapes_of
from tribo.lawsearch.model_choice import CauseForms, FoundLaw, Searched, settled
from tribo.lawsearch.scoring import Acts, Courses, Projection, Scored, acts_of, acts_of_one, courses_of, terms_of
from tribo.records import FloatArray

Progress = Callable[[str, int, int], None]
AT_ONCE = 20  # simulated campaigns at a time
RESCORED, RESCORED_MEASURED = 60, 400  # best laws at the fitted noise that are scored with each campaign's own noise
SHOWN = 25  # of the best laws, in the table
MOST_LAWS = 3


@dataclass(frozen=True)
class Discovery:
    """What the search found: laws in the order of their strength, and the best of the table of scores.

    ``of_causes`` are the other forms that the laws of the causes may have, where these are recorded columns.
    """

    laws: tuple[FoundLaw, ...]
    scored: tuple[Scored, ...]
    searched: int
    of_causes: tuple[CauseForms, ...] = ()


def discover_laws(
    model: ModelFit,
    *,
    level: float = 0.01,
    replicates: int = 60,
    rng: np.random.Generator | None = None,
    progress: Progress | None = None,
    without: Collection[str] = (),
) -> Discovery:
    """Add the best law of the grammar while it is beyond what chance gives the best of all laws.

    A column has one law: what a second one would add is an error in the form of the first. The causes of the model
    may be wrong in form, too, so that no law is written of what they leave.

    Parameters
    ----------
    model : ModelFit
        A fitted campaign, with its causes if it has any.
    level : float
        Chance of writing a law where nothing is hidden.
    replicates : int
        Simulated campaigns at most, each searched in the same way.
    rng : numpy Generator, optional
        Of the simulated campaigns and the resamples behind the error of the gain.
    without : collection of str
        Columns that have a law already.
    """
    rng = rng or np.random.default_rng(0)
    found: list[FoundLaw] = []
    table: tuple[Scored, ...] = ()
    searched = 0
    if model.acting:
        model = allowed_wrong_form(model)
    while len(found) < MOST_LAWS:
        used = {*without, *(name for law in found for name in law.law.columns)}
        grammar = Grammar.of(model, used)
        if not grammar.courses.shapes:
            break
        scored = _measured(model, grammar)
        table, searched = table or tuple(scored[:SHOWN]), searched or grammar.size
        if _by_chance_alone(scored[0].net) >= level:
            break
        p = share_beyond(_chance(model, grammar, scored[0].net, (replicates, rng), progress), scored[0].net)
        if p >= level:
            break
        law = settled(model, Searched(grammar.courses, grammar.groups, p), scored[0].law, rng)
        found.append(law)
        model = law.model
    return Discovery(tuple(found), table, searched)


@dataclass(frozen=True)
class Grammar:
    """All laws of a campaign: every one of the groups with every one of the courses."""

    courses: Courses
    groups: tuple[Group, ...]
    acts: Acts
    acts_of_each: tuple[FloatArray, ...]

    @classmethod
    def of(cls, model: ModelFit, without: Collection[str]) -> Grammar:
        c = model.setup.observations.conditions
        groups, terms = tuple(groups_of(c)), terms_of(model)
        each = tuple(acts_of_one(g, c, terms) for g in groups)
        return cls(courses_of(shapes_of(c, without), c), groups, acts_of(groups, model.setup, terms), each)

    @property
    def size(self) -> int:
        return len(self.groups) * len(self.courses.shapes)

    def net(self, projected: Projection) -> FloatArray:
        """What each law gains less its cost, (r, groups * shapes)."""
        found = projected.gains(self.courses, self.acts) - self.courses.cost - self._costs[:, None]
        found[:, corrects_a_pattern(self.groups, self.courses.shapes)] = -np.inf
        return found.reshape(len(found), -1)

    @property
    def _costs(self) -> FloatArray:
        return np.array([group.cost for group in self.groups])

    def cost(self, index: NDArray[np.int64]) -> FloatArray:
        group, shape = np.divmod(index, len(self.courses.shapes))
        return np.asarray(self.courses.cost[shape] + self._costs[group])

    def gains(self, fitted: Replicates, index: NDArray[np.int64]) -> FloatArray:
        """Log likelihood that the laws at ``index`` gain at the noise of a campaign, (r, laws)."""
        columns, spans, at = [], [], 0
        for group, shape in zip(*np.divmod(index, len(self.courses.shapes)), strict=True):
            column = self.courses.column(int(shape))[:, None, :] * self.acts_of_each[group][:, :, None]
            columns.append(column)
            spans.append(slice(at, at + column.shape[2]))
            at += column.shape[2]
        freedom = np.array([span.stop - span.start for span in spans])
        return 0.5 * scores(fitted, columns_in(np.concatenate(columns, axis=2), spans))[0] - (freedom - 1.0)


def _measured(model: ModelFit, grammar: Grammar) -> list[Scored]:
    """The best laws of the campaign, scored with its own noise, the best first."""
    net = grammar.net(Projection(model.linear, model.linear.residual[None]))[0]
    index = best_of(net, RESCORED_MEASURED)
    gains = grammar.gains(as_measured(model), index)[0]
    nets = gains - grammar.cost(index)
    shapes, groups = grammar.courses.shapes, grammar.groups
    each = zip(index, gains, nets, strict=True)
    laws = [Scored(groups[i // len(shapes)].law(shapes[i % len(shapes)]), float(g), float(n)) for i, g, n in each]
    return sorted(laws, key=lambda s: -s.net)


def _by_chance_alone(net: float) -> float:
    """The chance that a law gains so much if it is the only one tried, after Wilks: less than that of the best of all,
    so that a law which fails here needs no simulated campaigns."""
    return float(chdtrc(1, 2.0 * max(net, 0.0)))


def _chance(
    model: ModelFit,
    grammar: Grammar,
    strongest: float,
    draws: tuple[int, np.random.Generator],
    progress: Progress | None,
) -> FloatArray:
    """The best net score in each of the campaigns that the model makes itself, until they decide on ``strongest``.

    All laws are scored at the fitted noise, and the best of them with the noise estimated in each campaign.
    """
    replicates, rng = draws
    chance: list[float] = []
    while len(chance) < replicates:
        drawn = drawn_residuals(model, rng, AT_ONCE)
        made = refit(model, drawn)
        nets = grammar.net(Projection(model.linear, drawn.transpose(0, 2, 1)))
        for k, net in enumerate(nets):
            index = best_of(net, RESCORED)
            chance.append(float((grammar.gains(made.one(k), index)[0] - grammar.cost(index)).max()))
        if progress is not None:
            progress("discover", len(chance), replicates)
        if decided(np.array(chance), strongest, AT_ONCE):
            break
    return np.array(chance)


def best_of(net: FloatArray, n: int) -> NDArray[np.int64]:
    n = min(n, len(net))
    return np.asarray(np.argpartition(-net, n - 1)[:n])


__all__ = ["Discovery", "FoundLaw", "Scored", "discover_laws"]
