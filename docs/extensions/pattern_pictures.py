"""The picture of every family of patterns in docs/reference/campaigns.md.

    python docs/extensions/pattern_pictures.py docs/figures/patterns.png
"""

from __future__ import annotations

import sys

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tribo.campaign.description import PatternTable
from tribo.springblock.lattice import touching_share

FAMILIES = {
    "circle, square lattice": {"cavity": "circle", "diameter_um": 12, "pitch_um": 20},
    "circle, hexagonal": {"cavity": "circle", "diameter_um": 14, "pitch_um": 20, "lattice": "hexagonal"},
    "pillars, staggered": {
        "cavity": "circle", "diameter_um": 12, "pitch_um": 20, "feature": "pillar", "lattice": "staggered",
    },
    "square": {"cavity": "square", "size_um": 11, "pitch_um": 20},
    "rectangle, staggered": {
        "cavity": "rectangle", "size_um": [30, 8], "pitch_um": [40, 20], "lattice": "staggered",
    },
    "ellipse": {"cavity": "ellipse", "size_um": [25, 10], "pitch_um": [33.3, 20]},
    "ridge": {"cavity": "ridge", "size_um": 8, "pitch_um": 20},
    "chevron": {"cavity": "chevron", "size_um": [9, 12], "pitch_um": [20, 40]},
    "random": {"cavity": "random", "fraction": 0.55, "correlation_um": 8},
}  # fmt: skip


def draw(path: str) -> None:
    figure = Figure(figsize=(6.4, 6.6), layout="constrained")
    FigureCanvasAgg(figure)
    for ax, (name, table) in zip(figure.subplots(3, 3).flat, FAMILIES.items(), strict=True):
        pattern = PatternTable.model_validate(table).pattern(name)
        share = touching_share(pattern, (250, 250), 0.4e-6)
        ax.imshow(share, origin="lower", cmap="gray", vmin=0, vmax=1, extent=(0, 100, 0, 100))
        ax.set_title(f"{name}\nAF {pattern.area_fraction:.3f}", fontsize=8)
        ax.tick_params(labelsize=6)
    figure.supxlabel("x, um (white touches the counterface)", fontsize=8)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    draw(sys.argv[1])
