"""A law that was found in measurements, put into the spring-block model: every contact block follows it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.mechanisms.record import Conditions, Mechanism, Values
from tribo.mechanisms_in_model.on_blocks import RECORDED, by_law_under, conditions_of_run
from tribo.simulate.config import SimConfig

OF_THE_RUN = ("pressure_Pa", "contact_pressure_Pa")  # columns that a run has by itself


def with_law(
    config: SimConfig, law: tuple[Mechanism, Values], recorded: Mapping[str, float], columns: Mapping[str, str]
) -> SimConfig:
    """The configuration whose local friction follows a law, as if every contact block were a flat sample.

    ``columns`` are values of recorded columns that the model does not know. A law on T or on a term of it is a gain of
    coefficients and adhesion, so that it can act on every block; one that acts in static friction alone changes the
    static thresholds and leaves the sliding ones. Where it changes nothing, the configuration is the same to the bit.
    """
    mechanism, values = law
    conditions = conditions_under(config, recorded, columns)
    changed, same = (by_law_under(config.friction, mechanism, v, conditions) for v in (values, mechanism.zero()))
    return config if changed == same else config.with_(friction=changed)


def conditions_under(config: SimConfig, recorded: Mapping[str, float], columns: Mapping[str, str]) -> Conditions:
    """The run as one test with these values of further columns."""
    conditions = conditions_of_run(config, recorded)
    own = {name: np.array([text]) for name, text in columns.items() if name != "run_order"}
    order = np.array([float(columns.get("run_order", 1.0))])
    return replace(conditions, run_order=order, columns={**conditions.columns, **own})


def columns_from(text: str, names: Collection[str]) -> tuple[str, dict[str, str]]:
    """"film_um=3.2,hold_s=100" with the columns ``names`` of laws -> what is left for mechanisms, and their values.

    Raises
    ------
    SimulationError
        A column of a law has no value: every one that is missing.
    """
    items = [item.strip() for item in text.split(",") if item.strip()]
    wanted = [name for name in names if name not in RECORDED and name not in OF_THE_RUN]
    own = {key: value for key, _, value in (item.partition("=") for item in items) if key in wanted}
    if missing := [name for name in wanted if name not in own]:
        raise SimulationError(
            Problem("missing_condition", "the law depends on a column that the model does not have", found=name,
                    allowed=f"--given {name}=VALUE")
            for name in missing
        )  # fmt: skip
    rest = [item for item in items if item.partition("=")[0] not in own]
    return ",".join(rest), own
