"""What happens beside a command: the system asks it to end, or a kept result turns out to be damaged."""

from __future__ import annotations

import os
import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tribo.store.kept_results import DamagedResultWarning


@contextmanager
def damage_said(say: Callable[[str], None]) -> Iterator[None]:
    """Say it as a line where a kept result is damaged and made again; other warnings are shown as ever."""
    with warnings.catch_warnings():
        shown = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *more: Any, **named: Any) -> None:
            if issubclass(category, DamagedResultWarning):
                say(f"warning: {message}")
            else:
                shown(message, category, *more, **named)

        warnings.showwarning = show
        yield


@contextmanager
def ended_by_terminate() -> Iterator[None]:
    """Let SIGTERM end the command as Ctrl-C does, so that nothing is left half written.

    Further ones are ignored: a build and Snakemake both ask a step to end, and the second request must not interrupt
    the removal of unfinished files.
    """
    process = os.getpid()

    def interrupt(number: int, _: Any) -> None:
        signal.signal(number, signal.SIG_IGN)
        if os.getpid() != process:  # a forked worker tidies up and ends; the command speaks for all
            raise SystemExit(128 + number)
        raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGTERM, interrupt)
    except ValueError:  # not in the main thread, where signals arrive
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
