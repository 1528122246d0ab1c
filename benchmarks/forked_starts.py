"""Python processes of a build that are forked from one that has tribo loaded, so that a start costs no import.

A build, Snakemake and every step of it are processes of their own, and most of their time is spent on imports. Here the
build is a fork of this process, with a second fork beside it, the starter, that does nothing but fork. What the build
takes for the Python interpreter (``sys.executable``) is a short script: it hands its arguments, folder, environment and
open descriptors to the starter and waits; the new fork does the work, in the process group of the script. Linux only.
"""

from __future__ import annotations

import fcntl
import json
import os
import runpy
import signal
import socket
import sys
import tempfile
from pathlib import Path
from typing import NoReturn

LONGEST_MESSAGE = 150_000
MOST_DESCRIPTORS = 16
OUT_OF_THE_WAY = 200  # descriptors of the starter lie above those that it is handed
STARTER = "TRIBO_TORTURE_STARTER"
SCRIPT = f"""#!{sys.executable} -IS
import json, os, socket, sys
def is_open(number):
    try:
        os.fstat(number)
    except OSError:
        return False
    return True
descriptors = [number for number in range({MOST_DESCRIPTORS}) if is_open(number)]
with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as starter:
    starter.connect(os.environ["{STARTER}"])
    order = json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ), descriptors, os.getpgrp()])
    socket.send_fds(starter, [order.encode()], descriptors)
    answer = starter.recv(100)
sys.exit(int(answer or 70))
"""


def stand_in_for_python(folder: Path) -> Path:
    """Write the script that is started in place of Python."""
    script = folder / "python"
    script.write_text(SCRIPT, encoding="utf-8")
    script.chmod(0o700)
    return script


def start_here(script: Path, socket_path: Path) -> int:
    """From now on this process starts Python by ``script``; the process number of the starter, a fork of this one."""
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listening.bind(str(socket_path))
    listening.listen(16)
    starter = os.fork()
    if not starter:
        _serve(listening)
    listening.close()
    sys.executable = str(script)
    os.environ[STARTER] = str(socket_path)
    return starter


def _serve(listening: socket.socket) -> NoReturn:
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for the forks
    while True:
        connection, _ = listening.accept()
        if not os.fork():
            listening.close()
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            _answer(connection)
        connection.close()


def _answer(connection: socket.socket) -> NoReturn:
    """Do what is asked for in this process, which ends with it, and send the exit status."""
    away = socket.socket(fileno=fcntl.fcntl(connection, fcntl.F_DUPFD_CLOEXEC, OUT_OF_THE_WAY))
    connection.close()
    order, handed, _, _ = socket.recv_fds(away, LONGEST_MESSAGE, MOST_DESCRIPTORS)
    arguments, folder, environment, numbers, group = json.loads(order)
    os.setpgid(0, group)
    handed = [fcntl.fcntl(number, fcntl.F_DUPFD_CLOEXEC, OUT_OF_THE_WAY) for number in handed]
    os.closerange(0, OUT_OF_THE_WAY)
    for number, descriptor in zip(numbers, handed, strict=True):
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.chdir(folder)
    os.environ.clear()
    os.environ |= environment
    tempfile.tempdir = None
    sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stdout, sys.stderr = (open(n, "w", encoding="utf-8", closefd=False) for n in (1, 2))  # noqa: SIM115
    status = _status_of([word for word in arguments if word != "-P"])
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    away.send(str(status).encode())
    os._exit(status)


def _status_of(arguments: list[str]) -> int:
    """Run ``-m MODULE ARGUMENTS``; its exit status."""
    assert arguments[0] == "-m", arguments
    module, sys.argv = arguments[1], arguments[1:]
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        if not isinstance(ended.code, int | None):
            print(ended.code, file=sys.stderr)
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:
        import traceback

        traceback.print_exc()
        return 1
    return 0
