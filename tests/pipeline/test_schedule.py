"""The printed units are what systemd accepts, and the cron line runs, notices a failure, and passes over the rest."""

from __future__ import annotations

import configparser
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from tribo.errors import TriboError
from tribo.pipeline.schedule import Schedule, cron_line, in_words, units

ODD = "my drop 100% $HOME \"x\" 'y'"


def schedule(tmp_path: Path, notify: str = "cat > told") -> Schedule:
    return Schedule.checked(tmp_path / ODD, tmp_path / "the site", at="6:05", keep=4, notify=notify)


@pytest.mark.parametrize("notify", ["", "cat > told"])
def test_systemd_accepts_the_units(tmp_path: Path, notify: str) -> None:
    analyze = shutil.which("systemd-analyze")
    if analyze is None:
        pytest.skip("no systemd-analyze here")
    texts = units(schedule(tmp_path, notify))
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    env = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path), "SYSTEMD_LOG_TARGET": "console"}
    command = [analyze, "verify", "--user", "--man=no", *texts]
    seen = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=env, check=False)
    ours = [line for line in seen.stderr.splitlines() if any(name in line for name in texts)]
    assert ours == []
    assert seen.returncode == 0


def test_the_units_build_that_folder_at_that_time_and_tell_of_a_failure(tmp_path: Path) -> None:
    found = {}
    for name, text in units(schedule(tmp_path)).items():
        parser = configparser.ConfigParser(interpolation=None, delimiters=("=",))
        parser.optionxform = str  # type: ignore[assignment,method-assign]
        parser.read_string(text)
        found[name.rsplit("-", 1)[-1].split(".", 1)[1] if "failed" not in name else "failed"] = parser
    assert found["timer"]["Timer"]["OnCalendar"] == "*-*-* 06:05:00"
    service = found["service"]
    assert service["Service"]["SuccessExitStatus"] == "3 75"
    assert service["Unit"]["OnFailure"].endswith("-failed.service")
    assert '"my drop' in service["Service"]["ExecStart"].replace(str(tmp_path) + "/", "")
    assert "100%% $$HOME" in service["Service"]["ExecStart"]
    assert '"--keep" "4"' in service["Service"]["ExecStart"]
    assert "cat > told" in found["failed"]["Service"]["ExecStart"]


@pytest.mark.parametrize(("status", "told"), [(0, False), (3, False), (75, False), (1, True)])
def test_the_cron_line_tells_of_a_failure_and_of_nothing_else(tmp_path: Path, status: int, told: bool) -> None:
    class Pretend(Schedule):
        @property
        def command(self) -> list[str]:
            return [sys.executable, "-c", f"print('the end'); raise SystemExit({status})"]

    wanted = schedule(tmp_path, 'sh -c "cat > told; echo $1 >> told"')
    line = cron_line(Pretend(**{name: getattr(wanted, name) for name in wanted.__dataclass_fields__}))
    minute, hour, *rest, command = line.rstrip("\n").split(" ", 5)
    assert (minute, hour, rest) == ("5", "6", ["*", "*", "*"])
    subprocess.run(["/bin/sh", "-c", command.replace(r"\%", "%")], cwd=tmp_path, check=False)
    assert (tmp_path / "told").is_file() == told
    if told:
        assert (tmp_path / "told").read_text().splitlines() == ["the end", wanted.name]


def test_cron_takes_the_whole_line_since_every_percent_sign_is_escaped(tmp_path: Path) -> None:
    line = cron_line(schedule(tmp_path))
    assert line.count("\n") == 1
    assert line.count("%") == line.count(r"\%") > 0


def test_two_sites_have_two_names(tmp_path: Path) -> None:
    one = schedule(tmp_path)
    assert one.name != replace(one, site=tmp_path / "elsewhere" / "the site").name
    assert all(name in in_words({**units(one), "crontab": cron_line(one)}) for name in units(one))


def test_every_fault_of_a_schedule_is_listed_at_once(tmp_path: Path) -> None:
    with pytest.raises(TriboError) as found:
        Schedule.checked(tmp_path, tmp_path, at="25:00", notify="x", mail="nobody")
    assert [p.kind for p in found.value.problems] == ["not_a_time", "not_an_address", "two_notices"]
