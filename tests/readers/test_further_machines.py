"""Tables of machines and home-made rigs as they are known to be written: what each column is taken for."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from tribo.errors import ReadError
from tribo.readers import read_export

ROWS = 60
TIME = np.arange(ROWS) * 0.05
RNG = np.random.default_rng(8)
FORCE = 3.0 + 0.05 * RNG.standard_normal(ROWS)
LOAD = 10.0 + 0.01 * RNG.standard_normal(ROWS)


def written(path: Path, head: str, columns: list[np.ndarray], separator: str, comma: bool, encoding: str) -> Path:
    rows = [separator.join(f"{v:.5f}" for v in row) for row in zip(*columns, strict=True)]
    text = "\n".join([head, *((row.replace(".", ",") if comma else row) for row in rows)]) + "\n"
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    ("head", "columns", "separator", "comma", "encoding"),
    [
        ("TE77 High Frequency Friction Machine\nElapsed Time (s),Load (N),Stroke (mm),RMS Friction Force (N)",
         [TIME, LOAD, 0 * TIME + 15, FORCE], ",", False, "utf-8"),
        ("time_s,torque_Nm,axial_force_N,rpm,radius_mm",
         [TIME, 0.02 * FORCE, LOAD, 0 * TIME + 100, 0 * TIME + 20], ",", False, "utf-8"),
        ("Time (sec),Axial Force (N),Axial Torque (N-mm),Radius (mm)", [TIME, LOAD, 20 * FORCE, 0 * TIME + 20], ",",
         False, "utf-8"),
        ("Tiempo (s);Fuerza de rozamiento (N);Carga normal (N)", [TIME, FORCE, LOAD], ";", True, "cp1252"),
        ("Tempo [s];Forza di attrito [N];Carico normale [N]", [TIME, FORCE, LOAD], ";", True, "cp1252"),
        ("Tempo (s);Força de atrito média (N);Força normal (N)", [TIME, FORCE, LOAD], ";", True, "cp1252"),
        ("HBM CATMANEASY 3.5\nZeit  1 - Standardmessrate\tFt\tFn\ns\tN\tN", [TIME, FORCE, LOAD], "\t", True, "cp1252"),
        ("Zeit [s];Reibkraft gefiltert [N];Normalkraft gemittelt [N]", [TIME, FORCE, LOAD], ";", True, "cp1252"),
        ("WINDUCOM\nTime(sec)\tF.F.(N)\tNormal Load(N)\tWear(Micrometers)", [TIME, FORCE, LOAD, TIME], "\t", False,
         "utf-8"),
        ("Time (s),Set Normal Load (N),Mean Friction Force (mN),Mean Normal Load (mN)",
         [TIME, 0 * TIME + 12, 1e3 * FORCE, 1e3 * LOAD], ",", False, "utf-8"),
    ],
)  # fmt: skip
def test_friction_and_load_are_told_by_the_words_of_their_columns(
    tmp_path: Path, head: str, columns: list[np.ndarray], separator: str, comma: bool, encoding: str
) -> None:
    trace = read_export(written(tmp_path / "export.txt", head, columns, separator, comma, encoding))
    assert trace.force_N == pytest.approx(FORCE, abs=2e-3)
    assert trace.columns["normal_force_N"] == pytest.approx(LOAD, abs=1e-4)


def test_the_energy_of_friction_is_no_force(tmp_path: Path) -> None:
    head = "Time (s),Friction energy (J),Friction torque limit (N),Load (N)"
    path = written(tmp_path / "export.csv", head, [TIME, FORCE, FORCE, LOAD], ",", False, "utf-8")
    assert read_export(path).force_N == pytest.approx(LOAD, abs=1e-4)  # the only force that was recorded


def test_a_coefficient_of_a_pin_on_disc_without_a_load_asks_for_the_load(tmp_path: Path) -> None:
    head = "Anton Paar Tribometer TRB3\nNormal load :\t5.00 [N]\n\nTime [s]\tDistance [m]\tLaps\tµ"
    path = written(tmp_path / "export.txt", head, [TIME, TIME, TIME, 0.1 * FORCE], "\t", False, "utf-8")
    with pytest.raises(ReadError, match=r"normal_load_N in tests\.csv or with --set"):
        read_export(path)


@pytest.mark.parametrize(
    ("head", "form", "separator", "comma"),
    [
        ("Date,Time,Friction force (N),Normal force (N)", "%Y-%m-%d,%H:%M:%S.{ms}", ",", False),
        ("Time,Date,Friction force (N),Normal force (N)", "%H:%M:%S.{ms},%d-%b-%Y", ",", False),
        ("Datum;Uhrzeit;Reibkraft [N];Normalkraft [N]", "%d.%m.%Y;%H:%M:%S,{ms}", ";", True),
        ("Date\tTime\tFriction (N)\tLoad (N)", "%m/%d/%Y\t%I:%M:%S.{ms} %p", "\t", False),
        ("Date,Time,ms,Friction force (N),Normal force (N)", "%Y/%m/%d,%H:%M:%S,{ms}", ",", False),
        ("Timestamp,Friction force (N),Normal force (N)", "%Y-%m-%dT%H:%M:%S.{ms}Z", ",", False),
        ("Time,Friction force (N),Normal force (N)", "%H:%M:%S.{ms}", ",", False),
        ("Time,Friction force (N),Normal force (N)", "%M:%S.{ms}", ",", False),
        ("Zeit [mm:ss,0];Reibkraft [N];Normalkraft [N]", "%M:%S,{ms}", ";", True),
        ("Time (hh:mm:ss)\tFriction (N)\tLoad (N)", "%H:%M:%S.{ms}", "\t", False),
    ],
)
@pytest.mark.parametrize("begins", ["2024-05-07T14:03:22.500", "2024-02-28T23:59:58.900"])
def test_the_clock_of_a_logger_counts_from_its_first_row(
    tmp_path: Path, head: str, form: str, separator: str, comma: bool, begins: str
) -> None:
    rows = []
    for t, force, load in zip(TIME, FORCE, LOAD, strict=True):
        now = datetime.fromisoformat(begins) + timedelta(seconds=float(t))
        clock = now.strftime(form).replace("{ms}", f"{now.microsecond // 1000:03d}")
        numbers = f"{force:.5f}{separator}{load:.5f}"
        rows.append(clock + separator + (numbers.replace(".", ",") if comma else numbers))
    path = tmp_path / "export.csv"
    path.write_text("\n".join([head, *rows]) + "\n")
    trace = read_export(path)
    assert trace.time_s == pytest.approx(TIME, abs=1e-3)
    assert trace.force_N == pytest.approx(FORCE, abs=1e-4)
    assert trace.columns["normal_force_N"] == pytest.approx(LOAD, abs=1e-4)


def test_elapsed_seconds_go_before_a_clock_of_whole_seconds(tmp_path: Path) -> None:
    start = datetime.fromisoformat("2024-05-07T14:03:22")
    clock = [f"{start + timedelta(seconds=int(t + 0.33)):%Y-%m-%d,%H:%M:%S}" for t in TIME]
    rows = [f"{now},{t:.2f},{force:.5f}" for now, t, force in zip(clock, TIME, FORCE, strict=True)]
    path = tmp_path / "export.csv"
    path.write_text("\n".join(["Date,Time,Elapsed (s),Friction force (N)", *rows]) + "\n")
    assert read_export(path).time_s == pytest.approx(TIME, abs=1e-6)
