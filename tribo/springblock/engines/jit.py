"""Compiled functions with a cache that is never used for changed sources.

numba's ``cache=True`` looks only at the file a function stands in, so an edit of something it calls is missed.
Here the cache directory carries a hash of every source file of this package: a changed file means a new
directory, and directories no start has used for a month are removed. ``TRIBO_CACHE_DIR`` moves it. The directory
belongs to this user alone, or else to this process alone.
"""

from __future__ import annotations

import gc
import hashlib
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit, types
from numba.core.compiler import Compiler
from numba.extending import intrinsic, register_jitable

from tribo.files import bytes_of, found_below
from tribo.temporary import place_of_temporary_files, private_folder

UNUSED_DAYS = 30.0
Function = TypeVar("Function", bound=Callable[..., Any])


@lru_cache(maxsize=1)
def cache_directory() -> Path:
    """The directory of compiled code for exactly these sources, created where it can be written.

    Compiled code is loaded as it lies there (pickles and machine code), so a directory that anyone else could write
    to is never used: see :func:`tribo.temporary.private_folder`.
    """
    digest = hashlib.sha256()
    for source in found_below(Path(__file__).parents[1], "*.py"):
        digest.update(source.name.encode() + b"\0" + bytes_of(source))
    name = f"numba-{digest.hexdigest()[:16]}"
    folder = private_folder((base / name for base in _cache_bases()), "tribo-numba-")
    if folder.name == name:
        remove_unused(folder.parent)
    return folder


def remove_unused(base: Path, days: float = UNUSED_DAYS) -> None:
    """Remove the code of other sources that no start has used for so many days.

    A start marks its directory before this. A directory is renamed before it is emptied, so two starts never empty the
    same one; whatever cannot be removed stays.
    """
    oldest = time.time() - 86400 * days
    for folder in base.glob("numba-*"):
        try:
            if folder.stat().st_mtime > oldest:
                continue
            doomed = folder.with_name(f"removed-{os.getpid()}-{folder.name}")
            folder.rename(doomed)
        except OSError:  # another start was faster, or it is not ours
            continue
        shutil.rmtree(doomed, ignore_errors=True)


def _cache_bases() -> list[Path]:
    chosen = os.environ.get("TRIBO_CACHE_DIR")
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    own = f"tribo-cache-{os.getuid()}" if hasattr(os, "getuid") else "tribo-cache"
    return ([Path(chosen)] if chosen else []) + [Path(home) / "tribo", place_of_temporary_files() / own]


def compiled(function: Function) -> Function:
    """``numba.njit`` without the global interpreter lock, cached under :func:`cache_directory`.

    No fastmath: it would let the compiler drop the checks for NaN.
    """
    return _cached(function)


@contextmanager
def uncollected(function: Callable[..., Any]) -> Iterator[None]:
    """No garbage collection during the first call of a compiled function: it takes a tenth of the compilation."""
    first = gc.isenabled() and not getattr(function, "signatures", True)
    if first:
        gc.disable()
    try:
        yield
    finally:
        if first:
            gc.enable()


# A function without the code that calls it from Python takes half the time to compile.
INNER_OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def inner(function: Function) -> Function:
    """A function that compiled ones call: compiled with them and kept in their cache, plain Python elsewhere."""
    registered: Function = register_jitable(**INNER_OPTIONS)(function)
    return registered


class _Apart(Compiler):
    """The compiler with array arguments that do not overlap."""

    def define_pipelines(self) -> Any:
        self.state.flags.noalias = True
        return super().define_pipelines()


VECTOR_OPTIONS: dict[str, Any] = {"pipeline_class": _Apart, "fastmath": {"reassoc", "contract", "nsz"}}


def vectorised(function: Function) -> Function:
    """As :func:`compiled`, for a loop over arrays that share no memory, in a form the vector units can run.

    The compiler is told that no two array arguments overlap, may reorder sums and may fuse products into them. NaN and
    infinity stay what they are. Passing overlapping arrays, one of them written to, gives wrong numbers.
    """
    return _cached(function, **VECTOR_OPTIONS)


def inner_vectorised(function: Function) -> Function:
    """As :func:`vectorised`, for a loop that only compiled functions can call."""
    registered: Function = register_jitable(**INNER_OPTIONS, **VECTOR_OPTIONS)(function)
    return registered


def _attribute(name: str) -> Callable[[], None]:
    """A call that, compiled, does nothing but give the function it stands in this attribute of LLVM."""

    def set_on(typing_context: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            set.add(builder.function.attributes, name)  # llvmlite's own add knows no attributes with values
            return context.get_dummy_value()

        return types.void(), code

    return cast(Callable[[], None], cast(Any, intrinsic)(set_on))


# The compiler may use the widest vectors the processor has: LLVM keeps to 256 bits on many processors with 512, for
# fear of their clock rate. Where the function is copied into another, that one needs it too.
widest_vectors = _attribute('"prefer-vector-width"="512"')

# The function is copied into those that call it. A call would reach whichever of several copies the process loaded
# first, and these differ in the order of their sums: a process that compiles has others than one that loads.
copied_into_callers = _attribute("alwaysinline")


def _cached(function: Function, **options: Any) -> Function:
    settings: Any = config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = str(cache_directory())
    try:
        dispatcher: Any = njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    finally:
        settings.CACHE_DIR = before
    return cast(Function, dispatcher)
