"""Why a measured campaign may differ from the baseline model: one module a mechanism, and the table of them.

A mechanism stands in the table under its name in a verdict.
"""

from __future__ import annotations

from importlib import import_module

from tribo.mechanisms.record import Mechanism

NAMES = (
    "contact_area_loss",
    "pressure_dependent_friction",
    "velocity_dependence",
    "contact_ageing",
    "run_in",
    "suction",
    "edge_adhesion",
    "cavity_collapse",
    "cavity_shear_deformation",
    "pattern_geometry",
    "load_cell_offset",
    "load_cell_drift",
    "normal_load_error",
    "pull_angle",
    "pulley_friction",
    "machine_compliance",
    "sampling_clip",
    "bulk_viscoelasticity",
    "temperature",
    "humidity",
    "tilt",
    "mislabelled_specimen",
    "wrong_weight",
    "load_of_one_day",
    "tare_of_one_day",
    "area_of_one_specimen",
    "covariate",
)

MECHANISMS: dict[str, Mechanism] = {name: import_module(f"tribo.mechanisms.{name}").MECHANISM for name in NAMES}


def mechanism(name: str) -> Mechanism:
    """The mechanism called ``name``; ``covariate:operator`` is the covariate mechanism.

    Raises
    ------
    KeyError
        No such mechanism; the message lists those there are.
    """
    key = name.split(":")[0]
    if key not in MECHANISMS:
        raise KeyError(f"no mechanism {name!r}; there are {', '.join(MECHANISMS)}")
    return MECHANISMS[key]
