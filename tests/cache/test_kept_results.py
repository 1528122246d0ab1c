"""A kept result is given again only if everything it was made from is the same."""

from __future__ import annotations

import errno
import json
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tribo.kept_results import (
    DamagedResultWarning,
    decoded,
    encoded,
    fingerprint,
    kept_or_made,
    package_sources,
    sources,
)
from tribo.records import LawFit

FIT = LawFit(
    "B", "static", "coulomb_adhesion", ("mu", "tau0_Pa"), np.array([4.0, 2e4]), np.diag([0.1, 1e6]), 2.0, 3, 12,
    "specimens", 1.1, 55e-6, {"B1": np.array([4.1, 1.9e4])}, ("a note",),
)  # fmt: skip


def counted(folder: Path | None, made_from: object) -> tuple[object, int]:
    """What is kept or made, and how often it had to be made."""
    made = []

    def make() -> object:
        made.append(1)
        return {"fit": FIT, "of": (1, float("nan"), None, True)}

    return kept_or_made(folder, "result", made_from, make, ("laws",)), len(made)


def test_the_same_inputs_give_the_kept_result_and_others_a_new_one(tmp_path: Path) -> None:
    folder = tmp_path
    keys = ([FIT, 1], [FIT, 1], [replace(FIT, dof=3.0), 1], [FIT, 1])
    assert [counted(folder, key)[1] for key in keys] == [1, 0, 1, 1]


def test_one_changed_number_in_an_array_is_another_input() -> None:
    nudged = replace(FIT, values=np.nextafter(FIT.values, np.inf))
    assert fingerprint(FIT) == fingerprint(replace(FIT, values=FIT.values.copy())) != fingerprint(nudged)


def test_where_a_campaign_lies_does_not_matter_and_what_is_in_it_does() -> None:
    assert fingerprint(Path("a"), 1) == fingerprint(Path("b"), 1) != fingerprint(Path("a"), 2)


def test_a_table_with_other_numbers_or_names_is_another_input() -> None:
    table = pd.DataFrame({"x": [1.0, 2.0], "name": ["a", "b"]})
    others = [table.rename(columns={"x": "y"}), table.assign(x=[1.0, 3.0]), table.assign(name=["a", "c"])]
    assert len({fingerprint(t) for t in (table, table.copy(), *others)}) == 4


def test_an_edit_of_a_source_is_another_input(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "laws").mkdir()
    source = tmp_path / "laws" / "one.py"
    monkeypatch.setattr("tribo.kept_results._PACKAGE", tmp_path)
    seen = []
    for text in ("a = 1", "a = 2"):
        source.write_text(text)
        sources.cache_clear()
        seen.append(sources("laws"))
    sources.cache_clear()
    assert seen[0] != seen[1]


def test_records_arrays_and_tables_come_back_equal_through_json() -> None:
    table = pd.DataFrame({"x": [1.0, np.nan], "n": [1, 2], "name": ["a", "b"]})
    value = {"fit": FIT, "table": table, ("a", 1): [np.arange(6).reshape(2, 3), np.float64(0.1), "text", None]}
    back = decoded(json.loads(json.dumps(encoded(value))))
    assert fingerprint(back["fit"]) == fingerprint(FIT)
    pd.testing.assert_frame_equal(back["table"], table)
    array, number, text, nothing = back["a", 1]
    assert array.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert (number, text, nothing) == (0.1, "text", None)


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"{}", b"\xff", b'{"made_from": "1", "result": 1}'])
def test_a_damaged_file_is_made_anew_and_said(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "result.json").write_bytes(content)
    with pytest.warns(DamagedResultWarning, match=r"result\.json: this kept result is damaged"):
        assert counted(tmp_path, 1)[1] == 1
    assert counted(tmp_path, 1)[1] == 0


def test_a_file_that_cannot_be_read_is_made_anew_and_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(self: Path) -> bytes:
        raise OSError(errno.EIO, "Input/output error", str(self))

    counted(tmp_path, 1)
    monkeypatch.setattr(Path, "read_bytes", failing)
    with pytest.warns(DamagedResultWarning, match=r"result\.json: .* cannot be read \(Input/output error\)"):
        assert counted(tmp_path, 1)[1] == 1


def test_every_flipped_bit_of_a_kept_file_is_noticed(tmp_path: Path) -> None:
    expected = fingerprint(counted(tmp_path, 1)[0])
    path = tmp_path / "result.json"
    intact = path.read_bytes()
    rng = np.random.default_rng(5)
    for place in rng.choice(8 * len(intact), 300, replace=False):
        damaged = bytearray(intact)
        damaged[place // 8] ^= 1 << (place % 8)
        path.write_bytes(bytes(damaged))
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            result, made = counted(tmp_path, 1)
        assert made == 1, place
        assert fingerprint(result) == expected


def test_a_result_of_other_sources_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path
    made = []
    for text in ("before the edit", "before the edit", "after it"):
        monkeypatch.setattr("tribo.kept_results.sources", lambda *code, text=text: text)
        made.append(counted(folder, 1)[1])
    assert made == [1, 0, 1]


def test_no_function_of_others_comes_back() -> None:
    with pytest.raises(TypeError, match="no function of tribo"):
        decoded({"function": "os:walk"})


@pytest.mark.parametrize("place", ["os:PathLike", "tribo.kept_results:json", "tribo.files:os"])
def test_nothing_but_records_of_tribo_is_ever_constructed(place: str) -> None:
    with pytest.raises(TypeError, match="no record of tribo"):
        decoded({"record": place, "fields": []})


def test_what_cannot_be_kept_is_given_all_the_same_and_said_aloud(tmp_path: Path) -> None:
    thing = object()
    with pytest.warns(RuntimeWarning, match="x is not kept: a object cannot be kept"):
        assert kept_or_made(tmp_path, "x", 1, lambda: thing) is thing
    assert list(tmp_path.iterdir()) == []


def test_without_a_folder_everything_is_made() -> None:
    assert [counted(None, 1)[1] for _ in range(2)] == [1, 1]


def test_the_digest_of_the_package_changes_with_any_of_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "templates").mkdir()
    (tmp_path / "law.py").write_text("A = 1\n")
    (tmp_path / "templates" / "page.html").write_text("<p>")
    monkeypatch.setattr("tribo.kept_results._PACKAGE", tmp_path)
    seen = set()
    for name, text in (("law.py", "A = 1\n"), ("law.py", "A = 2\n"), ("templates/page.html", "<q>")):
        (tmp_path / name).write_text(text)
        package_sources.cache_clear()
        seen.add(package_sources())
    package_sources.cache_clear()
    assert len(seen) == 3


def test_the_digest_of_the_package_changes_with_the_table_of_pattern_shares(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "data" / "pattern_shares"
    folder.mkdir(parents=True)
    (tmp_path / "tribo").mkdir()
    monkeypatch.setattr("tribo.kept_results._PACKAGE", tmp_path / "tribo")
    monkeypatch.setattr("tribo.kept_results.data_dir", lambda: tmp_path / "data")
    seen = set()
    for number in (1, 2):
        (folder / "laws.csv").write_text(f"mu\n{number}\n")
        package_sources.cache_clear()
        seen.add(package_sources())
    package_sources.cache_clear()
    assert len(seen) == 2


def test_what_is_at_several_places_is_written_once_and_comes_back_as_one() -> None:
    shared = np.arange(1000.0)
    value = {"first": [shared, FIT, {"deep": (FIT, shared)}], "table": pd.DataFrame({"x": shared}), "last": FIT}
    text = json.dumps(encoded(value))
    back = decoded(json.loads(text))
    assert len(text) < 1.2 * len(json.dumps([encoded(shared), encoded(FIT), encoded(shared.copy())]))
    assert back["last"] is back["first"][1] is back["first"][2]["deep"][0]
    assert back["first"][0] is back["first"][2]["deep"][1]
    assert fingerprint(back) == fingerprint(value)


def test_the_sources_that_decide_kept_results_are_there() -> None:
    from tribo.comparison.prediction import SOURCES
    from tribo.report.drawings import DRAWN_BY, SET_BY
    from tribo.stages import ASSESSED_BY, DIAGNOSED_BY

    for code in (SOURCES, DRAWN_BY, SET_BY, ASSESSED_BY, DIAGNOSED_BY):
        assert not isinstance(code, str)
        assert sources(*code) != sources()
    with pytest.raises(OSError, match=r"no_such_room\.py"):
        sources("no_such_room")
