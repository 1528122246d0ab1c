"""Suction and an error of the normal load act alike on patterns: the adhesion of the flat sample tells them apart.

Here the errors of the patterns take up nearly all that the calibration leaves of a load.
"""

from __future__ import annotations

import pytest
from laboratories.campaign import make
from laboratories.effects import hide_effect
from laboratories.handed_over import handed_over
from laboratories.laboratory import drawn_laboratory

from tribo.diagnostics import examine
from tribo.diagnostics.candidates import weigh
from tribo.diagnostics.model import candidates
from tribo.diagnostics.score_statistics import start_effects
from tribo.diagnostics.verdict import Verdict

from .known import LAW, acting, baseline, made, setup_of

SIZES = {"normal_load_error": (3295291401, 2.4909), "suction": (2579049999, 0.9601)}  # seed, size


def told(name: str) -> Verdict:
    seed, size = SIZES[name]
    hidden = make(seed, drawn_laboratory(seed), hide=hide_effect(name, size))
    return examine(handed_over(hidden.bench, seed), seed=seed, replicates=(40, 20)).verdict


def test_a_load_error_that_the_design_can_hardly_test_is_named_where_it_acts_and_not_suction_in_its_place() -> None:
    names = {c.mechanism for c in told("normal_load_error").causes}
    assert "normal_load_error" in names
    assert names <= {"normal_load_error", "suction"}


@pytest.mark.slow
def test_suction_is_named_alone_where_a_load_error_would_need_a_negative_adhesion() -> None:
    v = told("suction")
    assert [c.mechanism for c in v.causes] == ["suction"]
    assert "normal_load_error" in {e.mechanism for e in v.not_testable}


@pytest.mark.parametrize(("suction_Pa", "possible"), [(2.5e3, True), (8e3, False)])
def test_a_load_error_is_possible_as_long_as_the_adhesion_that_it_leaves_is_positive(
    suction_Pa: float, possible: bool
) -> None:
    """A load that looks like the suction dp leaves mu dp less of adhesion: static there are 23 kPa, and mu is 4.8."""
    c = made(acting("suction", suction_Pa), seed=4)
    others = {a.name for a in candidates(setup_of(c), LAW)} - {"suction", "normal_load_error"}
    weighed = {x.name for x in weigh(start_effects(baseline(c)), others)}
    assert weighed == ({"suction", "normal_load_error"} if possible else {"suction"})
