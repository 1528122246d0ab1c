"""Laws outside the library that the virtual tribometer hides."""

from __future__ import annotations

import numpy as np
import pytest

from .hidden_laws import FORMS, STRENGTH, _strength, hide_law, law_design


@pytest.mark.parametrize("form", FORMS)
def test_a_hidden_law_has_its_strength_and_acts_where_it_says(form: str) -> None:
    hidden = hide_law(41, form)
    assert _strength(hidden.change, hidden.bench, law_design(41)) == pytest.approx(STRENGTH)
    acts = np.abs(hidden.change) > 0
    assert set(hidden.bench.column("sample")[acts.any(axis=1)]) == set(hidden.truth.samples)
    assert tuple(acts.any(axis=0) * 1.0) == hidden.truth.regimes


def test_nothing_but_the_law_differs_from_the_campaign_without_it() -> None:
    law, clean = hide_law(42, "threshold of temperature"), hide_law(42, "")
    assert law.bench.tests.equals(clean.bench.tests)
    np.testing.assert_allclose(law.bench.static, clean.bench.static * np.exp(law.change[:, 0]))


def test_the_same_law_in_another_campaign_has_the_same_place_and_size() -> None:
    first, later = hide_law(43, "threshold of temperature"), hide_law(44, "threshold of temperature", law=43)
    ends = [(h.change[:, 0].min(), h.change[:, 0].max()) for h in (first, later)]
    assert ends[0] == pytest.approx(ends[1])
    warm = np.concatenate([h.bench.column("temperature_C") for h in (first, later)])
    high = np.concatenate([h.change[:, 0] > 0 for h in (first, later)])
    assert np.sum(np.diff(high[np.argsort(warm)])) == 1
