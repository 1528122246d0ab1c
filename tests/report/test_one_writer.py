"""Two reports into one folder of results: the second is refused with the name of the first, and nothing is mixed."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from tribo.cli import main
from tribo.own_folder import foreign_files

HOLDER = "from pathlib import Path\nfrom tribo.own_folder import own_folder\nwith own_folder(Path({out!r})):\n    print('holding', flush=True)\n    input()\n"  # noqa: E501


@pytest.mark.parametrize("command", ["ingest", "predict", "diagnose", "report"])
def test_a_second_command_into_one_folder_ends_with_status_75(
    small_campaign: Path, tmp_path: Path, command: str
) -> None:
    out = tmp_path / "out"
    script = HOLDER.format(out=str(out))
    with subprocess.Popen(
        [sys.executable, "-c", script, "report"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == "holding\n"
        said = CliRunner().invoke(main, [command, str(small_campaign), "-o", str(out), "--json"])
        first.communicate("\n")
    assert said.exit_code == 75
    (problem,) = json.loads(said.stdout)["problems"]
    assert problem["kind"] == "busy"
    assert f"process {first.pid} on " in problem["found"]


@pytest.fixture(scope="module")
def fitted(small_campaign: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `tribo fit` writes of the small campaign."""
    out = tmp_path_factory.mktemp("fitted") / "out"
    assert CliRunner().invoke(main, ["fit", str(small_campaign), "-o", str(out)]).exit_code == 0
    return out


@pytest.mark.parametrize("name", ["card.json", "diagnosis.csv", "layers.csv", "law-1.toml", "figures/a.svg"])
def test_a_users_own_file_of_the_name_of_a_product_is_not_replaced(
    small_campaign: Path, fitted: Path, tmp_path: Path, name: str
) -> None:
    shutil.copytree(fitted, tmp_path / "out")
    own = tmp_path / "out" / name
    own.parent.mkdir(exist_ok=True)
    own.write_text("not from tribo")
    assert foreign_files(tmp_path / "out") == [name]
    again = CliRunner().invoke(main, ["fit", str(small_campaign), "-o", str(tmp_path / "out")])
    assert again.exit_code == 1
    assert name in again.output
    assert own.read_text() == "not from tribo"
