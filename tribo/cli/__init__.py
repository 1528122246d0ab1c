"""The command line: one module per group of commands, each thin."""

from __future__ import annotations

from tribo.cli.commands import main as main



