"""The published tables bundled with tribo, and those its simulator made beside them, in the units of their source."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tribo.files import PATTERN_SHARES, data_dir

if TYPE_CHECKING:
    import pandas as pd

BERARDO2019 = "berardo2019"


def load_table1() -> pd.DataFrame:
    """Table 1 of Berardo et al. (2019): the patterns.

    Returns
    -------
    DataFrame
        One row per sample: sample, cavity (none, circle, rectangle), size_x_um, size_y_um (the diameter twice for a
        circle), pitch_x_um, pitch_y_um (lengths in um), area_fraction_printed, area_fraction_computed (from the sizes
        printed beside it), area_fraction_model (of the paper's 85 x 85 blocks). NaN where a flat sample has no value.

    Examples
    --------
    >>> patterns = tribo.load_table1().set_index("sample")
    >>> float(patterns.loc["C", "size_x_um"]), round(float(patterns.loc["C", "area_fraction_computed"]), 3)
    (15.0, 0.558)
    """
    return _read("table1.csv")


def load_table2() -> pd.DataFrame:
    """Table 2 of Berardo et al. (2019) in long form.

    Returns
    -------
    DataFrame
        One row per sample, regime and source: sample, regime (static, sliding), source (experiment, simulation), mu,
        mu_sd (no unit), tau0_kPa, tau0_sd_kPa (kPa). The standard deviations are as printed; the covariance of mu and
        tau0 is not published.

    Examples
    --------
    >>> table = tribo.load_table2()
    >>> len(table), float(table.query("sample == 'F' and regime == 'static' and source == 'experiment'")["mu"].iloc[0])
    (24, 4.76)
    """
    return _read("table2.csv")


def load_table2_simulated_anew() -> pd.DataFrame:
    """The simulated part of Table 2 recomputed with tribo, from 960 runs at stratified angles.

    docs/results/table2-recomputed.md compares it with the paper.

    Columns: sample, regime, mu, mu_se, tau0_kPa, tau0_kPa_se.
    """
    return _read("table2_tribo.csv")


def load_pattern_laws() -> pd.DataFrame:
    """Law of each pattern of the paper by tribo's own simulator, and its shares of that of the flat sample.

    Columns: sample, regime, the geometry (lengths in um), runs, mu, tau0_kPa, their shares of those of the flat sample
    (mu_share, tau0_share), and the standard error of each (``_se``). docs/results/model-error.md says how it was made.
    """
    return _read("laws.csv", PATTERN_SHARES)


def load_pattern_errors() -> pd.DataFrame:
    """How wrong the spring-block model may be about a pattern: standard deviations of ln T by source and regime.

    Columns: source, regime, offset, slope (per e-fold of pressure), curve (per squared e-fold), cases (how many were
    compared), made_from. "total" holds for a simulated pattern, "interpolation" is added to it for any other.
    """
    return _read("errors.csv", PATTERN_SHARES)


def load_model_parameters() -> pd.DataFrame:
    """Parameters of the paper's spring-block model: name, symbol, value, unit, place (section)."""
    return _read("model_parameters.csv")


def contradictions() -> pd.DataFrame:
    """Points on which the paper contradicts itself or gives no value.

    Returns
    -------
    DataFrame
        One row per point, all text: topic, one_place, other_place, effect, tribo_default.

    Examples
    --------
    >>> points = tribo.contradictions().set_index("topic")
    >>> points.loc["pitch of pattern S along x", "tribo_default"]
    '220 x 120 um'
    """
    return _read("contradictions.csv")


def _read(name: str, folder: str = BERARDO2019) -> pd.DataFrame:
    import pandas as pd

    return pd.read_csv(data_dir() / folder / name, comment="#", keep_default_na=False, na_values=[""])
