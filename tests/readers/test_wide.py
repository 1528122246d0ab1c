"""Wide tables: one time and many forces, or several specimens side by side; each is a record of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from tribo.errors import ReadError
from tribo.readers import inspect_export, read_blocks, read_export
from tribo.records import Correction

K = np.arange(12)
ENDS = (12, 9, 11)


def saved(folder: Path, header: str, rows: list[list[str]], delimiter: str = "\t") -> Path:
    path = folder / "wide.txt"
    path.write_text(header + "\n" + "\n".join(delimiter.join(row) for row in rows) + "\n", encoding="utf-8")
    return path


def forces(nothing: str = "NaN", time_ends: int = 12) -> list[list[str]]:
    """Time 0.1 k and three forces (j + 1) k / 2 that end after 12, 9 and 11 rows."""
    return [
        [f"{0.1 * k:.1f}" if k < time_ends else nothing]
        + [f"{0.5 * (j + 1) * k:.2f}" if k < end else nothing for j, end in enumerate(ENDS)]
        for k in K
    ]


Record = list[tuple[float, float]]
RECORDS: list[Record] = [[(round(0.1 * k, 9), 0.5 * (j + 1) * k) for k in range(end)] for j, end in enumerate(ENDS)]


def records_in(path: Path, **options: object) -> list[Record]:
    """Time and force of every record of a table, row by row; none of them may be doubtful."""
    traces = read_blocks(path, **options)  # type: ignore[arg-type]
    assert [t.problems for t in traces] == [()] * len(traces)
    return [list(zip(t.time_s.round(9).tolist(), t.force_N.round(9).tolist(), strict=True)) for t in traces]


@pytest.mark.parametrize("nothing", ["NaN", ""])
def test_one_time_and_many_forces_headed_by_loads_are_a_record_each(tmp_path: Path, nothing: str) -> None:
    path = saved(tmp_path, "Time\t250\t250\t500", forces(nothing))
    columns = {"time": "Time [s]", "friction_force": "* [N]"}
    assert records_in(path, columns=columns) == RECORDS
    third = read_export(f"{path}#3", columns=columns)
    assert third.metadata["record"] == "500"
    np.testing.assert_allclose(third.force_N, 1.5 * K[:11])
    assert [t.label for t in inspect_export(path, columns=columns).tables] == ["250", "250", "500"]


@pytest.mark.parametrize("rest", [[], ["Normal load [N]"]])
def test_a_column_without_any_number_is_no_record(tmp_path: Path, rest: list[str]) -> None:
    rows = [[*row[:3], "", *("5" for _ in rest)] for row in forces("")]
    path = saved(tmp_path, "\t".join(["Time", "a", "b", "c", *rest]), rows)
    columns = {"time": "Time [s]", "friction_force": "* [N]"}
    assert [t.metadata["record"] for t in read_blocks(path, columns=columns)] == ["a", "b"]
    seen = inspect_export(path, columns=columns)
    assert ([t.label for t in seen.tables], seen.other_tables) == (["a", "b"], ("c",))


def test_a_table_without_any_row_of_numbers_is_refused(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time\tnote\tF1", [[row[0], "5", ""] for row in forces("")])
    columns = {"time": "Time [s]", "friction_force": "F* [N]"}
    with pytest.raises(ReadError) as caught:
        read_blocks(path, columns=columns)
    assert {p.kind for p in caught.value.problems} == {"header_only"}
    assert inspect_export(path, columns=columns).refused


def test_a_wide_table_without_units_is_refused_with_what_to_give(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match=r'friction_force = "\* \[N\]"'):
        read_export(saved(tmp_path, "Time\t250\t250\t500", forces()))


def test_a_sampling_rate_carries_records_past_the_end_of_a_short_time_column(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time\t250\t250\t500", forces(time_ends=8))
    timed = read_blocks(path, columns={"time": "Time [s]", "force": "* [N]"})
    assert [(t.time_s.size, t.flags) for t in timed] == [(8, ("empty_end",))] * 3
    rated = read_blocks(path, columns={"time": "none", "force": "* [N]"}, correction=Correction(sampling_rate_Hz=10.0))
    assert [t.time_s.size for t in rated] == list(ENDS)
    np.testing.assert_allclose(rated[0].time_s, 0.1 * K)


@pytest.mark.parametrize(
    "header", ["Time [s]\tF 1 [N]\tF 2 [N]\tF 3 [N]", "Time [s]\tForce\tForce.1\tForce.2\ns\tN\tN\tN"]
)
def test_forces_of_numbered_names_are_records(tmp_path: Path, header: str) -> None:
    assert records_in(saved(tmp_path, header, forces())) == RECORDS


def test_columns_with_a_unit_of_force_beside_a_time_are_records_whatever_their_names(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time [s]\tsteel [N]\tbronze [N]\tglass [N]", forces())
    assert records_in(path) == RECORDS
    assert [t.label for t in inspect_export(path).tables] == ["steel", "bronze", "glass"] or [
        t.label for t in inspect_export(path).tables
    ] == ["steel [N]", "bronze [N]", "glass [N]"]


def test_two_forces_of_one_rig_are_no_two_records(tmp_path: Path) -> None:
    rows = [[f"{0.1 * k:.1f}", f"{0.5 * k}", "20.0"] for k in K]
    trace = read_export(saved(tmp_path, "Time [s]\tFx [N]\tFz [N]", rows))
    np.testing.assert_allclose(trace.columns["normal_force_N"], 20.0)


def test_a_pattern_takes_the_columns_whose_names_it_fits(tmp_path: Path) -> None:
    rows = [[*row, "20.0"] for row in forces()]
    path = saved(tmp_path, "Time [s]\tA run\tB run\tC run\tFz [N]", rows)
    traces = read_blocks(path, columns={"force": "* run [N]"})
    assert len(traces) == 3
    np.testing.assert_allclose(traces[1].columns["normal_force_N"], 20.0)
    with pytest.raises(ReadError, match="no column has a name that fits"):
        read_blocks(path, columns={"force": "D* [N]"})


def test_patterns_of_force_and_displacement_pair_in_order(tmp_path: Path) -> None:
    rows = [[f"{0.1 * k:.1f}", f"{0.5 * k}", f"{k}", f"{1.5 * k}", f"{2 * k}"] for k in K]
    path = saved(tmp_path, "t\tTa\txa\tTb\txb", rows)
    columns = {"time": "t [s]", "force": "T? [N]", "displacement": "x? [mm]"}
    traces = read_blocks(path, columns=columns)
    np.testing.assert_allclose(traces[1].force_N, 1.5 * K)
    assert traces[1].displacement_m is not None
    np.testing.assert_allclose(traces[1].displacement_m, 2e-3 * K)
    with pytest.raises(ReadError, match="different numbers of columns"):
        read_blocks(path, columns={**columns, "displacement": "xa* [mm]"})


@pytest.mark.parametrize("header", ["Time_1 [s]\tForce_1 [N]\tTime_2 [s]\tForce_2 [N]", "t\tF\tt.1\tF.1\ns\tN\ts\tN"])
def test_specimens_side_by_side_with_numbered_names_are_records(tmp_path: Path, header: str) -> None:
    rows = [[f"{0.1 * k:.1f}", f"{0.5 * k}", *([f"{0.2 * k:.1f}", f"{k}"] if k < 7 else ["", ""])] for k in K]
    first, second = read_blocks(saved(tmp_path, header, rows))
    np.testing.assert_allclose(first.force_N, 0.5 * K)
    np.testing.assert_allclose(second.force_N, K[:7])
    np.testing.assert_allclose(second.time_s, 0.2 * K[:7])


def test_columns_left_out_are_no_records(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time [s]\tF1 [N]\tF2 [N]\tF3 [N]", forces())
    trace = read_export(path, columns={"ignore": ["F2", "#4"], "force": "F1 [N]"})
    np.testing.assert_allclose(trace.force_N, 0.5 * K)
    assert len(read_blocks(path, columns={"force": "F* [N]", "ignore": "#3"})) == 2


def test_vectors_of_a_mat_file_are_records_by_a_pattern(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": 0.1 * K, "Fa": 0.5 * K, "Fb": 1.0 * K})
    traces = read_blocks(tmp_path / "a.mat", columns={"time": "t [s]", "force": "F* [N]"})
    assert len(traces) == 2
    np.testing.assert_allclose(traces[1].force_N, 1.0 * K)


def test_the_quartz_sand_as_published_is_ten_records(shared: Path) -> None:
    path = shared / "real" / "quartz-sand-ring-shear" / "443-03_UB_quartzsand_30_ts.txt"
    if not path.exists():
        pytest.skip("no real campaigns beside this checkout")
    raw = np.genfromtxt(path, skip_header=1)
    traces = read_blocks(path, columns={"force": "* [N]"}, correction=Correction(sampling_rate_Hz=10.0))
    assert len(traces) == 10
    for k, trace in enumerate(traces):
        np.testing.assert_array_equal(trace.force_N, raw[np.isfinite(raw[:, k + 1]), k + 1])


def test_a_column_with_a_unit_of_another_quantity_is_no_record_of_a_pattern(tmp_path: Path) -> None:
    rows = [[*row, "0.3"] for row in forces()]
    path = saved(tmp_path, "Time [s]\tsteel [N]\tbronze [N]\tglass [N]\tgauge [mm]", rows)
    assert records_in(path, columns={"time": "Time [s]", "force": "* [N]"}) == RECORDS


@pytest.mark.parametrize("left_out", [2, 3, 4])
def test_a_record_left_out_by_its_position_leaves_the_others(tmp_path: Path, left_out: int) -> None:
    path = saved(tmp_path, "Time [s]\tF1 [N]\tF2 [N]\tF3 [N]", forces())
    found = records_in(path, columns={"time": "Time [s]", "force": "F* [N]", "ignore": f"#{left_out}"})
    assert found == [record for j, record in enumerate(RECORDS) if j + 2 != left_out]


def test_a_column_given_by_its_position_serves_every_record(tmp_path: Path) -> None:
    path = saved(tmp_path, "clock\tF1 [N]\tF2 [N]\tF3 [N]", forces())
    assert records_in(path, columns={"time": "#1 [s]", "force": "F* [N]"}) == RECORDS


def test_a_column_left_out_by_its_position_is_left_out_of_every_record(tmp_path: Path) -> None:
    rows = [[*row[:3], "20.0", row[3]] for row in forces()]
    path = saved(tmp_path, "Time [s]\tF1 [N]\tF2 [N]\tFz [N]\tF3 [N]", rows)
    columns = {"time": "Time [s]", "force": "F? [N]", "ignore": "#4"}
    assert records_in(path, columns=columns) == RECORDS
    assert all("normal_force_N" not in trace.columns for trace in read_blocks(path, columns=columns))


def test_a_time_given_by_a_position_behind_the_forces_serves_every_record(tmp_path: Path) -> None:
    path = saved(tmp_path, "F1 [N]\tF2 [N]\tF3 [N]\tclock", [[*row[1:], row[0]] for row in forces()])
    assert records_in(path, columns={"time": "#4 [s]", "force": "F* [N]"}) == RECORDS


def test_a_pattern_that_fits_nothing_is_refused_with_all_columns_those_without_a_name_by_position(
    tmp_path: Path,
) -> None:
    path = saved(tmp_path, "Time [s]\tF1 [N]\t\tF3 [N]", forces())
    with pytest.raises(ReadError) as refused:
        read_blocks(path, columns={"force": "D* [N]"})
    (problem,) = refused.value.problems
    assert problem.allowed == "Time [s], F1 [N], #3, F3 [N]"
