"""Units become SI once, in one place, and never by a guess."""

from __future__ import annotations

import pytest

from tribo.errors import ReadError
from tribo.units import QUANTITIES, match_quantity, plain_name, unit_factor


@pytest.mark.parametrize(
    ("unit", "quantity", "factor"),
    [
        ("s", "time", 1.0),
        ("sec", "time", 1.0),
        ("ms", "time", 1e-3),
        ("min", "time", 60.0),
        ("N", "friction force", 1.0),
        ("mN", "friction force", 1e-3),
        ("MN", "friction force", 1e6),
        ("kN", "friction force", 1e3),
        ("gf", "friction force", 9.80665e-3),
        ("g", "friction force", 9.80665e-3),
        ("kgf", "normal force", 9.80665),
        ("lbf", "friction force", 4.4482216152605),
        ("mm", "displacement", 1e-3),
        ("µm", "displacement", 1e-6),
        ("um", "displacement", 1e-6),
        ("in", "displacement", 0.0254),
        ("mm/min", "speed", 1e-3 / 60),
        ("%", "humidity", 1.0),
        ("", "friction coefficient", 1.0),
    ],
)
def test_a_unit_has_its_exact_factor(unit: str, quantity: str, factor: float) -> None:
    assert unit_factor(unit, quantity) == (pytest.approx(factor, rel=1e-12), 0.0)


def test_a_temperature_in_kelvin_is_shifted() -> None:
    factor, offset = unit_factor("K", "temperature")
    assert 300.0 * factor + offset == pytest.approx(26.85)


@pytest.mark.parametrize(
    ("unit", "kind"),
    [("", "missing_unit"), ("foo", "unknown_unit"), ("mm", "unknown_unit"), ("V", "unknown_unit")],
)
def test_an_unknown_or_missing_unit_is_an_error(unit: str, kind: str) -> None:
    with pytest.raises(ReadError) as caught:
        unit_factor(unit, "friction force")
    assert [p.kind for p in caught.value.problems] == [kind]


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("Prüfzeit", "time"),
        ("Time (ms)", "time"),
        ("Standardkraft [N]", "friction force"),
        ("Friction Force", "friction force"),
        ("Crosshead ", "displacement"),
        ("Fz", "normal force"),
        ("COF", "friction coefficient"),
        ("Relative humidity", "humidity"),
    ],
)
def test_a_column_name_tells_its_quantity(name: str, quantity: str) -> None:
    found = match_quantity(name)
    assert found is not None
    assert found[0] == quantity


@pytest.mark.parametrize("name", ["Voltage", "Channel 7", "", "Stress", "timer setting"])
def test_other_names_tell_nothing(name: str) -> None:
    assert match_quantity(name) is None


def test_no_alias_means_two_quantities() -> None:
    aliases = [alias for q in QUANTITIES.values() for alias in q.aliases]
    assert len(set(aliases)) == len(aliases)


def test_a_plain_name_has_no_accents_brackets_or_case() -> None:
    assert plain_name(" Prüf-Zeit [s] (raw)") == "pruf zeit"
