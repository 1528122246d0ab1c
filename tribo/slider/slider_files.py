"""Files of a slider: laws and designs that users write, and runs and ensembles as HDF5."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from tribo.errors import Problem, SimulationError, system_problem
from tribo.files import intact_hdf5
from tribo.input_files import (
    DEEPEST_NESTING,
    LARGEST_DESCRIPTION_BYTES,
    MOST_RUNS,
    nests_too_deeply,
    read_input,
    toml_table,
)
from tribo.slider.contact_laws import SLIDER_LAWS
from tribo.slider.slider_run import SliderConfig, SliderRun, simulate_slider
from tribo.springblock.ensemble import Work
from tribo.springblock.kept_runs import plain, unit_of, write_columns
from tribo.user_text import did_you_mean

SLIDER_RUN = "one run of a slider on a machine"
SLIDER_ENSEMBLE = "an ensemble of sliders on machines"
FIELDS = (
    "mass_kg", "stiffness_N_per_m", "damping_N_s_per_m", "normal_load_N", "backlash_m", "duration_s", "rate_Hz",
    "noise_N", "seed", "begins_sliding", "speed_m_s", "method",
)  # fmt: skip
"""Parameters of a run that ``--set`` and a design may set, besides those of the law."""


def read_slider_law(path: str | Path) -> tuple[str, dict[str, Any]]:
    """Name and values of the law in a file LAW.toml, checked: ``law = "coulomb"`` and a table ``[parameters]``.

    Raises
    ------
    SimulationError
        The file cannot be read, or the law or its parameters are not possible: every fault at once.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tribo.slider import read_slider_law
    >>> Path("law.toml").write_text('law = "coulomb"\\n[parameters]\\nmu_s = 0.4\\nmu_d = 0.3\\n')  # doctest: +SKIP
    >>> read_slider_law("law.toml")  # doctest: +SKIP
    ('coulomb', {'mu_s': 0.4, 'mu_d': 0.3, 'viscous_N_s_per_m': 0.0})
    """
    table = _table(Path(path))
    name, values = table.get("law"), table.get("parameters", {})
    problems = [
        Problem("unknown_key", "unknown key", column=key, found=key, allowed="law, parameters")
        for key in table if key not in ("law", "parameters")
    ]  # fmt: skip
    if not isinstance(values, dict):
        problems.append(Problem("wrong_value", "must be a table", column="parameters", found=str(values)))
        values = {}
    if name not in SLIDER_LAWS:
        near = did_you_mean(str(name), list(SLIDER_LAWS)) if name is not None else None
        problems.append(Problem("unknown_law", "no such law", column="law", found=str(name or ""),
                                allowed=near or ", ".join(SLIDER_LAWS)))  # fmt: skip
        found: dict[str, Any] = {}
    else:
        found, more = SLIDER_LAWS[str(name)].checked(values)
        problems += more
    if problems:
        raise SimulationError([p.at(file=str(path)) for p in problems])
    return str(name), found


def _table(path: Path) -> dict[str, Any]:
    """The TOML of a file; SimulationError where it cannot be read."""
    try:
        table = toml_table(read_input(path, LARGEST_DESCRIPTION_BYTES).decode("utf-8-sig"))
    except OSError as why:
        raise SimulationError(system_problem(why, str(path))) from why
    except ValueError as why:
        raise SimulationError(Problem("unreadable", f"cannot be read as TOML: {why}", file=str(path))) from why
    except RecursionError as why:
        raise SimulationError(_too_deep(path)) from why
    if nests_too_deeply(table):
        raise SimulationError(_too_deep(path))
    return table


def _too_deep(path: Path) -> Problem:
    allowed = f"at most {DEEPEST_NESTING} levels"
    return Problem("too_deep", "tables and arrays nested too deeply", file=str(path), allowed=allowed)


def read_slider_design(path: Path, base: SliderConfig) -> list[SliderConfig]:
    """The runs of a design file: its ``law`` and every combination of the values in ``[parameters]``.

    Raises
    ------
    SimulationError
        The file cannot be read, or the design is impossible: every fault at once.
    """
    table = _table(path)
    problems = [
        Problem("unknown_key", "unknown key", column=key, found=key, allowed="law, parameters", file=str(path))
        for key in table if key not in ("law", "parameters")
    ]  # fmt: skip
    parameters = table.get("parameters", {})
    if not isinstance(parameters, dict):
        problems.append(Problem("wrong_value", "must be a table", column="parameters", file=str(path)))
        parameters = {}
    try:
        return runs_of(base.with_(law=str(table.get("law", base.law))), parameters, problems)
    except SimulationError as refused:
        raise SimulationError([p.at(file=str(path)) for p in refused.problems]) from refused


def runs_of(
    base: SliderConfig, parameters: Mapping[str, Any], problems: list[Problem] | None = None
) -> list[SliderConfig]:
    """Every combination of parameters, those with a list of values varied; each run is checked before any is made.

    Raises
    ------
    SimulationError
        Unknown parameters, wrong values and impossible runs, all at once, after the ``problems`` found before.
    """
    found = {str(p): p for p in problems or []}
    law = SLIDER_LAWS.get(base.law)
    known = [*FIELDS, *(law.units if law else ())]
    points = law.points if law else ()
    axes: dict[str, list[Any]] = {}
    for name, given in parameters.items():
        if name not in known:
            p = Problem("unknown_key", "unknown parameter", column=name, found=name,
                        allowed=did_you_mean(name, known) or ", ".join(known))  # fmt: skip
            found[str(p)] = p
            continue
        many = isinstance(given, list) and (name not in points or any(isinstance(part, list) for part in given))
        axes[name] = list(given) if many else [given]
        whole = name == "speed_m_s"
        if whole and not all(isinstance(v, int | float) and math.isfinite(v) and v != 0 for v in axes[name]):
            p = Problem("wrong_value", "wrong type of value", column=name, found=str(given), allowed="a number, not 0")
            found[str(p)] = p
            axes.pop(name)
    runs: list[SliderConfig] = []
    if math.prod(map(len, axes.values())) > MOST_RUNS:
        p = Problem("too_many_runs", "this design has too many runs", allowed=f"at most {MOST_RUNS} runs")
        found[str(p)] = p
    else:
        for values in product(*axes.values()):
            run = base.with_(**dict(zip(axes, values, strict=True)))
            try:
                runs.append(run.check())
            except SimulationError as refused:
                found |= {str(p): p for p in refused.problems}
    if found:
        raise SimulationError(list(found.values()))
    return runs


def slider_row(run: SliderRun) -> dict[str, float]:
    """What an ensemble keeps of a run."""
    return {
        "static_friction": run.static_friction, "sliding_friction": run.sliding_friction, "peak_s": run.peak_s,
        "slips": float(run.starts_s.size), "stuck_share": float(run.stuck.mean()),
        "lowest_force_N": float(run.force_N[run.time_s >= run.window_s[0]].min()),
        "highest_force_N": float(run.force_N[run.time_s >= run.window_s[0]].max()),
    }  # fmt: skip


# the scheduler of block runs makes those of sliders as well
SLIDER_WORK = Work(simulate_slider, slider_row, label="slider", rooms=("slider", "laws"))  # type: ignore[arg-type]


def _units(config: SliderConfig) -> dict[str, str]:
    return {f"law_{name}": unit for name, unit in SLIDER_LAWS[config.law].units.items()}


def _attributes(parameters: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, Any]:
    """Every parameter as an attribute, with ``NAME_unit`` beside each number."""
    found: dict[str, Any] = {}
    for name, value in parameters.items():
        found[name] = plain(value)
        if isinstance(value, int | float | tuple | list) and not isinstance(value, bool):
            found[f"{name}_unit"] = units.get(name) or unit_of(name)
    return found


def write_slider_run(run: SliderRun, path: str | Path) -> Path:
    """Write one run: ``time`` (s), ``force`` (N), ``drive``, ``position`` (m), ``velocity`` (m/s), ``stuck`` (0 or 1).

    Every parameter is an attribute with its unit beside it; ``slip_starts`` and ``slip_ends`` are exact times in s.
    """
    law = SLIDER_LAWS[run.config.law]
    columns: dict[str, Any] = {
        "time": (run.time_s, {"units": "s"}),
        "force": (run.force_N, {"units": "N", "long_name": "force of spring and damper on the slider"}),
        "drive": (run.drive_m, {"units": "m", "long_name": "position of the drive"}),
        "position": (run.position_m, {"units": "m", "long_name": "position of the slider"}),
        "velocity": (run.velocity_m_s, {"units": "m/s", "long_name": "speed of the slider"}),
        "stuck": (run.stuck.astype(np.uint8), {"units": "1", "long_name": "whether the slider is at rest"}),
    }
    for k, state in enumerate(run.states_s, 1):
        columns[f"state{k}"] = (state, {"units": "s", "long_name": "state variable of the law"})
    about = {
        "title": SLIDER_RUN, "formula": law.formula, "source": law.source,
        "static_friction": run.static_friction, "sliding_friction": run.sliding_friction,
        "static_friction_unit": "1", "sliding_friction_unit": "1", "window": np.asarray(run.window_s),
        "window_unit": "s", "peak_s": run.peak_s, "peak_s_unit": "s", "slip_starts": run.starts_s,
        "slip_starts_unit": "s", "slip_ends": run.stops_s, "slip_ends_unit": "s",
        **_attributes(run.config.parameters(), _units(run.config)),
    }  # fmt: skip
    return write_columns(Path(path), "time", columns, about)


def write_slider_ensemble(configs: list[SliderConfig], rows: list[Mapping[str, Any]], path: Path) -> Path:
    """Write an ensemble: one entry per run, with what varies between runs and what is kept of each."""
    inputs = [config.parameters() for config in configs]
    names = [name for name in inputs[0] if any(other.get(name) != inputs[0][name] for other in inputs)]
    units = {**_units(configs[0]), "stuck_share": "1", "slips": "1", "lowest_force_N": "N", "highest_force_N": "N"}
    columns: dict[str, Any] = {"run": (np.arange(len(rows)), {"units": "1"})}
    for name in names:
        values = [given[name] for given in inputs]
        numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
        kept = np.array(values, float) if numbers else np.array([str(v) for v in values])
        columns[name] = (kept, {"units": units.get(name) or unit_of(name)})
    for name in rows[0]:
        columns[name] = (np.array([row[name] for row in rows]), {"units": units.get(name) or unit_of(name)})
    shared = {name: value for name, value in inputs[0].items() if name not in names}
    return write_columns(path, "run", columns, {"title": SLIDER_ENSEMBLE, **_attributes(shared, _units(configs[0]))})


def slider_file_kind(path: Path) -> str:
    """What a file of results holds, in the words of its title; empty for any other file."""
    import h5py

    try:
        with h5py.File(intact_hdf5(path)) as file:
            title = str(file.attrs.get("title", ""))
    except (OSError, ValueError, KeyError):
        return ""
    return title if title in (SLIDER_RUN, SLIDER_ENSEMBLE) else ""
