"""The free lengths of a family: points in a unit cube, patterns on the grid of the mask, and what can be made."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from tribo.campaign.geometry import Making, faults_of_making, smallest_feature_m, smallest_wall_m
from tribo.design.target import Family
from tribo.records import FloatArray, Pattern

_UM = 1e-6
MOST_ASPECT = 60.0


@dataclass(frozen=True)
class Space:
    """One family; its free lengths and their bounds in um."""

    family: Family
    number: int

    @property
    def free(self) -> dict[str, tuple[float, float]]:
        spans = {name: getattr(self.family, name) for name in self.family.lengths}
        return {name: (s[0], s[1]) for name, s in spans.items() if isinstance(s, list)}

    @property
    def making(self) -> Making:
        f = self.family
        return Making(f.smallest_feature_um * _UM, f.smallest_wall_um * _UM, f.mask_grid_um * _UM)

    def lengths_um(self, x: FloatArray) -> dict[str, float]:
        """All lengths at a point of the cube, free ones on the grid of the mask."""
        grid = self.family.mask_grid_um
        found = {name: getattr(self.family, name) for name in self.family.lengths}
        for share, (name, (low, high)) in zip(x, self.free.items(), strict=True):
            steps = round((low + float(share) * (high - low)) / grid)
            found[name] = min(max(steps, math.ceil(low / grid - 1e-9)), math.floor(high / grid + 1e-9)) * grid
        return found

    def pattern(self, lengths_um: dict[str, float], name: str = "P") -> Pattern:
        """The pattern with these lengths."""
        f, um = self.family, {k: v * _UM for k, v in lengths_um.items()}
        a = um.get("diameter_um", um.get("size_x_um", 0.0))
        px = um.get("pitch_um", um.get("pitch_x_um", 0.0))
        py = px * 3**0.5 / 2 if f.lattice == "hexagonal" else um.get("pitch_y_um", px)
        hexagonal = "hexagonal" if f.lattice == "hexagonal" else "rows"
        size, staggered = (a, um.get("size_y_um", a)), f.lattice != "square"
        return Pattern(name, f.cavity, size, (px, py), staggered, None, f.feature, hexagonal)

    def fault(self, lengths_um: dict[str, float]) -> str:
        """Why these lengths cannot be made; empty where they can."""
        return next(faults_of_making(self.pattern(lengths_um), self.making), "")

    def at(self, lengths_um: dict[str, float]) -> FloatArray:
        """The point of the cube of these lengths, and their area fraction: the inputs of a surrogate."""
        shares = [(lengths_um[name] - low) / (high - low) for name, (low, high) in self.free.items()]
        return np.array([*shares, self.pattern(lengths_um).area_fraction])

    def candidates(self, n: int, seed: int) -> list[dict[str, float]]:
        """Up to n different patterns that can be made, spread evenly."""
        if not self.free:
            fixed = self.lengths_um(np.zeros(0))
            return [] if self.fault(fixed) else [fixed]
        points = qmc.Sobol(len(self.free), seed=seed).random_base2(max(3, math.ceil(math.log2(2 * n))))
        found: dict[tuple[float, ...], dict[str, float]] = {}
        for x in points:
            lengths = self.lengths_um(x)
            if len(found) < n and not self.fault(lengths):
                found.setdefault(tuple(lengths.values()), lengths)
        return list(found.values())

    def limits_at(self, lengths_um: dict[str, float]) -> list[str]:
        """Bounds and limits of making that lie within a grid step of these lengths."""
        grid, f, pattern = self.family.mask_grid_um, self.family, self.pattern(lengths_um)
        found = [
            f"{name} = {value:g} um is its {what} bound"
            for name, (low, high) in self.free.items()
            for value in [lengths_um[name]]
            for what, bound in (("lower", low), ("upper", high))
            if abs(value - bound) < 1.01 * grid
        ]
        if smallest_wall_m(pattern) / _UM - f.smallest_wall_um < 2.01 * grid:
            found.append(f"the smallest wall that can be made is {f.smallest_wall_um:g} um")
        if smallest_feature_m(pattern) / _UM - f.smallest_feature_um < 1.01 * grid:
            found.append(f"the smallest feature that can be made is {f.smallest_feature_um:g} um")
        return found
