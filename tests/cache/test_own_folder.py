"""A folder of results has one writer, and is known as tribo's own also after a kill."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tribo.errors import CampaignError
from tribo.own_folder import RECORD, BusyError, only_writer_of, own_folder, recorded_outputs

HOLDER = """
import sys, time
from pathlib import Path
from tribo.own_folder import own_folder
out = Path({out!r})
with own_folder(out, shared={shared}):
    (out / "kept").mkdir(exist_ok=True)
    (out / "kept" / ".diagnosis.json.12.part").write_text("half")
    (out / "tests.csv").write_text("half a study")
    print("holding", flush=True)
    time.sleep(60)
"""


def holder(out: Path, shared: bool = False) -> subprocess.Popen[str]:
    """Another process that holds the folder, and has written into it."""
    command = [sys.executable, "-c", HOLDER.format(out=str(out), shared=shared), "report", "the campaign"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "holding\n"
    return process


def killed(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate()


def test_a_record_that_cannot_be_read_is_not_taken_for_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(self: Path, **_: object) -> str:
        raise OSError(errno.EIO, "Input/output error")

    (tmp_path / RECORD).write_text("{}")
    monkeypatch.setattr(Path, "read_text", failing)
    with pytest.raises(OSError, match="Input/output") as why:
        recorded_outputs(tmp_path)
    assert why.value.filename == str(tmp_path / RECORD)


def test_a_second_writer_is_told_the_first_one(tmp_path: Path) -> None:
    first = holder(tmp_path / "out")
    try:
        with pytest.raises(BusyError) as refused, own_folder(tmp_path / "out"):
            pass
    finally:
        killed(first)
    (problem,) = refused.value.problems
    assert problem.file == str(tmp_path / "out")
    assert f"process {first.pid} on {os.uname().nodename}, since 2" in str(problem.found)
    assert "tribo report 'the campaign'" in str(problem.found)


def test_a_second_writer_waits_as_long_as_it_is_told_to(tmp_path: Path) -> None:
    first = holder(tmp_path / "out")
    threading.Timer(0.5, first.kill).start()
    with own_folder(tmp_path / "out", wait_s=60):
        first.communicate()
        assert first.returncode == -signal.SIGKILL


def test_those_who_share_a_folder_do_not_wait_for_each_other_but_keep_others_out(tmp_path: Path) -> None:
    first = holder(tmp_path / "out", shared=True)
    (tmp_path / "out" / "tests.csv").unlink()
    try:
        with own_folder(tmp_path / "out", shared=True):
            pass
        with pytest.raises(BusyError), own_folder(tmp_path / "out"):
            pass
    finally:
        killed(first)


def test_a_folder_of_a_killed_writer_is_taken_and_cleared_of_its_leftovers(tmp_path: Path) -> None:
    killed(holder(tmp_path / "out"))
    with own_folder(tmp_path / "out"):
        assert not list((tmp_path / "out").rglob("*.part"))
    assert [p.name for p in (tmp_path / "out").iterdir() if p.name.startswith(".")] == []


def test_forked_workers_do_not_hold_the_lock_of_a_killed_writer(tmp_path: Path) -> None:
    script = (
        "import os, time\nfrom pathlib import Path\nfrom tribo.own_folder import own_folder\n"
        f"with own_folder(Path({str(tmp_path / 'out')!r})):\n"
        "    child = os.fork()\n    if child: print(child, flush=True)\n    time.sleep(60)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    worker = int(process.stdout.readline())
    process.kill()
    process.wait()
    process.stdout.close()
    try:
        with own_folder(tmp_path / "out", wait_s=20.0):  # the worker may just be letting go
            pass
    finally:
        os.kill(worker, signal.SIGKILL)


def write_text_and_fail(out: Path) -> None:
    (out / "tests.csv").write_text("half a study")
    out.read_bytes()


def test_an_error_leaves_the_mark_where_results_have_begun(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError), own_folder(tmp_path / "out"):
        write_text_and_fail(tmp_path / "out")
    with own_folder(tmp_path / "out"):
        pass
    with pytest.raises(CampaignError, match="not written"), own_folder(tmp_path / "out"):
        pass  # the run before ended without a record, so that the table is of unknown origin


def test_a_folder_with_nothing_but_kept_results_is_known(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    for name in ("calibration.json", "F@18180Pa-0123456789abcdef.nc"):
        (tmp_path / "kept" / name).touch()
    with own_folder(tmp_path):
        pass
    (tmp_path / "kept" / "letter.txt").touch()
    with pytest.raises(CampaignError, match="kept"), own_folder(tmp_path):
        pass


def test_an_error_of_the_system_at_a_lock_names_the_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fchmod", full)
    with pytest.raises(OSError, match="No space left") as found, only_writer_of(tmp_path / "runs.nc"):
        pass
    assert found.value.filename == str(tmp_path / ".runs.nc.lock")
