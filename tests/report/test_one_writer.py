"""Two reports into one folder of results: the second is refused with the name of the first, and nothing is mixed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from tribo.cache.own_folder import PRODUCTS, own_folder
from tribo.cli import main

HOLDER = "from pathlib import Path\nfrom tribo.cache.own_folder import own_folder\nwith own_folder(Path({out!r})):\n    print('holding', flush=True)\n    input()\n"  # noqa: E501


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


def test_every_file_of_results_is_known_as_one(small_campaign: Path, tmp_path: Path) -> None:
    with own_folder(tmp_path / "out"):
        pass
    said = CliRunner().invoke(main, ["fit", str(small_campaign), "-o", str(tmp_path / "out")])
    assert said.exit_code == 0
    record = json.loads((tmp_path / "out" / "provenance.json").read_text())
    assert {name for name in record["outputs"] if "/" not in name} <= PRODUCTS
