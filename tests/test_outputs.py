"""Every file of results is stated in one place, and nothing else can be written."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pandas as pd
import pytest

from tribo.outputs import PRODUCTS, Product, is_product, product, write
from tribo.report import Provenance
from tribo.report.provenance import read_record, settle_outputs, write_results


@pytest.mark.parametrize("name", ["notes.txt", "tests.xlsx", "more/tests.csv", "law.toml"])
def test_a_file_that_is_not_stated_cannot_be_written(tmp_path: Path, name: str) -> None:
    assert not is_product(name)
    with pytest.raises(LookupError, match=r"outputs\.py"):
        write(tmp_path, name, "text")
    with pytest.raises(LookupError):
        write_results({"card.json": "{}", name: "text"}, tmp_path, Provenance(), "report")
    assert not (tmp_path / name).exists()
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("written past the registry")
    with pytest.raises(LookupError):
        settle_outputs(tmp_path, None, Provenance(), [tmp_path / name], complete=True)
    assert read_record(tmp_path) is None


@pytest.mark.parametrize("columns", [["sample"], [*product("comparison.csv").column_names, "more"]])
def test_a_table_with_other_columns_than_are_stated_cannot_be_written(tmp_path: Path, columns: list[str]) -> None:
    with pytest.raises(ValueError, match=r"comparison\.csv has the columns"):
        write(tmp_path, "comparison.csv", pd.DataFrame(columns=columns))
    assert list(tmp_path.iterdir()) == []


def test_two_commands_may_write_a_file_of_one_name() -> None:
    assert product("laws.csv").column_names != product("laws.csv", "discover").column_names
    names = [(p.name, p.stage) for p in PRODUCTS]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("stated", PRODUCTS, ids=lambda p: f"{p.stage}-{p.name}")
def test_every_product_says_what_it_holds_and_its_writer_exists(stated: Product) -> None:
    assert stated.text
    assert stated.text.endswith(".")
    assert all(stated.columns.values())
    assert set(stated.optional) <= set(stated.column_names)
    if stated.writer:
        module, _, function = stated.writer.partition(":")
        assert callable(getattr(import_module(module), function))
    assert bool(stated.group) == bool(stated.row)
