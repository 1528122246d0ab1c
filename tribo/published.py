"""Published tables that travel with tribo, in the units of their source."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

BERARDO2019 = "berardo2019"
_PACKAGE = Path(__file__).resolve().parent


def data_dir() -> Path:
    """Folder of the bundled data: ``tribo/_data`` of an installed wheel, ``data`` of a source checkout.

    Raises
    ------
    FileNotFoundError
        Neither is there: the installation is incomplete.
    """
    places = (_PACKAGE / "_data", _PACKAGE.parent / "data")
    for folder in places:
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"the bundled data is neither in {places[0]} nor in {places[1]}")


def load_table1() -> pd.DataFrame:
    """Table 1 of Berardo et al. (2019): the patterns, one row a sample.

    Columns: sample, cavity (none, circle, rectangle), size_x_um, size_y_um (the diameter twice for a circle),
    pitch_x_um, pitch_y_um, area_fraction_printed, area_fraction_computed (from the sizes printed beside it),
    area_fraction_model (of the paper's 85 x 85 blocks). Empty (NaN) where a flat sample has none.
    """
    return _read("table1.csv")


def load_table2() -> pd.DataFrame:
    """Table 2 of Berardo et al. (2019) in long form, one row a sample, regime and source.

    Columns: sample, regime (static, sliding), source (experiment, simulation), mu, mu_sd, tau0_kPa,
    tau0_sd_kPa. The standard deviations are as printed; the covariance of mu and tau0 is not published.
    """
    return _read("table2.csv")


def load_table2_simulated_anew() -> pd.DataFrame:
    """The simulated part of Table 2 as tribo's own engine gives it, from 960 runs at stratified angles.

    docs/results/table2-recomputed.md compares it with the paper.

    Columns: sample, regime, mu, mu_se, tau0_kPa, tau0_kPa_se.
    """
    return _read("table2_tribo.csv")


def load_model_parameters() -> pd.DataFrame:
    """Parameters of the paper's spring-block model: name, symbol, value, unit, place (section)."""
    return _read("model_parameters.csv")


def contradictions() -> pd.DataFrame:
    """Where the paper is at odds with itself or silent.

    Columns: topic, one_place, other_place, effect, tribo_default.
    """
    return _read("contradictions.csv")


def _read(name: str) -> pd.DataFrame:
    import pandas as pd

    return pd.read_csv(data_dir() / BERARDO2019 / name, comment="#", keep_default_na=False, na_values=[""])
