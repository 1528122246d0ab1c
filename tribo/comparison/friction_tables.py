"""What a report without the model shows: T/N with its conditions, within records, oscillations and restarts."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd

from tribo.comparison.study_lookup import sample_numbers
from tribo.fitting.alternatives import force_N
from tribo.fitting.dependence import LABELS, SPEED, measured_points, test_values, variables_of
from tribo.fitting.linear import meant_to_be_one
from tribo.records import REGIMES, Study

POINTS_COLUMNS = [
    "sample_number", "sample", "regime", "test_id", "variable", "label", "value", "T_over_N", "T_over_N_u",
]  # fmt: skip
RECORD_COLUMNS = ["sample_number", "sample", "test_id", "normal_load_N", "way", "value", "T_over_N"]
OSCILLATION_COLUMNS = [
    "sample_number", "sample", "test_id", "regime", "variable", "label", "value", "quantity", "y", "y_u",
]  # fmt: skip
RESTART_COLUMNS = ["sample_number", "sample", "test_id", "hold_s", "T_over_N", "T_over_N_u"]
FORCE_COLUMNS = ["sample_number", "sample", "regime", "mark", "normal_load_N", "T_N"]
_LAW_POINTS = 80
_MOST_VARIABLES = 8
_RECORD_POINTS = 80
_MOST_RECORDS = 60


def shown(study: Study) -> bool:
    """Whether the study was made without the spring-block model, whose report shows other figures."""
    return study.comparison is None and bool(study.ingested.pulls)


def dependence_points(study: Study) -> pd.DataFrame:
    """T/N of every test against every recorded variable that varies, one row per point."""
    points = measured_points(study.ingested) if shown(study) else pd.DataFrame()
    order = sample_numbers(study)
    frames = [
        points.assign(variable=name, label=LABELS.get(name, name.replace("_", " ")), value=points[name])
        for name in (variables_of(points)[:_MOST_VARIABLES] if len(points) else ())
    ]
    if not frames:
        return pd.DataFrame(columns=POINTS_COLUMNS)
    table = pd.concat(frames, ignore_index=True)
    table = table[np.isfinite(table["value"])]
    return table.assign(sample_number=table["sample"].map(order))[POINTS_COLUMNS]


def law_points(study: Study) -> pd.DataFrame:
    """T of every test against its load, and the law chosen for each sample and regime; nothing at a single load."""
    order, laws = sample_numbers(study), study.laws
    frames: list[pd.DataFrame] = []
    table = study.ingested.table()
    several = shown(study) and not meant_to_be_one(table["normal_load_N"].to_numpy(float))
    for (sample, number), regime in product(order.items(), REGIMES) if several else ():
        part = table[(table["sample"] == sample) & np.isfinite(table[f"{regime}_N"]) & (table["normal_load_N"] > 0)]
        said = {"sample_number": number, "sample": sample, "regime": regime}
        load = part["normal_load_N"].to_numpy(float)
        frames.append(pd.DataFrame({**said, "mark": "measured", "normal_load_N": load, "T_N": part[f"{regime}_N"]}))
        own = None if laws is None else laws[(laws["sample"] == sample) & (laws["regime"] == regime) & laws["chosen"]]
        if own is not None and len(own) and len(load):
            law = own.iloc[0]
            grid = np.geomspace(load.min(), load.max(), _LAW_POINTS)
            force = force_N(str(law["law"]), float(law["a"]), float(law["b"]), grid)
            frames.append(pd.DataFrame({**said, "mark": str(law["formula"]), "normal_load_N": grid, "T_N": force}))
    there = [frame for frame in frames if len(frame)]
    return pd.concat(there, ignore_index=True) if there else pd.DataFrame(columns=FORCE_COLUMNS)


def within_records(study: Study) -> pd.DataFrame:
    """T/N along each record against the distance slid, or the time where no speed is known; block means."""
    frames: list[pd.DataFrame] = []
    order = sample_numbers(study)
    for test in study.ingested.campaign.tests if shown(study) else ():
        trace, pull = study.ingested.traces.get(test.test_id), study.ingested.pulls.get(test.test_id)
        if trace is None or pull is None or not test.normal_load_N > 0 or len(frames) >= _MOST_RECORDS:
            continue
        size = max(1, trace.time_s.size // _RECORD_POINTS)
        count = trace.time_s.size // size
        time, force = (np.asarray(v)[: count * size].reshape(count, size).mean(axis=1)
                       for v in (trace.time_s - trace.time_s[0], trace.force_N - pull.zero_N))  # fmt: skip
        slid = test.speed_m_s is not None
        frames.append(pd.DataFrame({
            "sample_number": order[test.sample], "sample": test.sample, "test_id": test.test_id,
            "normal_load_N": test.normal_load_N, "way": "distance (m)" if slid else "time (s)",
            "value": time * (test.speed_m_s or 1.0), "T_over_N": force / test.normal_load_N,
        }))  # fmt: skip
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=RECORD_COLUMNS)


def oscillation_points(study: Study) -> pd.DataFrame:
    """Drop over load and period of every test that oscillates while sliding, against speed, or load without speeds."""
    rows = []
    order = sample_numbers(study)
    speeds = {t.speed_m_s for t in study.ingested.campaign.tests if t.speed_m_s}
    variable = SPEED if len(speeds) > 1 else "normal_load_N"
    for test in study.ingested.campaign.tests if shown(study) else ():
        pull = study.ingested.pulls.get(test.test_id)
        found = pull.oscillation if pull is not None else None
        value = test_values(test).get(variable)
        if found is None or not found.cycles or found.regime == "steady" or not value or not test.normal_load_N > 0:
            continue
        said = {"sample_number": order[test.sample], "sample": test.sample, "test_id": test.test_id,
                "regime": found.regime, "variable": variable, "label": LABELS[variable], "value": value}  # fmt: skip
        load = test.normal_load_N
        rows.append({**said, "quantity": "drop / N", "y": found.drop_N / load, "y_u": found.drop_u_N / load})
        rows.append({**said, "quantity": "period (s)", "y": found.period_s, "y_u": found.period_u_s})
    return pd.DataFrame(rows, columns=OSCILLATION_COLUMNS)


def restart_points(study: Study) -> pd.DataFrame:
    """Static force over load of every restart, against the time the drive stood still."""
    order = sample_numbers(study)
    rows = [
        {"sample_number": order[test.sample], "sample": test.sample, "test_id": test.test_id, "hold_s": restart.hold_s,
         "T_over_N": restart.static_N / test.normal_load_N, "T_over_N_u": restart.static_u_N / test.normal_load_N}
        for test in (study.ingested.campaign.tests if shown(study) else ())
        if test.test_id in study.ingested.pulls and test.normal_load_N > 0
        for restart in study.ingested.pulls[test.test_id].restarts
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=RESTART_COLUMNS)
