"""No module outside the library names a mechanism: what is peculiar to a mechanism stands in its own module."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tribo.mechanisms import NAMES

PACKAGE = Path(__file__).resolve().parents[2] / "tribo"
OUTSIDE = [m for m in sorted(PACKAGE.rglob("*.py")) if m.relative_to(PACKAGE).parts[0] != "mechanisms"]
# names of mechanisms that are also those of recorded quantities and of columns of a table
ORDINARY = {"covariate", "temperature", "humidity"}
LOOKED_UP = {"MECHANISMS", "mechanism"}


def mechanisms_named(source: str) -> list[str]:
    """Mechanisms that a module names: in a literal, by an identifier, or by importing from their module.

    A literal counts where it equals a name or begins with ``name:`` or ``name(``. Ordinary words count where something
    is compared with them, or looked up by them in the library.
    """
    tree = ast.parse(source)
    documentation = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documentation:
            found += [n for n in NAMES if node.value.startswith((f"{n}:", f"{n}("))]
            found += [n for n in NAMES if node.value == n and n not in ORDINARY]
        elif isinstance(node, ast.Name | ast.Attribute):
            name = node.id if isinstance(node, ast.Name) else node.attr
            found += [name] if name in NAMES and name not in ORDINARY else []
        elif isinstance(node, ast.ImportFrom | ast.Import):
            found += [n for n in imported(node) if n in NAMES]
        found += [word for word in decided_by(node) if word in ORDINARY]
    return sorted(set(found))


def imported(node: ast.ImportFrom | ast.Import) -> Iterator[str]:
    """Modules below tribo.mechanisms that a statement imports."""
    modules = [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        modules = [node.module or "", *(f"{node.module}.{name}" for name in modules)]
    for module in modules:
        parts = module.split(".")
        if parts[:2] == ["tribo", "mechanisms"] and len(parts) > 2:
            yield parts[2]


def decided_by(node: ast.AST) -> list[str]:
    """Literals that something is compared with, or looked up by in the library."""
    if isinstance(node, ast.Compare):
        return literals(node.left) + [text for part in node.comparators for text in literals(part)]
    if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id in LOOKED_UP:
        return literals(node.slice)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in LOOKED_UP:
        return [text for argument in node.args for text in literals(argument)]
    return []


def literals(node: ast.AST) -> list[str]:
    """A string, or the strings of a tuple, list or set written out."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    if isinstance(node, ast.Tuple | ast.List | ast.Set):
        return [text for element in node.elts for text in literals(element)]
    return []


@pytest.mark.parametrize("module", OUTSIDE, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_a_module_outside_the_library_names_no_mechanism(module: Path) -> None:
    assert mechanisms_named(module.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("source", "seen"),
    [
        ('if m.name == "tilt": pass', ["tilt"]),
        ('BARRED = {"suction": 1}', ["suction"]),
        ('key = f"mislabelled_specimen({other})"', ["mislabelled_specimen"]),
        ('text = f"covariate:{column}"', ["covariate"]),
        ('if name in ("covariate", other): pass', ["covariate"]),
        ('m = MECHANISMS["humidity"]', ["humidity"]),
        ("from tribo.mechanisms.covariate import score", ["covariate"]),
        ("from tribo.mechanisms import tilt", ["tilt"]),
        ("from tribo.mechanisms import MECHANISMS", []),
        ('columns = ["sample", "covariate", "temperature"]\nrow["covariate"] = 1', []),
        ('"""suction: a word in the documentation"""', []),
    ],
)
def test_naming_a_mechanism_is_seen(source: str, seen: list[str]) -> None:
    assert mechanisms_named(source) == seen
