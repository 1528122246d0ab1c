"""Contact masks against the reference table, and for patterns the paper does not have."""

from __future__ import annotations

import numpy as np
import pytest

from tribo.records import Pattern
from tribo.springblock.lattice import PAPER_PATTERNS, contact_mask

UM = 1e-6
REFERENCE = {
    "A": ((1, 1), (4, 4), (2, 2), 0.939),
    "B": ((2, 2), (3, 3), (1, 1), 0.566),
    "C": ((3, 3), (4, 4), (1, 1), 0.451),
    "S": ((40, 8), (44, 24), (4, 11), 0.723),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_paper_masks_are_the_reference_masks(name: str):
    """hole = ((i - first) mod pitch) < size on both axes, every other row of S shifted by 22 blocks."""
    (sx, sy), (px, py), (fx, fy), fraction = REFERENCE[name]
    y, x = np.mgrid[:85, :85]
    shift = np.where((y - fy) // py % 2 == 1, 22, 0) if name == "S" else 0
    hole = ((x - fx - shift) % px < sx) & ((y - fy) % py < sy)
    mask = contact_mask(PAPER_PATTERNS[name], (85, 85), 5 * UM)
    assert np.array_equal(mask, ~hole)
    assert mask.mean() == pytest.approx(fraction, abs=5e-4)


def test_flat_touches_everywhere():
    """No cavities, no gaps."""
    assert contact_mask(PAPER_PATTERNS["F"], (7, 5), 5 * UM).shape == (5, 7)
    assert contact_mask(PAPER_PATTERNS["F"], (7, 5), 5 * UM).all()


def test_round_cavities_reach_the_true_area_fraction_on_a_fine_mesh():
    """Refining the mesh takes B from the squares' .56 to the circles' 1 - pi/4 (10/15)^2."""
    mask = contact_mask(PAPER_PATTERNS["B"], (600, 600), 0.25 * UM, (0, 0), "round")
    assert mask.mean() == pytest.approx(PAPER_PATTERNS["B"].area_fraction, abs=0.005)


def test_a_pitch_between_blocks_keeps_the_area_fraction():
    """A 12 um pitch on a 5 um mesh is sampled at the block centres."""
    pattern = Pattern("P", "square", (6 * UM, 6 * UM), (12 * UM, 12 * UM))
    assert contact_mask(pattern, (120, 120), 5 * UM).mean() == pytest.approx(0.75, abs=0.08)


def test_default_position_is_centred():
    """An unknown pattern lies mirror-symmetric in the domain."""
    mask = contact_mask(Pattern("P", "square", (30 * UM, 30 * UM), (50 * UM, 50 * UM)), (84, 84), 5 * UM)
    assert not mask.all()
    assert np.array_equal(mask, mask[::-1, ::-1])
