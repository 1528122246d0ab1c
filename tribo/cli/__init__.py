"""The command line: one module a group of commands, each thin."""

from tribo.cli.commands import main as main
