"""The command line: one module per group of commands, each thin."""

from tribo.cli.commands import main as main
