"""Compiled code is only ever loaded from a folder that no one but this user can write to."""

from __future__ import annotations

import os
import pickle
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tribo.temporary import private_folder

needs_users = pytest.mark.skipif(not hasattr(os, "getuid"), reason="no user numbers on this system")
needs_root = pytest.mark.skipif(getattr(os, "getuid", lambda: 1)() != 0, reason="only root can give files away")


def mode(folder: Path) -> int:
    return stat.S_IMODE(folder.stat().st_mode)


def chosen(candidate: Path) -> Path:
    return private_folder([candidate], "tribo-test-")


def test_a_folder_that_is_not_there_is_made_for_its_owner_only(tmp_path: Path) -> None:
    wanted = tmp_path / "cache" / "numba-1"
    assert chosen(wanted) == wanted
    assert mode(wanted) == 0o700
    assert chosen(wanted) == wanted  # the next start finds it


def given_away(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o700)
    os.chown(folder, 12345, -1)


def open_to_all(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o777)


def readable_by_all(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o755)


def a_link(folder: Path) -> None:
    target = folder.with_name("target")
    target.mkdir(mode=0o700)
    folder.symlink_to(target, target_is_directory=True)


def a_file(folder: Path) -> None:
    folder.write_text("")


def a_dangling_link(folder: Path) -> None:
    folder.symlink_to(folder.with_name("nowhere"))


@needs_users
@pytest.mark.parametrize(
    "spoil",
    [pytest.param(given_away, marks=needs_root), open_to_all, readable_by_all, a_link, a_file, a_dangling_link],
)
def test_a_folder_that_is_not_private_is_passed_over_for_a_fresh_one(
    tmp_path: Path, spoil: Callable[[Path], None]
) -> None:
    wanted = tmp_path / "numba-1"
    spoil(wanted)
    fresh = chosen(wanted)
    assert fresh != wanted
    assert fresh.parent.name.startswith("tribo-test-")
    assert mode(fresh) == 0o700


@needs_users
def test_a_folder_below_one_that_others_can_change_is_passed_over(tmp_path: Path) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o777)
    assert chosen(shared / "numba-1").parent != shared
    shared.chmod(0o1777)  # sticky, as /tmp is: nobody can rename what belongs to another
    (shared / "numba-1").chmod(0o700)
    assert chosen(shared / "numba-1") == shared / "numba-1"


@needs_root
def test_a_folder_below_that_of_another_user_is_passed_over(tmp_path: Path) -> None:
    theirs = tmp_path / "theirs"
    theirs.mkdir()
    (theirs / "numba-1").mkdir(mode=0o700)
    os.chown(theirs, 12345, -1)
    assert chosen(theirs / "numba-1").parent != theirs


@needs_users
def test_a_link_above_the_folder_is_resolved_once_for_all(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    assert chosen(tmp_path / "link" / "numba-1") == tmp_path / "real" / "numba-1"


def test_the_fresh_folder_is_gone_when_the_process_ends(tmp_path: Path) -> None:
    code = "from tribo.temporary import private_folder; print(private_folder([], 'tribo-test-'))"
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    said = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert tmp_path in Path(said.stdout.strip()).parents
    assert list(tmp_path.iterdir()) == []


class Marks:
    """A pickle that leaves a file when it is loaded."""

    def __init__(self, mark: Path):
        self.mark = mark

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.mark),)


COMPILES = """
from tribo.springblock.engines.jit import cache_directory, compiled

@compiled
def doubled(x):
    return x + x

print(cache_directory(), flush=True)
doubled(1)
"""


@needs_root
def test_a_pickle_in_a_foreign_cache_below_the_temporary_folder_is_never_loaded(tmp_path: Path) -> None:
    """The attack: HOME cannot be written, and someone has put code into the place that tribo would use next."""
    home, temporary, program = tmp_path / "home", tmp_path / "tmp", tmp_path / "program.py"
    home.write_text("a file, so that nothing can be made in it")
    program.write_text(COMPILES)
    temporary.mkdir()
    temporary.chmod(0o1777)
    environment = {**os.environ, "HOME": str(home), "TMPDIR": str(temporary)}
    environment = {k: v for k, v in environment.items() if k not in ("TRIBO_CACHE_DIR", "XDG_CACHE_HOME")}

    def used() -> Path:
        said = subprocess.run([sys.executable, program], env=environment, capture_output=True, text=True)
        return Path(said.stdout.strip())

    first = used()
    assert first.parent.parent == temporary
    indexes = list(first.rglob("*.nbi"))
    assert indexes
    for file in indexes:
        file.write_bytes(pickle.dumps(Marks(tmp_path / "ran")))
    used()
    assert (tmp_path / "ran").exists()  # what lies in a cache does run ...
    (tmp_path / "ran").rmdir()
    for path in [first.parent, first, *first.rglob("*")]:
        os.chown(path, 12345, -1)
    assert not used().is_relative_to(first.parent)
    assert not (tmp_path / "ran").exists()  # ... and so one of another user is not used
