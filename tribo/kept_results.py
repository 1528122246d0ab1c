"""Results of costly steps, kept beside the outputs with a hash of everything they were made from.

A step asks for its result by name and gives everything the result is made from. If the file was made from exactly
that, it is read; otherwise the result is computed and written. The hash covers the input values, the sources of the
packages that compute and the versions of the libraries they use, so that no outdated result is returned after an edit
or an upgrade. Each file bears a checksum, and a signature with a key of this user (HMAC, RFC 2104): one that is
damaged, or that another user or machine has made, is said and made again. The files are JSON: deleting one, or the
folder, costs time and nothing else.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import os
import re
import secrets
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from importlib import import_module, metadata
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np

from tribo.files import PATTERN_SHARES, bytes_of, data_dir, found_below, found_in, write_bytes
from tribo.own_folder import only_writer
from tribo.temporary import private_folder

T = TypeVar("T")


class DamagedResultWarning(RuntimeWarning):
    """A kept result differs from its checksum, or cannot be read, and is made again."""


FOREIGN = "was not made by this user on this machine"
KEY, KEY_BYTES, KEY_WAIT_S = "kept-results.key", 32, 30.0
LIBRARIES = ("numpy", "scipy", "pandas", "statsmodels", "numba", "odrpack")
_PACKAGE = Path(__file__).resolve().parent


def kept_or_made(
    folder: Path | None, name: str, made_from: object, make: Callable[[], T], code: Iterable[str] = ()
) -> T:
    """The result kept as ``name`` if it was made from exactly this; else that of ``make``, which is then kept.

    Parameters
    ----------
    folder : folder of kept results; None keeps nothing
    name : file name without its ending
    made_from : every value the result depends on (records, arrays, tables, plain values)
    make : computes the result: records of tribo, arrays, tables and plain values, in any nesting
    code : packages and modules of tribo whose sources decide the result
    """
    if folder is None:
        return make()
    key = fingerprint(made_from, sources(*code))
    path = folder / f"{name}.json"
    found, fault = _looked_at(path)
    if found is not None and found[0] == key:
        try:
            return cast(T, decoded(json.loads(found[1])["result"]))
        except (AttributeError, LookupError, TypeError, ValueError, ImportError, RecursionError) as why:
            fault = f"cannot be read by this version ({type(why).__name__})"
    if fault:
        warnings.warn(f"{path}: this kept result {fault}; it is made again", DamagedResultWarning, stacklevel=2)
    result = make()
    try:
        text = json.dumps(encoded(result))
    except TypeError as why:  # a result in hand is worth more than keeping it
        warnings.warn(f"{name} is not kept: {why}", RuntimeWarning, stacklevel=2)
        return result
    body = b'"result": ' + text.encode() + b"}\n"
    write_bytes(path, _head(name, key, body) + body)
    return result


def _head(name: str, key: str, body: bytes) -> bytes:
    """The first line of a kept file: what the result is made from, checksum and signature of this and the result."""
    content = key.encode() + body
    checksum = hashlib.sha256(content).hexdigest()
    signed = signature(name.encode() + b"\0" + content)
    return f'{{"made_from": "{key}", "sha256": "{checksum}", "signed": "{signed}",\n'.encode()


def _looked_at(path: Path) -> tuple[tuple[str, bytes] | None, str]:
    """What an intact kept file of this user was made from, with its content, else None; and what is wrong with it."""
    try:
        content = bytes_of(path)
    except (FileNotFoundError, NotADirectoryError):
        return None, ""
    except OSError as why:
        return None, f"cannot be read ({why.strerror or why})"
    head, newline, body = content.partition(b"\n")
    stated = re.match(rb'\{"made_from": "([0-9a-f]{64})", "sha256": "([0-9a-f]{64})"', head)
    if stated is None or hashlib.sha256(stated[1] + body).hexdigest() != stated[2].decode():
        return None, "is damaged or of an older version"
    key = stated[1].decode()
    if _head(path.stem, key, body) != head + newline:
        return None, FOREIGN
    return (key, content), ""


def fault_of_kept(path: Path) -> str:
    """Why a file of kept results is not believed, as the end of a sentence; empty where it is.

    Raises
    ------
    OSError
        The key of this user cannot be read.
    """
    return _looked_at(path)[1]


def signature(content: bytes) -> str:
    """HMAC-SHA-256 of a content with the key of this user, by which results are known as made here."""
    return hmac.digest(_own_key(), content, "sha256").hex()


@lru_cache(maxsize=1)
def _own_key() -> bytes:
    """The key in the private state folder of this user, made at its first use; else one for this process only.

    Raises
    ------
    OSError
        It is there and cannot be read, or cannot be written.
    """
    state = os.environ.get("XDG_STATE_HOME") or os.path.join(os.path.expanduser("~"), ".local", "state")
    chosen = os.environ.get("TRIBO_STATE_DIR")
    folder = private_folder([*([Path(chosen)] if chosen else []), Path(state) / "tribo"], "tribo-state-")
    with only_writer(folder / f"{KEY}.lock", KEY_WAIT_S):
        path = folder / KEY
        if not path.is_file() or len(bytes_of(path)) != KEY_BYTES:
            write_bytes(path, secrets.token_bytes(KEY_BYTES))
        return bytes_of(path)


@lru_cache(maxsize=32)
def sources(*code: str) -> str:
    """SHA-256 over the sources of packages or modules of tribo and the versions of the libraries they compute with."""
    digest = hashlib.sha256()
    for place in sorted(code):
        folder = _PACKAGE / place
        for source in found_below(folder, "*.py") if folder.is_dir() else [folder.with_suffix(".py")]:
            digest.update(f"{source.relative_to(_PACKAGE)}\0".encode() + bytes_of(source))
    for library in LIBRARIES:
        digest.update(f"{library} {metadata.version(library)}\0".encode())
    return digest.hexdigest()


@lru_cache(maxsize=1)
def package_sources() -> str:
    """SHA-256 over every file of the package, templates and style sheets included, the bundled table of pattern shares,
    and the library versions."""
    digest = hashlib.sha256(sources().encode())
    for file in (p for p in found_below(_PACKAGE) if p.is_file() and "__pycache__" not in p.parts):
        digest.update(f"{file.relative_to(_PACKAGE)}\0".encode() + bytes_of(file))
    for file in found_in(data_dir() / PATTERN_SHARES, "*.csv"):
        digest.update(f"{file.name}\0".encode() + bytes_of(file))
    return digest.hexdigest()


def fingerprint(*values: object) -> str:
    """SHA-256 of values, records and arrays by content; of a path nothing, since results do not depend on places."""
    digest = hashlib.sha256()
    for value in values:
        _feed(digest.update, value)
    return digest.hexdigest()


_PLAIN = {str, float, int, bool, type(None)}


def _feed(update: Callable[[bytes], object], value: object) -> None:
    update(f"<{type(value).__name__}".encode())
    if type(value) in _PLAIN:  # most values: the cells of tables
        update(repr(value).encode())
    elif isinstance(value, FunctionType):
        update(f"{value.__module__}:{value.__qualname__}".encode())
    elif isinstance(value, np.ndarray) and value.dtype.kind != "O":
        update(f"{value.dtype}{value.shape}".encode())
        update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Path):
        pass
    else:
        parts = _parts(value)
        if parts is None:
            update(repr(value).encode())
        else:
            for part in parts:
                _feed(update, part)
    update(b">")


def _parts(value: object) -> Iterable[object] | None:
    """What a compound value consists of, in order; None for a plain one."""
    if is_dataclass(value) and not isinstance(value, type):
        return [getattr(value, field.name) for field in fields(value)]
    if isinstance(value, Mapping):
        return [part for item in value.items() for part in item]
    if isinstance(value, list | tuple | np.ndarray):
        return list(value)
    if hasattr(value, "columns") and hasattr(value, "to_numpy"):  # a table, without importing pandas to ask
        table = cast(Any, value)
        return [part for name in table.columns for part in (name, table[name].to_numpy())]
    return None


def encoded(value: Any) -> Any:
    """A value as JSON can hold it, such that :func:`decoded` gives an equal one. A record or an array that is at
    several places of the value is written once.

    Raises
    ------
    TypeError
        It holds something that is no record or function of tribo, array, table or plain value.
    """
    return _Encoder().encoded(value)


class _Encoder:
    def __init__(self) -> None:
        self.places: dict[int, int] = {}  # number of a record or array, by its identity
        self.alive: list[object] = []  # so that no identity is given twice

    def encoded(self, value: Any) -> Any:
        if value is None or isinstance(value, str | bool):
            return value
        if isinstance(value, int | float | np.generic):
            return value.item() if isinstance(value, np.generic) else value
        if id(value) in self.places:
            return {"again": self.places[id(value)]}
        if isinstance(value, np.ndarray) and value.dtype.kind != "O":
            data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode("ascii")
            return self._numbered(value, {"array": data, "dtype": value.dtype.str, "shape": list(value.shape)})
        if isinstance(value, list | np.ndarray):
            return [self.encoded(part) for part in value]
        if isinstance(value, tuple):
            return {"tuple": [self.encoded(part) for part in value]}
        if isinstance(value, Mapping):
            return {"mapping": [[self.encoded(key), self.encoded(part)] for key, part in value.items()]}
        if hasattr(value, "to_numpy") and hasattr(value, "columns"):
            return {"table": [[str(name), self.encoded(value[name].to_numpy())] for name in value.columns]}
        if is_dataclass(value) and type(value).__module__.startswith("tribo."):
            parts = [[field.name, self.encoded(getattr(value, field.name))] for field in fields(value) if field.init]
            place = f"{type(value).__module__}:{type(value).__qualname__}"
            return self._numbered(value, {"record": place, "fields": parts})
        if isinstance(value, FunctionType) and _named(place := f"{value.__module__}:{value.__qualname__}") is value:
            return {"function": place}
        raise TypeError(f"a {type(value).__qualname__} cannot be kept")

    def _numbered(self, value: object, record: dict[str, Any]) -> dict[str, Any]:
        """Numbers are given in the order in which :class:`_Decoder` completes its records and arrays."""
        self.places[id(value)] = len(self.alive)
        self.alive.append(value)
        return record


def decoded(value: Any) -> Any:
    """The value that :func:`encoded` was given. Only records of tribo are ever constructed, and nothing is called."""
    return _Decoder().decoded(value)


class _Decoder:
    def __init__(self) -> None:
        self.done: list[Any] = []

    def decoded(self, value: Any) -> Any:
        if isinstance(value, list):
            return [self.decoded(part) for part in value]
        if not isinstance(value, dict):
            return value
        if "again" in value:
            return self.done[value["again"]]
        if "array" in value:
            flat = np.frombuffer(base64.b64decode(value["array"]), np.dtype(value["dtype"]))
            return self._numbered(flat.reshape(value["shape"]).copy())
        if "tuple" in value:
            return tuple(self.decoded(part) for part in value["tuple"])
        if "mapping" in value:
            return {self.decoded(key): self.decoded(part) for key, part in value["mapping"]}
        if "table" in value:
            import pandas as pd

            return pd.DataFrame({name: self.decoded(column) for name, column in value["table"]})
        if "function" in value:
            function = _named(value["function"])
            if not isinstance(function, FunctionType):
                raise TypeError(f"{value['function']} is no function of tribo")
            return function
        record = _named(value["record"])
        if not (isinstance(record, type) and is_dataclass(record)):
            raise TypeError(f"{value['record']} is no record of tribo")
        return self._numbered(record(**{name: self.decoded(part) for name, part in value["fields"]}))

    def _numbered(self, value: Any) -> Any:
        self.done.append(value)
        return value


def _named(place: str) -> object:
    """What tribo itself defines at "module:name"; None where it defines nothing of that name there."""
    module, _, name = place.partition(":")
    found = getattr(import_module(module), name, None) if module.startswith("tribo.") else None
    return found if getattr(found, "__module__", None) == module else None
