"""Directives that write parts of the reference from the program itself, so that they cannot grow stale.

``{tribo-commands}``: every command with its options. ``{tribo-csv} FUNCTION``: a table that a function of tribo
returns. ``{tribo-register} NAME``: the entries of a table of the program (laws, mechanisms, rules, readers).
``{tribo-outputs}``: the files that tribo writes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from typing import Any, ClassVar

import click
from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Written(SphinxDirective):
    """A directive whose content is MyST text that it makes up itself."""

    def text(self) -> Iterable[str]:
        raise NotImplementedError

    def run(self) -> list[nodes.Node]:
        lines = list(self.text())
        section = nodes.section()
        section.document = self.state.document
        self.state.nested_parse(StringList(lines, source=self.env.docname), 0, section, match_titles=True)
        return section.children


class Commands(Written):
    """Every command of tribo, with its help and options as the program prints them."""

    def text(self) -> Iterator[str]:
        from tribo.cli import main

        for path, command in sorted(_commands(main, ("tribo",))):
            context = click.Context(command, info_name=" ".join(path), terminal_width=100, max_content_width=100)
            yield from (f"## {' '.join(path)}", "", "```text", *command.get_help(context).splitlines(), "```", "")


def _commands(group: click.Group, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    for name, command in group.commands.items():
        if isinstance(command, click.Group):
            yield from _commands(command, (*path, name))
        else:
            yield (*path, name), command


class Table(Written):
    """A table that a function of tribo returns."""

    required_arguments = 1

    def text(self) -> Iterator[str]:
        module, _, name = self.arguments[0].rpartition(".")
        table = getattr(import_module(module), name)()
        yield from _rows(list(table.columns), table.astype(str).itertuples(index=False))


class Register(Written):
    """The entries of a table of the program, with some of their fields."""

    required_arguments = 1
    option_spec: ClassVar[dict[str, Any]] = {"fields": str}

    def text(self) -> Iterator[str]:
        module, _, name = self.arguments[0].rpartition(".")
        fields = self.options["fields"].split()
        entries: dict[str, Any] = getattr(import_module(module), name)
        yield from _rows(["name", *fields], ([key, *(getattr(e, f) for f in fields)] for key, e in entries.items()))


class Outputs(Written):
    """The files of a folder of results, or with the argument ``columns`` the columns of its tables."""

    optional_arguments = 1

    def text(self) -> Iterator[str]:
        from tribo.outputs import PRODUCTS, unit_of

        for product in PRODUCTS:
            if not self.arguments:
                yield from (f"`{product.name}`", f": {product.text}", "")
            elif product.columns:
                yield from (f"### {product.name} (stage {product.stage})", "")
                columns = product.columns.items()
                yield from _rows(["column", "unit", "text"], ((c, unit_of(c) or "", text) for c, text in columns))


def _rows(names: Sequence[str], rows: Iterable[Iterable[object]]) -> Iterator[str]:
    yield f"| {' | '.join(names)} |"
    yield f"|{'---|' * len(names)}"
    for row in rows:
        yield f"| {' | '.join(_cell(value) for value in row)} |"
    yield ""


def _cell(value: object) -> str:
    text = ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
    for mark in ("|", "_", "*", "<"):
        text = text.replace(mark, f"\\{mark}")
    return " ".join(text.split())


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directives."""
    app.add_directive("tribo-commands", Commands)
    app.add_directive("tribo-csv", Table)
    app.add_directive("tribo-register", Register)
    app.add_directive("tribo-outputs", Outputs)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
