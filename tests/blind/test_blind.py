"""Campaigns with something hidden in them: the code under test sees only the files.

The quick share of what ``benchmarks/blind.py`` runs in full, with seeds of its own. The generator shares no code and
no number with the library (``test_effects.py``).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from support import first_quick

from tribo.campaign import load_campaign
from tribo.diagnostics import examine
from tribo.diagnostics.verdict import Verdict
from tribo.stages import ingest
from tribo.wording.verdict_sentences import worded

from .tribometer import LARGEST, Design, hide, write

QUICK = Design(samples=("F", "A", "B", "C"), masses_g=(5.0, 25.0, 90.0, 138.5))
LOADS = Design(samples=("F", "A", "B", "C"))  # more loads separate lost contact from a power of p
LADDER = Design(samples=("F", "B", "C"), masses_g=(12.0, 50.0, 138.5), speeds_mm_s=(0.05, 0.2, 0.8))
OF_TWO = replace(LADDER, samples=("F", "B"))
ALL = Design(masses_g=(5.0, 25.0, 90.0, 138.5))


def verdict_on(folder: Path, seed: int, *effects: tuple[str, float], design: Design = QUICK) -> Verdict:
    campaign = load_campaign(write(hide(seed, list(effects), design), folder / "campaign", seed))
    return examine(ingest(campaign), seed=seed, replicates=(50, 30)).verdict


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "design"), [(201, QUICK), (202, ALL)])
def test_a_campaign_without_an_effect_is_said_to_have_none(tmp_path: Path, seed: int, design: Design) -> None:
    v = verdict_on(tmp_path, seed, design=design)
    assert v.verdict == "no_misfit"
    assert v.causes == ()
    assert "would have shown" in worded(v).text
    assert 0 < v.smallest_effects["run_in"] < 40


@pytest.mark.parametrize(
    ("effect", "design"),
    first_quick(
        [("velocity_dependence", OF_TWO), ("run_in", QUICK), ("contact_area_loss", LOADS),
         ("velocity_dependence", LADDER), ("load_cell_offset", QUICK)]
    ),
)
def test_a_clear_effect_is_named(tmp_path: Path, effect: str, design: Design) -> None:
    v = verdict_on(tmp_path, 211, (effect, min(1.5, LARGEST.get(effect, 1.5))), design=design)
    assert v.verdict == "named"
    assert [c.mechanism for c in v.causes] == [effect]


@pytest.mark.slow
def test_a_tied_pair_is_named_as_a_pair_with_a_test_that_parts_it(tmp_path: Path) -> None:
    v = verdict_on(tmp_path, 221, ("suction", 1.0))
    assert v.verdict == "named"
    assert {c.mechanism for c in v.causes} == {"suction", "normal_load_error"}
    assert v.next_test is not None
    assert v.next_test.expected_bits > 0.5


@pytest.mark.slow
def test_an_effect_outside_the_library_is_unknown_with_the_column_it_follows(tmp_path: Path) -> None:
    v = verdict_on(tmp_path, 231, ("outside:day", 1.5), design=Design(samples=("F", "B"), repeats=3))
    assert v.verdict == "unknown"
    assert v.causes == ()
    assert v.misfits[0].covariate == "time of day"
