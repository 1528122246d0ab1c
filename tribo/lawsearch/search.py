"""The search: every law of the grammar scored on a fitted model, against campaigns that the model makes itself."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.special import chdtrc

from tribo.diagnostics.candidates import LIKELY
from tribo.diagnostics.contrasts import allowed_wrong_form, decided, share_beyond
from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.inference import gain_on_groups
from tribo.diagnostics.observations import session_of
from tribo.diagnostics.replicates import as_measured, drawn_residuals, refit
from tribo.lawsearch.free_search import FreeSearch, free_columns, free_scopes
from tribo.lawsearch.grammar import OF_SERIES, TIMES, WrittenLaw
from tribo.lawsearch.model_choice import CLOSE, FoundLaw, choose_form, choose_free
from tribo.lawsearch.scoring import Grammar, Projection
from tribo.records import FloatArray

Progress = Callable[[str, int, int], None]
CAMPAIGNS_AT_ONCE = 20
RESCORED, RESCORED_MEASURED = 60, 400  # best laws at the fitted noise that are scored with each campaign's own noise
NEAR = -1.0  # net log likelihood of a curve or surface from which sets of samples are looked at
SHOWN = 25  # of the best laws, in the table
MOST_LAWS = 3
SEARCHES = 2  # of formulas, and of curves and surfaces: a chance of either counts twice
TAIL_OF_EVIDENCE = 1.0  # scale of the tail of an evidence ln k: its chance is at most 1 / k (Markov's inequality)
BEYOND_DRIFT = 2.0  # standard errors by which a law of time has to predict sessions left out better than drift


@dataclass(frozen=True)
class Discovery:
    """What the search found: laws in the order of their strength, and the best of the table of scores.

    Of each scored law there is the log likelihood that it gains, and what is left of that after paying for the choice.

    ``of_causes`` are the forms that the laws of the causes may have, where these are recorded columns: the law that
    the cause is, and those that explain the campaign about as well, the likeliest first.
    """

    laws: tuple[FoundLaw, ...]
    scored: tuple[tuple[WrittenLaw, float, float], ...]
    searched: int
    of_causes: Mapping[str, tuple[WrittenLaw, ...]] = field(default_factory=dict)


def discover_laws(
    model: ModelFit,
    *,
    level: float = 0.01,
    of_series: float = 1.0,
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
    of_series : float
        Share of the level for a law of the series (run order, pulls of a specimen, time): less than one where days and
        drift are certain, whose shapes are those of the model in part only.
    replicates : int
        Simulated campaigns at most, each searched in the same way.
    rng : numpy Generator, optional
        Of the simulated campaigns and the resamples behind the error of the gain.
    progress : callable, optional
        Called with the stage, the simulated campaigns done and their number.
    without : collection of str
        Columns that have a law already.
    """
    rng = rng or np.random.default_rng(0)
    found: list[FoundLaw] = []
    table: tuple[tuple[WrittenLaw, float, float], ...] = ()
    searched = 0
    model = allowed_wrong_form(model)
    while len(found) < MOST_LAWS:
        used = {*without, *(name for law in found for name in law.law.columns)}
        grammar = Grammar(model, used)
        if not grammar.courses.shapes:
            break
        scored = _scored(model, grammar)
        free = _worth_counting(model, used)
        table, searched = table or tuple(scored[:SHOWN]), searched or grammar.size
        draws = Draws(replicates, rng, progress)
        own_level = of_series * level if set(scored[0][0].columns) & OF_SERIES else level
        formula = partial(_law_of_a_formula, model, grammar, scored[0][0], scored[0][2], own_level, draws)
        ways = [(scored[0][2], formula)]
        if free is not None:
            ways.append((float(free.measured.max()), partial(_law_of_no_formula, model, free, used, level, draws)))
        # the more telling of the two first: a formula of another column may follow a little of what a curve explains
        ways.sort(key=lambda way: -way[0])
        law = next((told for _, way in ways if (told := way()) is not None), None)
        if law is None:
            break
        if set(law.law.columns) <= TIMES and not _predicts_sessions(model, law.model):
            break
        found.append(law)
        model = law.model
    return Discovery(tuple(found), table, searched)


@dataclass(frozen=True)
class Draws:
    """Of campaigns that a model makes itself: how many at most, from what, and whom to tell how many are done."""

    replicates: int
    rng: np.random.Generator
    progress: Progress | None


def _law_of_a_formula(
    model: ModelFit, grammar: Grammar, best: WrittenLaw, strongest: float, level: float, draws: Draws
) -> FoundLaw | None:
    """The law of the best formula where that is beyond chance.

    After Wilks, the chance that a law gains so much if it is the only one tried is less than that of the best of all:
    a law which fails there needs no simulated campaigns.
    """
    if float(chdtrc(1, 2.0 * max(strongest, 0.0))) >= level:
        return None
    p = SEARCHES * share_beyond(_best_by_chance(model, grammar, strongest, draws), strongest)
    return choose_form(model, grammar, best, p, draws.rng) if p < level else None


def _law_of_no_formula(
    model: ModelFit, free: FreeSearch, used: Collection[str], level: float, draws: Draws
) -> FoundLaw | None:
    """The law of the likeliest curve or surface where that is beyond chance, and the fit gains from it: the search
    counts tests that lie far off more than the fit does."""
    likely = float(free.measured.max())
    chance = _by_chance(free.model, partial(_likeliest, free), likely, draws)
    p = SEARCHES * share_beyond(chance, likely, TAIL_OF_EVIDENCE)
    law = choose_free(model, free, used, p, draws.rng) if p < level else None
    return law if law is not None and law.model.score - model.score >= LIKELY else None


def _predicts_sessions(model: ModelFit, with_law: ModelFit) -> bool:
    """Whether a law of time predicts sessions that were left out better than days and drift do; where there are too few
    sessions to tell, it does not."""
    gained, se = gain_on_groups(model, with_law, session_of(with_law.setup.observations.conditions))
    return gained > BEYOND_DRIFT * se


def _scored(model: ModelFit, grammar: Grammar) -> list[tuple[WrittenLaw, float, float]]:
    """The best laws of the campaign, scored with its own noise, the best first."""
    (index,) = grammar.best(Projection(model, model.residual[None]), RESCORED_MEASURED)
    gains = grammar.gains(as_measured(model), index)[0]
    nets = gains - grammar.cost(index)
    each = zip(index, gains, nets, strict=True)
    return sorted(((grammar.law(i), float(g), float(n)) for i, g, n in each), key=lambda scored: -scored[2])


def _worth_counting(model: ModelFit, without: Collection[str]) -> FreeSearch | None:
    """The search for curves and surfaces where one of them is likelier than none by odds of 20 to 1: elsewhere chance
    need not be counted. Sets of samples are looked at where all, or one of them, come near."""
    c = model.setup.observations.conditions
    columns = free_columns(c, without)
    if not columns:
        return None
    for few, least in (((), NEAR), (None, CLOSE)):
        search = FreeSearch(model, *free_scopes(c, few), columns)
        if search.measured.max() < least:
            return None
    return search


def _best_by_chance(model: ModelFit, grammar: Grammar, strongest: float, draws: Draws) -> FloatArray:
    """The best net score in each of the campaigns that the model makes itself, until they decide on ``strongest``.

    All laws are scored at the fitted noise, and the best of them with the noise estimated in each campaign.
    """

    def best(drawn: FloatArray) -> Iterator[float]:
        made = refit(model, drawn)
        for k, index in enumerate(grammar.best(Projection(model, drawn.transpose(0, 2, 1)), RESCORED)):
            yield float((grammar.gains(made.one(k), index)[0] - grammar.cost(index)).max())

    return _by_chance(model, best, strongest, draws)


def _likeliest(free: FreeSearch, drawn: FloatArray) -> FloatArray:
    """The evidence of the likeliest curve or surface in each drawn campaign, each at the noise that it leaves."""
    return np.asarray(free.evidence(drawn.transpose(0, 2, 1)).max(axis=(1, 2)))


def _by_chance(
    model: ModelFit, best: Callable[[FloatArray], Iterable[float]], strongest: float, draws: Draws
) -> FloatArray:
    """The ``best`` of each of the campaigns that the model makes itself, until they decide on ``strongest``."""
    chance: list[float] = []
    while len(chance) < draws.replicates:
        chance += list(best(drawn_residuals(model, draws.rng, CAMPAIGNS_AT_ONCE)))
        if draws.progress is not None:
            draws.progress("discover", len(chance), draws.replicates)
        if decided(np.array(chance), strongest, CAMPAIGNS_AT_ONCE):
            break
    return np.array(chance)
