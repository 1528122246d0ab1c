"""systemd units and a cron line that build a folder of campaigns every day. Nothing is installed."""

from __future__ import annotations

import hashlib
import re
import shlex
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tribo.errors import Problem, TriboError

LEFT_OR_SET_ASIDE = "3 75"  # some campaigns postponed or unusable, or another build running: no failure


@dataclass(frozen=True)
class Schedule:
    """A daily build: absolute folders, hour and minute, number of dated builds, and a shell command on failure."""

    drop: Path
    site: Path
    hour: int
    minute: int
    keep: int
    notify: str

    @classmethod
    def checked(
        cls, drop: Path, site: Path, *, at: str = "06:00", keep: int = 10, notify: str = "", mail: str = ""
    ) -> Schedule:
        """A schedule from the options of the user.

        Raises
        ------
        TriboError
            ``at`` is no time of day, ``mail`` no address, or both a command and a mail address are given.
        """
        problems = []
        time = re.fullmatch(r"([01]?\d|2[0-3]):([0-5]\d)", at)
        if not time:
            what, allowed = "not a time of day", "00:00 to 23:59"
            problems.append(Problem("not_a_time", what, column="--at", found=at, allowed=allowed))
        if mail and not re.fullmatch(r"[\w.+-]+@[\w.-]+", mail):
            problems.append(Problem("not_an_address", "not a mail address", column="--mail", found=mail))
        if mail and notify:
            problems.append(Problem("two_notices", "give only one of these options", allowed="--notify or --mail"))
        if problems or time is None:
            raise TriboError(problems)
        told = f'mail -s "tribo: $1 failed" {mail}' if mail else notify
        return cls(drop.resolve(), site.resolve(), int(time[1]), int(time[2]), keep, told)

    @property
    def name(self) -> str:
        """Name of the units: the same for the same site, another for another one."""
        stem = re.sub(r"[^A-Za-z0-9]+", "-", self.site.name).strip("-") or "site"
        return f"tribo-{stem}-{hashlib.sha256(str(self.site).encode()).hexdigest()[:6]}"

    @property
    def command(self) -> list[str]:
        """The build command, with this installation of tribo. The lock of the site prevents simultaneous builds."""
        tribo = [sys.executable, "-m", "tribo"]
        return [*tribo, "build", str(self.drop), "-o", str(self.site), "--keep", str(self.keep), "--quiet"]


def units(schedule: Schedule) -> dict[str, str]:
    """Texts of the systemd units by file name: service, timer, and the failure notice where one is wanted."""
    name = schedule.name
    told = f"OnFailure={name}-failed.service\n" if schedule.notify else ""
    service = (
        f"[Unit]\nDescription=Friction reports of {_unit_text(str(schedule.drop))}\n{told}\n"
        f"[Service]\nType=oneshot\nExecStart={' '.join(map(_unit_quoted, schedule.command))}\n"
        f"SuccessExitStatus={LEFT_OR_SET_ASIDE}\nNice=10\nTimeoutStartSec=12h\n"
    )
    timer = (
        f"[Unit]\nDescription=Friction reports every day\n\n"
        f"[Timer]\nOnCalendar=*-*-* {schedule.hour:02d}:{schedule.minute:02d}:00\nPersistent=true\n\n"
        "[Install]\nWantedBy=timers.target\n"
    )
    found = {f"{name}.service": service, f"{name}.timer": timer}
    if schedule.notify:
        # the shell gets the unit's name as $1 and its last lines on standard input
        hook = f"journalctl --user -u \"$1\" -n 40 --no-pager | {schedule.notify}"
        words = ["/bin/sh", "-c", hook, "sh", f"{name}.service"]
        found[f"{name}-failed.service"] = (
            f"[Unit]\nDescription=Notice that {name} failed\n\n"
            f"[Service]\nType=oneshot\nExecStart={' '.join(map(_unit_quoted, words))}\n"
        )
    return found


def _unit_text(text: str) -> str:
    return text.replace("%", "%%")


def _unit_quoted(word: str) -> str:
    """A word of ExecStart: quoted, with the characters that systemd would expand taken as they are."""
    escaped = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{escaped}"'


def cron_line(schedule: Schedule) -> str:
    """One line for `crontab -e`; the notice gets the build's last lines on standard input."""
    log = schedule.site / ".tribo" / "cron.log"
    build = f"mkdir -p {_shell(log.parent)}; {shlex.join(schedule.command)} > {_shell(log)} 2>&1; s=$?"
    notice = f"set -- {schedule.name}; tail -n 40 {_shell(log)} | {schedule.notify}" if schedule.notify else "exit $s"
    line = f"{build}; case $s in 0|3|75) ;; *) {notice};; esac"
    escaped = line.replace("%", r"\%")  # cron ends the command at a bare %
    return f"{schedule.minute} {schedule.hour} * * * {escaped}\n"


def _shell(path: Path) -> str:
    return shlex.quote(str(path))


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
