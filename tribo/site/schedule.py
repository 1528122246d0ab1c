"""systemd units and a cron line that build a folder of campaigns every day. Nothing is installed."""

from __future__ import annotations

import hashlib
import re
import shlex
import sys
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from tribo.errors import Problem, TriboError

LEFT_OR_SET_ASIDE = "3 75"  # some campaigns postponed or unusable, or another build running: no failure
_LABEL = r"[A-Za-z0-9](?:[A-Za-z0-9-]*[A-Za-z0-9])?"
_ADDRESS = re.compile(rf"[A-Za-z0-9][A-Za-z0-9._+-]*@{_LABEL}(?:\.{_LABEL})*")
_TIME = re.compile(r"([01]?[0-9]|2[0-3]):([0-5][0-9])")
_BREAKS_LINES = ("Cc", "Cs", "Zl", "Zp")  # control characters, bytes that are no UTF-8, line and paragraph separators


def daily_build(
    drop: Path, site: Path, *, at: str = "06:00", keep: int = 10, notify: str = "", mail: str = ""
) -> dict[str, str]:
    """Texts that build a folder of campaigns every day: the systemd units by file name, and the line for "crontab".

    Parameters
    ----------
    drop, site : Path
        Folder of campaigns, and folder of the site.
    at : str
        Time of day, HH:MM.
    keep : int
        Number of dated builds that stay.
    notify : str
        Shell command on failure.
    mail : str
        Address that is told of a failure, instead of ``notify``.

    Raises
    ------
    TriboError
        ``at`` is no time of day, ``mail`` no address, ``notify`` no complete command, both a command and a mail address
        are given, or one of the texts contains a character that would end a line.
    """
    time = _TIME.fullmatch(at)
    problems = []
    if time is None:
        what, allowed = "not a time of day", "00:00 to 23:59"
        problems = [Problem("not_a_time", what, column="--at", found=at, allowed=allowed)]
    drop, site = drop.resolve(), site.resolve()
    texts = {"DROP": str(drop), "--site": str(site), "--notify": notify, "--mail": mail}
    problems += [p for option, text in texts.items() for p in _line_breaks(option, text)]
    if mail and not _ADDRESS.fullmatch(mail):
        what = "not a mail address"
        problems.append(Problem("not_an_address", what, column="--mail", found=mail, allowed="name@domain"))
    if not _is_whole_command(notify):
        what, allowed = "not a complete command", "a command with all its quotes closed"
        problems.append(Problem("not_a_command", what, column="--notify", found=notify, allowed=allowed))
    if mail and notify:
        problems.append(Problem("two_notices", "give only one of these options", allowed="--notify or --mail"))
    if problems or time is None:
        raise TriboError(problems)
    notice = f'mail -s "tribo: $1 failed" {mail}' if mail else notify
    stem = re.sub(r"[^A-Za-z0-9]+", "-", site.name).strip("-") or "site"
    name = f"tribo-{stem}-{hashlib.sha256(str(site).encode()).hexdigest()[:6]}"  # one for each site
    command, hour, minute = build_command(drop, site, keep), int(time[1]), int(time[2])
    build = f"Description=Friction reports of {_unit_text(str(drop))}"
    return {
        **_units(name, build, command, f"{hour:02d}:{minute:02d}", notice),
        "crontab": f"{minute} {hour} * * * {_for_cron(_build_and_tell(name, site, command, notice))}\n",
    }


def build_command(drop: Path, site: Path, keep: int) -> list[str]:
    """The build command, with this installation of tribo. The lock of the site prevents simultaneous builds."""
    tribo = [sys.executable, "-P", "-m", "tribo"]  # -P: nothing is imported from the folder it happens to start in
    return [*tribo, "build", str(drop), "-o", str(site), "--keep", str(keep), "--quiet"]


def _line_breaks(option: str, text: str) -> Iterator[Problem]:
    """A unit or crontab is read line by line, so that a text with a line end in it would add lines of its own."""
    if any(unicodedata.category(character) in _BREAKS_LINES for character in text):
        what = "this text contains a line end, another control character, or bytes that are not UTF-8"
        yield Problem("control_character", what, column=option, found=text, allowed="one line of text")


def _is_whole_command(notify: str) -> bool:
    try:
        return bool(shlex.split(notify)) or not notify
    except ValueError:
        return False


def _units(name: str, build: str, command: Sequence[str], at: str, notice: str) -> dict[str, str]:
    """Texts of the systemd units by file name: service, timer, and the failure notice where one is wanted."""
    told = f"OnFailure={name}-failed.service\n" if notice else ""
    service = (
        f"[Unit]\n{build}\n{told}\n"
        f"[Service]\nType=oneshot\nExecStart={' '.join(map(_unit_quoted, command))}\n"
        f"SuccessExitStatus={LEFT_OR_SET_ASIDE}\nNice=10\nTimeoutStartSec=12h\n"
    )
    timer = (
        f"[Unit]\nDescription=Friction reports every day\n\n"
        f"[Timer]\nOnCalendar=*-*-* {at}:00\nPersistent=true\n\n"
        "[Install]\nWantedBy=timers.target\n"
    )
    found = {f"{name}.service": service, f"{name}.timer": timer}
    if notice:
        # the command gets the unit's name as $1 and its last lines on standard input
        hook = 'journalctl --user -u "$1" -n 40 --no-pager | /bin/sh -c "$2" sh "$1"'
        words = ["/bin/sh", "-c", hook, "sh", f"{name}.service", notice]
        found[f"{name}-failed.service"] = (
            f"[Unit]\nDescription=Notice that {name} failed\n\n"
            f"[Service]\nType=oneshot\nExecStart={' '.join(map(_unit_quoted, words))}\n"
        )
    return found


def _unit_text(text: str) -> str:
    r"""A text of a unit as it is; in quotes, because a line that ends in ``\`` would go on in the next one."""
    return '"' + text.replace("%", "%%") + '"'


def _unit_quoted(word: str) -> str:
    """A word of ExecStart: quoted, with the characters that systemd would expand taken as they are."""
    escaped = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{escaped}"'


def _build_and_tell(name: str, site: Path, command: Sequence[str], notice: str) -> str:
    """A build for the shell; the notice of a failure gets its last lines on standard input."""
    log = site / ".tribo" / "cron.log"
    folder, file = shlex.quote(str(log.parent)), shlex.quote(str(log))
    told = f"tail -n 40 {file} | /bin/sh -c {shlex.quote(notice)} sh {name}" if notice else "exit $s"
    return f"mkdir -p {folder}; {shlex.join(command)} > {file} 2>&1; s=$?; case $s in 0|3|75) ;; *) {told};; esac"


def _for_cron(line: str) -> str:
    r"""A shell command as a crontab holds it: cron ends the command at a bare ``%``, and reads ``\%`` as ``%``.

    ``\`` before ``%`` has no spelling in a crontab. Where it occurs, the command is quoted as one word, in which the
    two can be kept apart by a pair of quotes.
    """
    if r"\%" not in line:
        return line.replace("%", r"\%")
    return "/bin/sh -c " + shlex.quote(line).replace("%", r"''\%")


def in_words(texts: Mapping[str, str]) -> str:
    """The texts one after the other, with instructions."""
    names = [name for name in texts if name != "crontab"]
    timer = next(name for name in names if name.endswith(".timer"))
    parts = [f"# --- ~/.config/systemd/user/{name}\n{texts[name]}" for name in names]
    parts.append(
        f"# then: systemctl --user daemon-reload && systemctl --user enable --now {timer}\n"
        "# (loginctl enable-linger keeps it running while you are logged out)\n"
    )
    parts.append(f"# --- or one line for crontab -e\n{texts['crontab']}")
    return "\n".join(parts)
