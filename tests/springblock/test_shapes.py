"""Patterns beyond those of the paper: the shares that touch, what cannot be made, and their way to a simulation."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tribo.campaign.description import PatternTable
from tribo.campaign.geometry import black_and_white, picture_text
from tribo.errors import SimulationError
from tribo.records import Pattern, picture_mask
from tribo.springblock import SimConfig, simulate
from tribo.springblock.config import mask_of
from tribo.springblock.design_file import runs_of_design
from tribo.springblock.engines.state import lattice_of, thresholds_of
from tribo.springblock.lattice import touching_share

UM = 1e-6
FAMILIES = {
    "hexagonal holes": {"cavity": "circle", "diameter_um": 13.0, "pitch_um": 20.0, "lattice": "hexagonal"},
    "pillars": {"cavity": "circle", "diameter_um": 13.0, "pitch_um": 20.0, "feature": "pillar"},
    "staggered ellipses": {
        "cavity": "ellipse", "size_um": [25.0, 9.0], "pitch_um": [40.0, 20.0], "lattice": "staggered",
    },
    "square pillars": {"cavity": "square", "size_um": 11.0, "pitch_um": 20.0, "feature": "pillar"},
    "rectangular pillars": {
        "cavity": "rectangle", "size_um": [23.0, 7.0], "pitch_um": [40.0, 20.0], "feature": "pillar",
    },
    "ridges": {"cavity": "ridge", "size_um": 7.0, "pitch_um": 20.0},
    "chevrons": {"cavity": "chevron", "size_um": [8.0, 10.0], "pitch_um": [20.0, 40.0]},
    "random": {"cavity": "random", "fraction": 0.62, "correlation_um": 10.0 / 3.0},
}  # fmt: skip


def pattern_of(name: str) -> Pattern:
    return PatternTable.model_validate(FAMILIES[name]).pattern(name)


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("spacing_um", [5.0, 2.5])
def test_area_fraction_is_that_of_the_mask(name: str, spacing_um: float):
    """Over whole repeats, to 0.1 %, with blocks of 5 and of 2.5 um."""
    pattern = pattern_of(name)
    assert pattern.pitch_m is not None
    rows = 2 if pattern.staggered else 1
    # blocks of a fraction of the repeat: for a hexagonal lattice no whole number of blocks fits along y
    nx = round(pattern.pitch_m[0] / (spacing_um * UM))
    ny = rows * pattern.pitch_m[1] / (spacing_um * UM)
    repeats = 1 if abs(ny - round(ny)) < 1e-6 else 41  # 41 x 34.641 um is within 0.05 % of whole blocks
    share = touching_share(pattern, (nx, round(repeats * ny)), spacing_um * UM, (0, 0))
    assert share.mean() == pytest.approx(pattern.area_fraction, rel=1e-3)


@pytest.mark.parametrize("name", FAMILIES)
def test_every_family_comes_from_a_design_to_its_friction(name: str):
    """And the thresholds of its blocks add up to those of the area that touches."""
    table = {
        "samples": ["G"], "pressures_kPa": [10.0], "repeats": 1, "patterns": {"G": FAMILIES[name]},
        "parameters": {"blocks": [[16, 16]], "duration_peaks": 1.3, "dt_s": 1e-7},
    }  # fmt: skip
    (config,) = runs_of_design(table)
    run = simulate(config)
    assert run.static_friction > run.sliding_friction * 0.8
    lattice = lattice_of(config)
    even = config.with_(friction=type(config.friction)(mu_s_sd=0.0))
    total = thresholds_of(even, lattice).static_N.sum()
    expected = 5.5 * config.normal_load_N + 23.45e3 * 256 * 25e-12 * lattice.area_fraction
    assert total == pytest.approx(expected, rel=1e-9)


def test_walls_narrower_than_the_blocks_keep_their_share_or_are_refused():
    """Walls of 3 um between squares on blocks of 5 um: the share of the shape where it is exact, else a sentence."""
    pattern = Pattern("P", "square", (12 * UM, 12 * UM), (15 * UM, 15 * UM))
    config = SimConfig(sample="P", pattern=pattern, blocks=(24, 24))
    with pytest.raises(SimulationError, match="no block touches"):
        simulate(config)
    exact = mask_of(config.with_(cavity_shape="exact"))
    assert float(exact.mean()) == pytest.approx(1 - (12 / 15) ** 2, rel=0.05)


def test_paper_patterns_keep_their_blocks():
    """Squares for circles by default; exact circles on request, with the area of circles."""
    config = SimConfig(sample="B", blocks=(84, 84))
    assert mask_of(config).dtype == bool
    exact = mask_of(config.with_(cavity_shape="exact", pattern_first=(0, 0)))
    assert exact.mean() == pytest.approx(1 - math.pi / 4 * 100 / 225, rel=1e-3)


def test_a_picture_is_its_mask_on_any_mesh(tmp_path: Path):
    """PNG and NPY of the same mask, white touches; the share of each block is the mean of its pixels."""
    from matplotlib.image import imsave

    mask = np.random.default_rng(1).random((30, 40)) < 0.6
    imsave(tmp_path / "m.png", np.flipud(mask), cmap="gray", vmin=0, vmax=1)
    np.save(tmp_path / "m.npy", mask)
    for name in ("m.png", "m.npy"):
        table = PatternTable.model_validate({"cavity": "mask", "mask": name, "um_per_pixel": 2.0})
        pattern = table.pattern("M", tmp_path)
        assert (picture_mask(pattern.picture or "") == mask).all()
        assert pattern.area_fraction == mask.mean()
        share = touching_share(pattern, (8, 6), 10 * UM, (0, 0))
        assert share == pytest.approx(mask.reshape(6, 5, 8, 5).mean(axis=(1, 3)), abs=2e-3)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (np.array([[0, 255], [128, 255]]), r"pixel x = 0, y = 1 has 128.*25 % of the pixels are grey"),
        (np.zeros((4, 4)), "nothing touches"),
        (np.ones((1, 1025)), "1025 x 1"),
        (np.ones((3, 3, 3)), "3 x 3 x 3"),
    ],
)
def test_a_picture_that_is_no_mask_is_refused_with_the_place(values: np.ndarray, said: str):
    """Grey, empty, too large, in colour."""
    with pytest.raises(ValueError, match=said):
        black_and_white(values, "m.png")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"diameter_um": 20.0}, "touches the next one"),
        ({"smallest_wall_um": 8.0}, "wall between two neighbours is 7 um; the smallest that can be made is 8 um"),
        ({"smallest_feature_um": 14.0}, "cavity is 13 um wide; the smallest that can be made is 14 um"),
        ({"mask_grid_um": 2.0}, "size along x is 13 um, off the grid of 2 um"),
    ],
)
def test_what_cannot_be_made_is_refused_with_the_limit(change: dict[str, float], said: str):
    """Touching cavities, thin walls, small features, lengths off the grid of the mask."""
    with pytest.raises(ValueError, match=said):
        PatternTable.model_validate(FAMILIES["hexagonal holes"] | change)
    design = {"samples": ["G"], "pressures_kPa": [10.0], "patterns": {"G": FAMILIES["hexagonal holes"] | change}}
    with pytest.raises(SimulationError, match=said):
        runs_of_design(design)


def test_a_thin_place_of_a_picture_is_named(tmp_path: Path):
    """A wall one pixel wide at x = 12 um."""
    mask = np.ones((20, 20), bool)
    mask[:, 2:6] = mask[:, 7:11] = False
    np.save(tmp_path / "m.npy", mask)
    table = {"cavity": "mask", "mask": "m.npy", "um_per_pixel": 2.0, "smallest_wall_um": 4.0}
    with pytest.raises(ValueError, match=r"a wall at x = 12 um, y = 0 um is thinner than 4 um"):
        PatternTable.model_validate(table).pattern("M", tmp_path)
    assert picture_text(mask).startswith("20x20:")
