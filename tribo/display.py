"""How records show themselves in Python: a few lines in a console, a small table in a notebook.

The text of a dataclass made by Python repeats every array and every nested record; for a study that is a megabyte.
:func:`displayed` replaces it. For a text that tells any two different records apart, use :func:`exact_text`.
"""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

from tribo.user_text import printable

R = TypeVar("R", bound=type)

MOST_LINES = 36  # of fields; the headline and a line for what is left out come on top
MOST_LETTERS = 78  # of one value
MOST_NAMED = 5  # items of a collection that are named


def displayed(headline: Callable[[Any], str] | None = None) -> Callable[[R], R]:
    """Class decorator, above ``@dataclass``: a short ``repr`` and a table for notebooks.

    ``headline(record)`` is what identifies a record, in a few words; without it, its first text does.
    """

    def dressed(record_class: R) -> R:
        own = headline or _first_plain
        for name, method in {"_headline": lambda record: own(record), "__repr__": _text, "_repr_html_": _table}.items():
            setattr(record_class, name, method)
        return record_class

    return dressed


def exact_text(value: object) -> str:
    """Every field of a record and of all records in it, as text; for other values their ``repr``."""
    if is_dataclass(value) and not isinstance(value, type):
        inside = ", ".join(f"{f.name}={exact_text(getattr(value, f.name))}" for f in fields(value))
        return f"{type(value).__name__}({inside})"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{exact_text(k)}: {exact_text(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "(" + ", ".join(map(exact_text, value)) + ")"
    return repr(value)


def _text(record: Any) -> str:
    rows = shown_fields(record)
    width = max((len(name) for name, _ in rows), default=0)
    return "\n".join([_title(record), *(f"  {name:<{width}}  {text}" for name, text in rows)])


def _table(record: Any) -> str:
    rows = "".join(
        f'<tr><th style="text-align:left">{html.escape(name)}</th>'
        f'<td style="text-align:left">{html.escape(text)}</td></tr>'
        for name, text in shown_fields(record)
    )
    title = f'<caption style="text-align:left"><strong>{html.escape(_title(record))}</strong></caption>'
    return f"<table>{title}<tbody>{rows}</tbody></table>"


def shown_fields(record: Any) -> list[tuple[str, str]]:
    """Name and short text of every field that is not empty; of a record of very many fields the first ones."""
    rows = [(f.name, in_short(getattr(record, f.name))) for f in fields(record)]
    told = [(name, text) for name, text in rows if text]
    if len(told) <= MOST_LINES:
        return told
    return [*told[:MOST_LINES], ("...", f"and {len(told) - MOST_LINES} more fields")]


def _title(record: Any) -> str:
    kind = type(record).__name__
    headline = _cut(record._headline())
    return f"{kind}: {headline}" if headline else kind


def _first_plain(record: Any) -> str:
    """The first field that is a text and not empty."""
    values = (getattr(record, f.name) for f in fields(record))
    return next((v for v in values if isinstance(v, str) and v), "")


def in_short(value: Any) -> str:
    """One line of at most ``MOST_LETTERS`` letters for any value; empty for None, NaN and empty collections."""
    if value is None or isinstance(value, float):
        return "" if value is None or value != value else f"{value:.6g}"
    if isinstance(value, str):
        return _cut(value)
    if hasattr(type(value), "columns") and hasattr(type(value), "index"):
        n = len(value.index)
        return _cut(f"table of {n} row{'' if n == 1 else 's'}: {', '.join(map(str, value.columns))}")
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return _array_in_short(value)
    if isinstance(value, Mapping):
        return _cut(_mapping_in_short(value))
    if isinstance(value, list | tuple | set | frozenset):
        return _cut(_items_in_short(list(value)))
    if hasattr(value, "_headline"):
        return _cut(_title(value))
    if is_dataclass(value) and not isinstance(value, type):
        return _cut(f"{type(value).__name__}: {_first_plain(value)}".removesuffix(": "))
    if callable(value):
        return str(getattr(value, "__name__", type(value).__name__))
    return _cut(str(value))


def _mapping_in_short(value: Mapping[Any, Any]) -> str:
    if not value:
        return ""
    plain = all(isinstance(v, str | int | float) for v in value.values())
    if plain and len(value) <= MOST_NAMED:
        return ", ".join(f"{k} = {in_short(v) or 'nan'}" for k, v in value.items())
    return f"{len(value)}: {_named([str(k) for k in value])}"


def _items_in_short(items: list[Any]) -> str:
    if not items:
        return ""
    if all(isinstance(v, str | int | float) for v in items):
        words = [in_short(v) for v in items]
        return _named([word or "nan" for word in words]) if any(words) else ""
    kinds = {type(v).__name__ for v in items}
    kind = kinds.pop() if len(kinds) == 1 else "items"
    heads = [_cut(v._headline(), 24) for v in items[:MOST_NAMED] if hasattr(v, "_headline")]
    return f"{len(items)} {kind}" + (f": {_named(heads, len(items), '; ')}" if heads else "")


def _named(names: list[str], of: int | None = None, between: str = ", ") -> str:
    more = (len(names) if of is None else of) - min(len(names), MOST_NAMED)
    return between.join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _array_in_short(value: Any) -> str:
    """Shape and range of an array; its numbers where there are few."""
    if value.size == 0:
        return ""
    if value.size <= MOST_NAMED:
        if value.dtype.kind != "f":
            return _cut(str(value.tolist()))
        as_shape = f" as {value.shape}" if value.ndim > 1 else ""
        return _cut("[" + ", ".join(f"{v:.5g}" for v in value.ravel()) + "]" + as_shape)
    shape = " x ".join(map(str, value.shape))
    if value.dtype.kind not in "iuf":
        return _cut(f"array of {shape}, from {value.ravel()[0]!s} to {value.ravel()[-1]!s}")
    finite = value[(value == value) & (abs(value) != float("inf"))]
    reach = f", between {finite.min():.5g} and {finite.max():.5g}" if finite.size else ", no finite number"
    return f"array of {shape}{reach}"




def _cut(text: str, most: int = MOST_LETTERS) -> str:
    """One printable line of at most ``most`` letters."""
    line = " ".join(printable(text).split())
    return line if len(line) <= most else f"{line[: most - 3]}..."
