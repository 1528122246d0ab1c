"""Commands end with a sentence, and never with a traceback, where a stream, /proc or the name of a path is missing."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from on_the_command_line import run
from support import first_quick
from support.sled import SledDesign, SledLaw, write_campaign

from tribo.cli.console import fixed_date

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="devices and shells of Linux")
TOML = """\
[campaign]
title = "small"
material = "PDMS"
nominal_area_mm2 = 55.0
slider_mass_g = 1.5
[patterns.F]
cavity = "none"
"""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("streams") / "campaign"
    design = SledDesign({"F": SledLaw(4.8, 23e3, 2.9, 12e3)}, masses_g=(25.0, 138.5), specimens=2, repeats=1)
    write_campaign(folder, design, TOML, seed=7)
    return folder


def started(campaign: str | Path, out: str | Path, streams: str) -> subprocess.CompletedProcess[bytes]:
    words = [sys.executable, "-m", "tribo", "ingest", str(campaign), "-o", str(out), "--jobs", "1"]
    arguments = [os.fsencode(word) for word in words]
    return subprocess.run(["bash", "-c", f'"$@" {streams}', "bash", *arguments], capture_output=True, check=False)


@pytest.mark.parametrize(
    ("streams", "status", "said"),
    first_quick(
        [(">&-", 0, "standard output is closed: the result is not shown"),
         (">/dev/full", 1, "standard output, after all files were written: no space left on device"),
         ("2>&-", 0, ""), (">&- 2>&- <&-", 0, ""), ("2>/dev/full", 0, ""), (">/dev/full 2>/dev/full", 1, "")], 2
    ),
)  # fmt: skip
def test_a_stream_that_is_closed_or_full_costs_no_file_of_results(
    campaign: Path, tmp_path: Path, streams: str, status: int, said: str
) -> None:
    ended = started(campaign, tmp_path / "out", streams)
    assert ended.returncode == status, ended.stderr
    assert said in ended.stderr.decode()
    assert b"Traceback" not in ended.stderr + ended.stdout
    assert b"Exception ignored" not in ended.stderr
    rows = (tmp_path / "out" / "tests.csv").read_text().splitlines()
    assert len(rows) == 5
    assert (tmp_path / "out" / "campaign.nc").read_bytes()[:4] == b"\x89HDF"
    assert (tmp_path / "out" / "provenance.json").is_file()


@pytest.mark.parametrize("place", ["campaign", "out"])
def test_a_path_that_is_not_utf8_is_refused_in_a_sentence(campaign: Path, tmp_path: Path, place: str) -> None:
    odd = os.fsdecode(os.fsencode(tmp_path) + b"/pr\xfcfung")
    if place == "campaign":
        shutil.copytree(campaign, odd)
    given = (odd, tmp_path / "out") if place == "campaign" else (campaign, odd)
    ended = started(*given, "")
    assert ended.returncode == 1
    assert b"this path is not UTF-8; rename its folder or file" in ended.stderr
    assert b"Traceback" not in ended.stderr


@pytest.mark.slow
@pytest.mark.skipif(getattr(os, "getuid", lambda: 1)() != 0, reason="only root can hide /proc")
def test_tests_are_read_where_there_is_no_proc(campaign: Path, tmp_path: Path) -> None:
    command = f"mount -t tmpfs none /proc && {sys.executable} -m tribo ingest {campaign} -o {tmp_path}/out"
    ended = subprocess.run(["unshare", "-m", "sh", "-c", command], capture_output=True, text=True, check=False)
    if "unshare" in ended.stderr or "mount:" in ended.stderr:
        pytest.skip("no namespace of mounts")
    assert ended.returncode == 0, ended.stderr
    assert "4 pulls" in ended.stdout


@pytest.mark.parametrize("date", ["nonsense", "1e9", "9" * 20])
def test_a_date_of_the_environment_that_is_none_is_told_before_anything_is_read(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, date: str
) -> None:
    """numpy and matplotlib read SOURCE_DATE_EPOCH, too, and would stop in the middle of an export."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", date)
    result = run("fit", campaign, "-o", tmp_path / "out", "-q")
    assert result.exit_code == 1
    assert f"SOURCE_DATE_EPOCH is no time; found '{date}'" in result.stderr
    assert not (tmp_path / "out").exists()


def test_an_empty_date_of_the_environment_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "")
    assert fixed_date() is None
    assert "SOURCE_DATE_EPOCH" not in os.environ


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_a_sign_that_a_stream_cannot_show_costs_no_command(encoding: str) -> None:
    """The minus of typography, say, in the words of a result."""
    code = "from tribo.cli.console import open_streams; open_streams(); print('−5 %')"
    env = {**os.environ, "PYTHONIOENCODING": encoding}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    assert done.stdout == "?5 %\n"
