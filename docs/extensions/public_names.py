"""References in docstrings that name an object by the module that defines it.

The pages document objects by their public names, such as ``tribo.read_export``. A reference to
``tribo.readers.reading.read_export`` is linked to that entry. An object without an entry is set as plain code.
A name that does not exist stays a warning.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util.nodes import make_refnode


def found(name: str) -> Any:
    """The object of a dotted name, or None where there is none."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            here: Any = import_module(".".join(parts[:length]))
        except ImportError:
            continue
        for part in parts[length:]:
            here = getattr(here, part, None)
        return here
    return None


def resolve(app: Sphinx, env: BuildEnvironment, node: pending_xref, content: nodes.Element) -> nodes.Node | None:
    """Link a reference to the public entry of its object."""
    target = node.get("reftarget", "")
    wanted = found(target) if node.get("refdomain") == "py" and target.startswith("tribo.") else None
    if wanted is None:
        return None
    last = target.rpartition(".")[2]
    for name, entry in env.domains["py"].data["objects"].items():
        if name.rpartition(".")[2] == last and found(name) is wanted:
            return make_refnode(app.builder, node["refdoc"], entry.docname, entry.node_id, content, name)
    return content


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect the resolver."""
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
