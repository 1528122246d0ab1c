"""Commands run in this process, and what a folder holds before and after them."""

from __future__ import annotations

import hashlib
from pathlib import Path

from click.testing import CliRunner, Result

from tribo.cli import main


def run(*arguments: object) -> Result:
    """One command, with its standard output and standard error apart; an error of Python fails the test."""
    result = CliRunner().invoke(main, [str(a) for a in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def digest(folder: Path) -> dict[str, str]:
    """Every file of a folder, hidden ones included, and the SHA-256 of what is in it."""
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}
