"""A family of cases that need the same material as one test: it skips once, and reports every case that fails."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any


def in_one_test(cases: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[[Path], None]]:
    """Turn a check of one case, ``check(exports, *case)``, into one test of all cases."""

    listed = list(cases)
    assert listed, "a test without cases checks nothing"

    def decorate(check: Callable[..., None]) -> Callable[[Path], None]:
        def test(exports: Path) -> None:
            failed: list[Exception] = []
            for case in listed:
                values = case if isinstance(case, tuple) else (case,)
                try:
                    check(exports, *values)
                except (Exception, AssertionError) as why:
                    why.add_note(f"case: {values}")
                    failed.append(why)
            if failed:
                raise ExceptionGroup(f"{len(failed)} cases failed", failed)

        test.__name__, test.__doc__, test.__module__ = check.__name__, check.__doc__, check.__module__
        return test

    return decorate
