"""The form of a law that is beyond chance: all forms at the noise that remains with it, places and widths on a fine
grid, ties, intervals and band.

Causes and laws of the same column: which of them explains a campaign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from tribo.diagnostics.candidates import PER_PARAMETER, refitted
from tribo.diagnostics.contrasts import FORM
from tribo.diagnostics.fit import Linear, ModelFit, fit
from tribo.diagnostics.gain import gain
from tribo.diagnostics.intervals import NORMAL_90, estimates, informed_share
from tribo.diagnostics.model import Acting, Setup, effect_of
from tribo.diagnostics.verdict import Estimate, Gain
from tribo.lawsearch.grammar import (
    LOAD_TERM,
    UNITS,
    Group,
    Shape,
    WrittenLaw,
    column_values,
    corrects_a_pattern,
    fine_products,
    fine_shapes,
    groups_of,
    refined_shapes,
    shapes_of,
)
from tribo.lawsearch.scoring import Acts, Courses, Projection, acts_of, acts_of_one, courses_of, terms_of
from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

CLOSE = 3.0  # log likelihood within which laws cannot be told apart: odds of 20 to 1
IN_REACH = 8.0  # below the best on the coarse grid, within which a form is looked at on the fine one
LOOKED_AT = 40  # forms at most on the fine grid
WEIGHTLESS = 1e-3  # of the likeliest, below which a law does not count in the band
PLACED = ("step", "soft step", "ramp", "optimum", "hump", "window")  # kinds with a place
WIDE = ("hump", "saturating", "soft step", "window")  # kinds with a width
FITTED = 3  # of the best forms, with the weights of the tests and without
ROUNDS = 3  # of finding the best form at the noise that the one before leaves


@dataclass(frozen=True)
class Searched:
    """What a search hands on: all courses and groups, and the p value of the best law."""

    courses: Courses
    groups: tuple[Group, ...]
    p: float = 1.0


@dataclass(frozen=True)
class Band:
    """Change of ln T of every test by a law beyond what flat law and patterns can absorb (:func:`centred`), (n, 2):
    value and 90 % band.

    It is averaged over all laws that the design cannot tell apart from it.
    """

    value: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True)
class FoundLaw:
    """A law beyond chance, fitted, with those the design cannot distinguish from it.

    ``p`` is the chance that the best of all laws gains as much with nothing hidden. ``ties`` are the other forms within
    CLOSE of it, the likeliest first. ``model`` is the fit with all laws so far.
    """

    law: WrittenLaw
    parameters: dict[str, Estimate]
    effect_percent: tuple[float, float, float]
    p: float
    gain: Gain | None
    ties: tuple[WrittenLaw, ...]
    model: ModelFit
    band: Band

    @property
    def n_ties(self) -> int:
        return len(self.ties)


@dataclass(frozen=True)
class Form:
    """One form with its shapes on a fine grid: the log likelihood ``gains`` (k,) of each, and ``evidence``, their mean
    over the grid less what the choice of the form costs."""

    group: Group
    courses: Courses
    gains: FloatArray
    evidence: float

    @property
    def best(self) -> WrittenLaw:
        return self.group.law(self.courses.shapes[int(self.gains.argmax())])

    @property
    def weight(self) -> FloatArray:
        """Of each shape within the form, adding to one."""
        weight = np.exp(self.gains - self.gains.max())
        return np.asarray(weight / weight.sum())


def settled(model: ModelFit, found: Searched, first: WrittenLaw, rng: np.random.Generator) -> FoundLaw:
    """The best form at the noise that it leaves, with its parameters, ties and band; ``first`` is the best law at the
    noise without any."""
    best = _decided(model, found, first)
    after, state, form = best.after, best.state, best.forms[0]
    parameters = estimates(after, len(after.acting) - 1) | _places(form)
    wider = _wider(state, form, parameters["a"])
    return FoundLaw(
        form.best, parameters, _percent(state, form, parameters, wider), found.p, gain(model, after, rng),
        tuple(f.best for f in best.forms[1:] if f.evidence > form.evidence - CLOSE), after,
        _band(state, best.forms, wider),
    )  # fmt: skip


def forms_in_reach(model: ModelFit, found: Searched) -> tuple[list[Form], State]:
    """The forms of these laws at the noise that the best of them leaves, the best first, and the campaign at that
    noise."""
    projected = Projection(model.linear, model.linear.residual[None])
    gains = projected.gains(found.courses, acts_of(found.groups, model.setup, terms_of(model)))[0]
    net = gains - np.array([g.cost for g in found.groups])[:, None]
    net[corrects_a_pattern(found.groups, found.courses.shapes)] = -np.inf
    group, shape = np.unravel_index(int(np.argmax(net)), net.shape)
    first = found.groups[int(group)].law(found.courses.shapes[int(shape)])
    best = _decided(model, found, first)
    return best.forms, best.state


@dataclass(frozen=True)
class _Decided:
    """The model with a law, the campaign at its noise, and the forms in reach there, that of the law first."""

    after: ModelFit
    state: State
    forms: list[Form]


def _decided(model: ModelFit, found: Searched, law: WrittenLaw) -> _Decided:
    """The form with the best likelihood when fitted in full, less what its choice costs.

    The weights of the tests follow the law with which they were estimated: where it is wrong they are small. So the
    forms to be fitted are the best with these weights and the best with none.
    """
    after, state = _with_law(model, law)
    fitted: dict[object, tuple[float, ModelFit, State]] = {}
    for _ in range(ROUNDS):
        for form in (*_forms(state, found)[:FITTED], *_forms(state.unweighted, found)[:FITTED]):
            if form.best.form not in fitted:
                again, there = _with_law(model, form.best)
                fitted[form.best.form] = again.score - (form.gains.max() - form.evidence), again, there
        best = max(fitted, key=lambda key: fitted[key][0])
        if fitted[best][2] is state:
            break
        _, after, state = fitted[best]
    forms = _forms(state, found)
    shift = {f.best.form: fitted[f.best.form][0] - fitted[best][0] for f in forms if f.best.form in fitted}
    own = next((f for f in forms if f.best.form == best), None)
    if own is None:
        return _Decided(after, state, forms)
    judged = [replace(f, evidence=own.evidence + shift[f.best.form]) if f.best.form in shift else f for f in forms]
    ranked = sorted(judged, key=lambda f: (f.best.form != best, -f.evidence))
    if own.best != state.law:
        after, state = _with_law(model, own.best)
    return _Decided(after, state, ranked)


@dataclass(frozen=True)
class State:
    """A campaign at the noise that a ``law`` leaves, ready to score other laws in its place; ``linear`` is the model
    without it, ``residual`` (n, 2) what that leaves."""

    law: WrittenLaw
    setup: Setup
    terms: dict[str, FloatArray]
    linear: Linear
    residual: FloatArray
    informed: float

    @cached_property
    def projected(self) -> Projection:
        return Projection(self.linear, self.residual[None])

    @property
    def unweighted(self) -> State:
        """The same with every test counting alike."""
        return replace(self, linear=replace(self.linear, weight=np.ones(len(self.residual))))

    @property
    def conditions(self) -> Conditions:
        return self.setup.observations.conditions

    def acts(self, *groups: Group) -> Acts:
        return acts_of(groups, self.setup, self.terms)


def _with_law(model: ModelFit, law: WrittenLaw) -> tuple[ModelFit, State]:
    """The model with a law fitted, and the same campaign without it at the noise of that fit."""
    acting = Acting(law.mechanism())
    after = fit(model.setup, (*model.acting, acting), start=model)
    residual = after.residual + effect_of(after.setup, after.law, acting, after.values[-1])
    jacobian = after.linear.jacobian[:, :, : -len(acting.mechanism.parameters)]
    linear = replace(after.linear, jacobian=jacobian)
    return after, State(law, after.setup, terms_of(after), linear, residual, informed_share(after.noise))


def _forms(state: State, found: Searched) -> list[Form]:
    """The forms in reach of the best on the fine grid, the best first."""
    order, begins, count = found.courses.by_form
    gains = state.projected.gains(found.courses, state.acts(*found.groups))[0, :, order].T
    costs = np.array([group.cost for group in found.groups])[:, None]
    worth = np.maximum.reduceat(gains, begins, axis=1) - costs - np.log(count)
    worth[corrects_a_pattern(found.groups, [found.courses.shapes[k] for k in order[begins]])] = -np.inf
    worth = worth.ravel()
    ranked = np.argsort(-worth, kind="stable")[:LOOKED_AT]
    forms = []
    for g, f in zip(*np.divmod(ranked[worth[ranked] > worth[ranked[0]] - IN_REACH], len(count)), strict=True):
        leading = begins[f] + int(gains[g, begins[f] : begins[f] + count[f]].argmax())
        forms.append(_on_fine_grid(state, found.groups[g], *_priced(found, int(order[leading]))))
    return sorted(forms, key=lambda f: -f.evidence)


def _priced(found: Searched, leading: int) -> tuple[tuple[Shape, ...], float]:
    """The leading shapes of a form, with what a product of two columns costs."""
    shapes = found.courses.shapes[leading]
    return shapes, float(found.courses.cost[leading]) if len(shapes) > 1 else 0.0


def _on_fine_grid(state: State, group: Group, shapes: tuple[Shape, ...], cost: float) -> Form:
    c, acts = state.conditions, state.acts(group)
    grid = fine_products(shapes) if len(shapes) > 1 else [(s,) for s in fine_shapes(shapes[0], c)]
    courses = courses_of([(s, 0.0) for s in grid], c)
    gains = state.projected.gains(courses, acts)[0, 0]
    evidence = _log_mean(gains) - group.cost - cost - PER_PARAMETER * sum(map(_further, courses.shapes[0]))
    finer = refined_shapes(courses.shapes[int(gains.argmax())][0], c) if len(shapes) == 1 else []
    if finer:
        courses = courses_of([((s,), 0.0) for s in finer], c)
        gains = state.projected.gains(courses, acts)[0, 0]
    return Form(group, courses, gains, evidence)


def _further(s: Shape) -> int:
    """Numbers of a shape besides its amplitude."""
    return (s.kind in PLACED) + (s.kind in WIDE) + (s.kind == "wave")


def _log_mean(gains: FloatArray) -> float:
    return float(gains.max() + np.log(np.mean(np.exp(gains - gains.max()))))


def _places(form: Form) -> dict[str, Estimate]:
    """Place and width of the shape that stands alone, with 90 % intervals over the grid."""
    if len(form.courses.shapes[0]) > 1:
        return {}
    shapes = [s[0] for s in form.courses.shapes]
    best, found = form.best.shapes[0], {}
    for name, kinds in (("place", PLACED), ("width", WIDE)):
        if best.kind in kinds:
            values = np.array([getattr(s, name) for s in shapes])
            low, high = _quantiles(values, form.weight)
            value = float(getattr(best, name))
            found[name] = Estimate(value, min(low, value), max(high, value), UNITS.get(best.column, ""))
    return found


def _quantiles(values: FloatArray, weight: FloatArray) -> tuple[float, float]:
    order = np.argsort(values)
    share = np.cumsum(weight[order]) - 0.5 * weight[order]
    low, high = np.interp((0.05, 0.95), share, values[order])
    return float(low), float(high)


def _wider(state: State, form: Form, a: Estimate) -> float:
    """The interval of the amplitude over that of the linear model: what the latter does not know."""
    if form.best.shapes[0].kind == "wave":
        return 1.0
    one = courses_of([(form.best.shapes, 0.0)], state.conditions)
    own = state.projected.products(one.first, state.acts(form.group))[0]
    return max((a.high - a.low) / (2.0 * NORMAL_90) * float(np.sqrt(own[0, 0] * state.informed)), 1.0)


@dataclass(frozen=True)
class _Amplitudes:
    """The amplitudes of every shape of a form with their variances, (k,) each; of a wave those of its first column and,
    (k,) each, of its second."""

    value: FloatArray
    variance: FloatArray
    second: FloatArray
    second_variance: FloatArray


def _amplitudes(state: State, form: Form) -> _Amplitudes:
    (own,), ((pull,),) = state.projected.products(form.courses.first, state.acts(form.group))
    nothing = np.zeros(len(own))
    found = _Amplitudes(pull / own, 1.0 / (own * state.informed), nothing, nothing)
    if not len(form.courses.two):
        return found
    (own2,), ((pull2,),) = state.projected.products(form.courses.second, state.acts(form.group))
    return replace(found, second=pull2 / own2, second_variance=1.0 / (own2 * state.informed))


def _percent(
    state: State, form: Form, parameters: dict[str, Estimate], wider: float
) -> tuple[float, float, float]:
    """Change of T (or of the term) from the least to the most of the shape where the law acts fully; 90 % interval.

    The interval is averaged over places and widths.
    """
    law = form.best
    here = law.weight(state.conditions) != 0
    full = float(np.abs(law.weight(state.conditions)).max())
    each = _amplitudes(state, form)
    if len(form.courses.two):
        size = 2.0 * np.hypot(each.value, each.second)
        sd = 2.0 * np.sqrt(0.5 * (each.variance + each.second_variance))
        value = 2.0 * float(np.hypot(parameters["a"].value, parameters["b"].value))
    else:
        reach = full * np.ptp(form.courses.first[here], axis=0)
        size, sd = each.value * reach, np.sqrt(each.variance) * reach
        value = parameters["a"].value * full * float(np.ptp(law.course(state.conditions)[here]))
    centre = float(form.weight @ size)
    half = NORMAL_90 * float(np.sqrt(form.weight @ ((wider * sd) ** 2 + (size - centre) ** 2)))
    low, value, high = (100.0 * float(np.expm1(x)) for x in (value - half, value, value + half))
    return value, low, high


def _band(state: State, forms: list[Form], wider: float) -> Band:
    """The mean change by all laws in proportion to their likelihood, with its spread.

    A law may be wrong in form by the same share of its own effect as a mechanism.
    """
    n = len(state.conditions.sample)
    mean, square, total = np.zeros((n, 2)), np.zeros((n, 2)), 0.0
    for form in forms:
        if form.evidence < forms[0].evidence + np.log(WEIGHTLESS):
            continue
        share = float(np.exp(form.evidence - forms[0].evidence))
        acts, each = acts_of_one(form.group, state.conditions, state.terms), _amplitudes(state, form)
        two = {int(k): j for j, k in enumerate(form.courses.two)}
        for k in np.flatnonzero(form.weight > WEIGHTLESS * form.weight.max()):
            parts = [(form.courses.first[:, k], each.value[k], each.variance[k])]
            if k in two:
                j = two[int(k)]
                parts.append((form.courses.second[:, j], each.second[j], each.second_variance[j]))
            load_share = state.terms[LOAD_TERM]
            changes = [(centred(course[:, None] * acts, state.conditions, load_share), a, v) for course, a, v in parts]
            whole = np.sum([a * g for g, a, _ in changes], axis=0)
            weight = share * form.weight[k]
            mean += weight * whole
            square += weight * (whole**2 + wider**2 * np.sum([v * g**2 for g, _, v in changes], axis=0))
            total += weight
    mean, square = mean / total, square / total
    wrong = FORM * np.sqrt(np.mean(mean[mean != 0] ** 2)) * (mean != 0)  # the form is none of the grammar exactly
    half = NORMAL_90 * np.sqrt(np.maximum(square - mean**2, 0.0) + wrong**2)
    return Band(mean, mean - half, mean + half)


def centred(change: FloatArray, c: Conditions, load_share: FloatArray) -> FloatArray:
    """A change (n, 2) less what the flat law and the pattern of each sample can absorb of it: a level, a slope in ln p,
    and a multiple of the ``load_share`` (n, 2) of T."""
    found, log_p = change.copy(), np.log(c.pressure_Pa)
    for name in np.unique(c.sample):
        here = c.sample == name
        for k in (0, 1):
            own = np.column_stack([np.ones(here.sum()), log_p[here] - log_p[here].mean(), load_share[here, k]])
            found[here, k] -= own @ np.linalg.lstsq(own, change[here, k], rcond=None)[0]
    return found


# Log likelihood by which a law has to be better than mechanisms of the library. A law of their own columns (True) says
# the same with another formula, and needs odds of 400 to 1: where the humidity acts exponentially, the best law is
# better than the straight line of the library by 0.6 to 3 in three campaigns of five, by 10 and 15 in two. A law of
# another column of the series or of a product says something else, and needs odds of 20 to 1: where velocity, ageing,
# run-in or temperature are at work, no law is better by more than 0.1 (25 campaigns, benchmarks/blind_cases.py, seed
# 7100); where a start of the series is taken for run-in, one is by 2 to 7 in eight of nine (tests/blind/hidden_laws.py,
# seed 4001).
MARGIN = {True: 2.0 * CLOSE, False: CLOSE}
# A covariate is a law of the grammar itself, on all samples and in both regimes. It stays where another law of its own
# column cannot be told from it; between its column and another one of the series, the likelier counts.
MARGIN_OF_COVARIATE = {True: CLOSE, False: 0.0}
SAME = {"speed_mm_s": "speed_m_s", "started_at": "elapsed_s"}  # columns of mechanisms by their names in the grammar
SERIES = {"run_order", "specimen_run", "elapsed_s", "date"}  # columns that follow each other through a series


@dataclass(frozen=True)
class CauseForms:
    """A recorded column as a ``cause``, written as the law that it is, and the other forms of a law of that column that
    explain the campaign about as well, the likeliest first."""

    cause: str
    law: WrittenLaw
    ties: tuple[WrittenLaw, ...]


@dataclass(frozen=True)
class Contested:
    """The ``model`` with the causes that stand against the laws of their columns, by how much the others ``lost``, and
    the ``forms`` of the recorded columns among those that stand."""

    model: ModelFit
    lost: dict[str, float]
    forms: tuple[CauseForms, ...]


def without_wrong_forms(model: ModelFit) -> Contested:
    """The model without the mechanisms that lose against a law of their own column, or two of them against a product
    of their columns."""
    lost: dict[str, float] = {}
    forms: dict[str, CauseForms] = {}
    for together in (*((a,) for a in model.acting), *combinations(model.acting, 2)):
        if not all(a in model.acting for a in together):
            continue
        laws = _best_laws(model, together)
        if laws is None:
            continue
        if laws.by > (MARGIN_OF_COVARIATE if _recorded(together) else MARGIN)[laws.own_column]:
            lost |= {a.name: laws.by for a in together}
            model = refitted(model, [a for a in model.acting if a not in together])
        elif len(together) == 1 and _recorded(together):
            law = _as_law(together[0], model.setup.observations.conditions)
            others = tuple(tie for tie in laws.ties if tie.form != law.form and set(tie.columns) == set(law.columns))
            forms[together[0].name] = CauseForms(together[0].name, law, others)
    standing = {a.name for a in model.acting}
    return Contested(model, lost, tuple(f for f in forms.values() if f.cause in standing))


def _recorded(together: Sequence[Acting]) -> bool:
    return all(a.mechanism.any_column for a in together)


@dataclass(frozen=True)
class _BestLaws:
    """The laws of the columns of one or two mechanisms: ``by`` how much log likelihood the best is better than the
    mechanisms, whether it follows their ``own_column``, and the forms within CLOSE of the mechanisms or better."""

    by: float
    own_column: bool
    ties: tuple[WrittenLaw, ...]


def _best_laws(model: ModelFit, together: Sequence[Acting]) -> _BestLaws | None:
    """The laws in the place of one or two mechanisms; None where their columns have none.

    Both are judged at the noise that the law leaves. The law pays for its choices among those of these columns, the
    mechanisms do not.
    """
    columns = set().union(*(_followed(a) for a in together))
    c = model.setup.observations.conditions
    shapes = _of_columns(c, columns) if len(columns) == len(together) else []
    if not shapes:
        return None
    changes = [effect_of(model.setup, model.law, a, model.values[model.acting.index(a)]) for a in together]
    without = refitted(model, [a for a in model.acting if a not in together])
    forms, state = forms_in_reach(without, Searched(courses_of(shapes, c), tuple(groups_of(c))))
    gained = state.projected.joint_gain(np.stack(changes, axis=2))
    ties = tuple(form.best for form in forms if form.evidence > gained - CLOSE)
    return _BestLaws(forms[0].evidence - gained, set(forms[0].best.columns) <= columns, ties)


def _as_law(a: Acting, c: Conditions) -> WrittenLaw:
    """A recorded column as a law of the grammar: a line of its numbers, or one of its names."""
    (column,) = _followed(a)
    numbers = column_values(c, column)
    if np.isfinite(numbers).any():
        return WrittenLaw((Shape("linear", column, float(np.nanmin(numbers)), float(np.nanmax(numbers))),))
    level = a.mechanism.choosing.level(a.choice) or str(np.unique(c.columns[column])[-1])
    return WrittenLaw((Shape("level", column, level=level),))


def _followed(a: Acting) -> set[str]:
    """What a mechanism follows, by its name in the grammar."""
    name = a.mechanism.column(a.choice)
    return {SAME.get(name, name)}


def without_rivals(model: ModelFit, law: WrittenLaw) -> tuple[ModelFit, dict[str, float]]:
    """The model without the mechanisms of the columns of a law of another campaign, and the log likelihood by which the
    law in their place is better.

    They stay where they are clearly better: what this campaign cannot tell apart, the other one has told.
    """
    columns = set(law.columns) | (SERIES if set(law.columns) & SERIES else set())
    rivals = [a for a in model.acting if _followed(a) & columns]
    if not rivals:
        return model, {}
    without = refitted(model, [a for a in model.acting if a not in rivals])
    instead = refitted(without, [*without.acting, Acting(law.mechanism())])
    by = instead.score - model.score
    return (without, {a.name: by for a in rivals}) if by > -CLOSE else (model, {})


def _of_columns(c: Conditions, columns: set[str]) -> list[tuple[tuple[Shape, ...], float]]:
    """The shapes of one column and its products, or the products of two; a product costs what choosing among these is
    worth."""
    alike = SERIES if len(columns) == 1 and columns <= SERIES else columns
    every = [(shape, cost) for shape, cost in shapes_of(c) if _follows(shape, columns, alike)]
    products = sum(len(shape) > 1 for shape, _ in every)
    return [(shape, float(np.log(products)) if len(shape) > 1 else cost) for shape, cost in every]


def _follows(shape: tuple[Shape, ...], columns: set[str], alike: set[str]) -> bool:
    """Whether a shape follows all these columns, or alone one that is alike."""
    own = {s.column for s in shape}
    return columns <= own or (len(own) == 1 and own <= alike)
