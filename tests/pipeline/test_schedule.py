"""The printed units are what systemd accepts, and the cron line runs, notices a failure, and passes over the rest.

Whatever folders, commands and addresses are called, they never make lines or options of their own.
"""

from __future__ import annotations

import configparser
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from tribo.errors import TriboError
from tribo.site import schedule
from tribo.site.schedule import build_command, daily_build, in_words

ODD = "my drop 100% $HOME \"x\" 'y'"


def texts_of(tmp_path: Path, notify: str = "cat > told", site: str = "the site") -> dict[str, str]:
    return daily_build(tmp_path / ODD, tmp_path / site, at="6:05", keep=4, notify=notify)


def units(texts: dict[str, str]) -> dict[str, str]:
    return {name: text for name, text in texts.items() if name != "crontab"}


@pytest.mark.parametrize("notify", ["", "cat > told"])
def test_systemd_accepts_the_units(tmp_path: Path, notify: str) -> None:
    analyze = shutil.which("systemd-analyze")
    if analyze is None:
        pytest.skip("no systemd-analyze here")
    texts = units(texts_of(tmp_path, notify))
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
    for name, text in units(texts_of(tmp_path)).items():
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
def test_the_cron_line_tells_of_a_failure_and_of_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: int, told: bool
) -> None:
    ending = [sys.executable, "-c", f"print('the end'); raise SystemExit({status})"]
    monkeypatch.setattr(schedule, "build_command", lambda *_: ending)
    texts = texts_of(tmp_path, 'sh -c "cat > told; echo $1 >> told"')
    minute, hour, *rest, command = texts["crontab"].rstrip("\n").split(" ", 5)
    assert (minute, hour, rest) == ("5", "6", ["*", "*", "*"])
    subprocess.run(["/bin/sh", "-c", command.replace(r"\%", "%")], cwd=tmp_path, check=False)
    assert (tmp_path / "told").is_file() == told
    if told:
        assert (tmp_path / "told").read_text().splitlines() == ["the end", next(iter(texts)).removesuffix(".service")]


def test_cron_takes_the_whole_line_since_every_percent_sign_is_escaped(tmp_path: Path) -> None:
    line = texts_of(tmp_path)["crontab"]
    assert line.count("\n") == 1
    assert line.count("%") == line.count(r"\%") > 0


def test_two_sites_have_two_names(tmp_path: Path) -> None:
    one, other = texts_of(tmp_path), texts_of(tmp_path, site="elsewhere/the site")
    assert not units(one).keys() & units(other).keys()
    assert all(name in in_words(one) for name in units(one))


def test_every_fault_of_a_schedule_is_listed_at_once(tmp_path: Path) -> None:
    with pytest.raises(TriboError) as found:
        daily_build(tmp_path, tmp_path, at="25:00", notify="x", mail="nobody")
    assert [p.kind for p in found.value.problems] == ["not_a_time", "not_an_address", "two_notices"]


def cron_runs(line: str) -> str:
    """What cron hands to the shell: the command up to a bare %, a backslash before % taken away (crontab(5))."""
    command, escaped = "", False
    for character in line.split(" ", 5)[5]:
        if character == "%" and not escaped:
            return command
        command = (command[:-1] if character == "%" else command) + character
        escaped = character == "\\" and not escaped
    return command


def systemd_runs(text: str) -> list[str]:
    """The words of ExecStart as systemd reads them (systemd.service(5), Command lines; systemd.unit(5), Specifiers)."""
    (line,) = [line for line in text.splitlines() if line.startswith("ExecStart=")]
    words = re.findall(r'"((?:[^"\\]|\\["\\])*)"(?: |$)', line.removeprefix("ExecStart="))
    assert "ExecStart=" + " ".join(f'"{word}"' for word in words) == line
    bare = [re.sub(r'\\(["\\])', r"\1", word) for word in words]
    assert not any(re.search(r"%|\$", word.replace("%%", "").replace("$$", "")) for word in bare)
    return [word.replace("%%", "%").replace("$$", "$") for word in bare]


def shell_words(command: str) -> list[str]:
    """The words and operators that a shell sees, one level of `sh -c` opened."""
    words = shlex.split(command)
    return shell_words(words[2]) if words[:2] == ["/bin/sh", "-c"] else words


SHOWN = "ab \\%$\"'`;|&<>()#*?!{}~-=é"
BREAKS = "\n\r\t\x1b\x85\u2028\udc80"
NAMES = st.text(st.sampled_from(SHOWN), min_size=1, max_size=12)
COMMANDS = st.one_of(st.just(""), NAMES.filter(lambda text: is_whole(text)))
IN_TMP_PATH = settings(
    max_examples=300, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def is_whole(command: str) -> bool:
    try:
        return bool(shlex.split(command))
    except ValueError:
        return False


SECTIONS = {
    "service": "[Unit] Description= [Service] Type= ExecStart= SuccessExitStatus= Nice= TimeoutStartSec=",
    "notified": "[Unit] Description= OnFailure= [Service] Type= ExecStart= SuccessExitStatus= Nice= TimeoutStartSec=",
    "timer": "[Unit] Description= [Timer] OnCalendar= Persistent= [Install] WantedBy=",
    "failed": "[Unit] Description= [Service] Type= ExecStart=",
}


def keys(text: str) -> str:
    assert not any(line.endswith("\\") for line in text.splitlines())  # it would go on in the next line
    return " ".join(line.partition("=")[0] + "=" * ("=" in line) for line in text.splitlines() if line)


@IN_TMP_PATH
@given(drop=NAMES, site=NAMES, notify=COMMANDS)
def test_no_name_and_no_command_makes_lines_or_words_of_its_own(
    tmp_path: Path, drop: str, site: str, notify: str
) -> None:
    texts = daily_build(tmp_path / drop, tmp_path / site, notify=notify)
    command = build_command((tmp_path / drop).resolve(), (tmp_path / site).resolve(), 10)
    name = next(iter(texts)).removesuffix(".service")
    service, timer, *failed, line = texts.values()
    assert keys(service) == SECTIONS["notified" if notify else "service"]
    assert keys(timer) == SECTIONS["timer"]
    assert systemd_runs(service) == command
    if notify:
        assert keys(failed[0]) == SECTIONS["failed"]
        assert systemd_runs(failed[0])[3:] == ["sh", f"{name}.service", notify]
    assert len(line.splitlines()) == 1
    words = shell_words(cron_runs(line.rstrip("\n")))
    log = str((tmp_path / site).resolve() / ".tribo" / "cron.log")
    assert words[3 : 3 + len(command)] == command
    told = ["*)", "tail", "-n", "40", log, "|", "/bin/sh", "-c", notify, "sh", f"{name};;"]
    assert words[words.index("*)") :] == ([*told, "esac"] if notify else ["*)", "exit", "$s;;", "esac"])


@pytest.mark.parametrize(
    ("options", "kinds"),
    [
        ({"notify": "true\n* * * * * rm -rf /"}, ["control_character"]),
        ({"notify": "true\rExecStart=evil"}, ["control_character"]),
        ({"notify": "true \u2028evil"}, ["control_character"]),
        ({"notify": "echo 'half"}, ["not_a_command"]),
        ({"notify": "  "}, ["not_a_command"]),
        ({"mail": "-v@x"}, ["not_an_address"]),
        ({"mail": "a@-x"}, ["not_an_address"]),
        ({"mail": "a@x; rm -rf /"}, ["not_an_address"]),
        ({"mail": "a@x\n"}, ["control_character", "not_an_address"]),
        ({"mail": "a@x y"}, ["not_an_address"]),
        ({"mail": "`id`@x"}, ["not_an_address"]),
        ({"mail": "a@ex_ample"}, ["not_an_address"]),
        ({"at": "\u0660\u0666:00"}, ["not_a_time"]),
        ({"at": "06:00\n"}, ["not_a_time"]),
    ],
)
def test_what_is_no_command_address_or_time_is_refused(
    tmp_path: Path, options: dict[str, str], kinds: list[str]
) -> None:
    with pytest.raises(TriboError) as found:
        daily_build(tmp_path, tmp_path, **options)
    assert [p.kind for p in found.value.problems] == kinds


@pytest.mark.parametrize("name", ["a\nExecStart=evil", "a\x1b[31m", "a\udcff"])
def test_a_folder_whose_name_would_end_a_line_is_refused(tmp_path: Path, name: str) -> None:
    for drop, site in ((tmp_path / name, tmp_path), (tmp_path, tmp_path / name)):
        with pytest.raises(TriboError, match="control character"):
            daily_build(drop, site)


@pytest.mark.parametrize("mail", ["lab@example.org", "first.last+tribo@localhost", "a@b-c.d1"])
def test_an_ordinary_mail_address_is_taken(tmp_path: Path, mail: str) -> None:
    assert mail in daily_build(tmp_path, tmp_path, mail=mail)["crontab"]
