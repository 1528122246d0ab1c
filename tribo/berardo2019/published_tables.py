"""The published tables bundled with tribo, and those its simulator made beside them, in the units of their source."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tribo.files import PATTERN_SHARES, data_dir

if TYPE_CHECKING:
    import pandas as pd

BERARDO2019 = "berardo2019"


def load_table1() -> pd.DataFrame:
    """Table 1 of Berardo et al. (2019): the patterns, one row per sample.

    Columns: sample, cavity (none, circle, rectangle), size_x_um, size_y_um (the diameter twice for a circle),
    pitch_x_um, pitch_y_um, area_fraction_printed, area_fraction_computed (from the sizes printed beside it),
    area_fraction_model (of the paper's 85 x 85 blocks). NaN where a flat sample has no value.
    """
    return _read("table1.csv")


def load_table2() -> pd.DataFrame:
    """Table 2 of Berardo et al. (2019) in long form, one row per sample, regime and source.

    Columns: sample, regime (static, sliding), source (experiment, simulation), mu, mu_sd, tau0_kPa,
    tau0_sd_kPa. The standard deviations are as printed; the covariance of mu and tau0 is not published.
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

    Columns: topic, one_place, other_place, effect, tribo_default.
    """
    return _read("contradictions.csv")


def _read(name: str, folder: str = BERARDO2019) -> pd.DataFrame:
    import pandas as pd

    return pd.read_csv(data_dir() / folder / name, comment="#", keep_default_na=False, na_values=[""])
