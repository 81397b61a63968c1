"""Running another program: in a private folder, a cleaned environment and a time limit; what it said is kept."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import site
import subprocess
from contextlib import suppress
from pathlib import Path
from threading import Thread
from typing import IO

from reference.errors import RendererError

KEPT_LOG = 64 * 1024  # bytes, from the end
LARGEST_FILE = 8 << 30  # bytes that a program may write into one file
LONGEST_ENDING = 2.0  # seconds to wait for the end of what an ended process said
KEPT_VARIABLES = ("DRJIT_LIBLLVM_PATH",)  # which LLVM the user chose

_running: set[subprocess.Popen[bytes]] = set()


def usable_cores() -> list[int]:
    """The cores that this process may use."""
    return sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else list(range(os.cpu_count() or 1))


def run_process(command: list[str], folder: Path, extra: dict[str, str], timeout: float) -> str:
    """Run in `folder` with nothing of the user's environment but where programs are.

    `timeout` is in seconds. Returns the end of what the program said; raises RendererError.
    """
    environment = {
        "PATH": search_path(),
        "PYTHONUSERBASE": site.getuserbase(),
        "LANG": "C.UTF-8",
        "HOME": str(folder.absolute()),
        "TMPDIR": str(folder.absolute()),
    }
    environment |= {name: os.environ[name] for name in KEPT_VARIABLES if name in os.environ}
    program = find_program(command[0])
    if program is None:
        raise RendererError(f"{command[0]} is not installed")
    try:
        process = subprocess.Popen(
            [program, *command[1:]],
            cwd=folder,
            env=environment | extra,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    except (OSError, ValueError) as error:  # ValueError: a word that no program can be given
        fault = error.strerror if isinstance(error, OSError) else error
        raise RendererError(f"{program} does not start: {fault}") from error
    _running.add(process)
    reason = None
    try:
        log = _Log(process)
        _bound(process.pid, resource.RLIMIT_CORE, 0)
        _bound(process.pid, resource.RLIMIT_FSIZE, LARGEST_FILE)
        code = process.wait(timeout)
        if code < 0:
            reason = f"it was stopped by {_signal_name(-code)}"
        elif code > 0:
            reason = f"it failed with exit code {code}"
    except subprocess.TimeoutExpired:
        reason = f"it ran out of time ({timeout:g} s)"
    finally:
        _kill_group(process)
        _running.discard(process)
    text = log.text()
    if reason:
        raise RendererError(reason, text)
    return text


def search_path() -> str:
    """Where programs are. What is relative to some working directory is left out, since a trap may lie there."""
    folders = os.environ.get("PATH", os.defpath).split(os.pathsep)
    return os.pathsep.join(folder for folder in folders if Path(folder).is_absolute())


def find_program(name: str) -> str | None:
    """The path of a program, or None where it is not installed."""
    return shutil.which(name, path=search_path())


def stop_all() -> None:
    """Kill whatever runs at the moment, in any thread: each run_process that waits for it raises RendererError."""
    for process in list(_running):
        _kill_group(process)


def _bound(process: int, kind: int, largest: int) -> None:
    """Lower a limit of a process; a lower one that the user has set stays."""
    if not hasattr(resource, "prlimit"):  # only Linux has it
        return
    with suppress(ProcessLookupError):
        known = [limit for limit in resource.prlimit(process, kind) if limit != resource.RLIM_INFINITY]
        limit = min([largest, *known])
        resource.prlimit(process, kind, (limit, limit))


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _kill_group(process: subprocess.Popen[bytes]) -> None:
    """Leave nothing of a renderer running, whatever it started."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


class _Log:
    """The end of what a process says. Read while it is said and kept in memory: the disk may be full."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout
        self.kept = bytearray()
        self.reader = Thread(target=self._read, args=(process.stdout,), daemon=True)
        self.reader.start()

    def _read(self, pipe: IO[bytes]) -> None:
        with pipe:
            while said := os.read(pipe.fileno(), KEPT_LOG):
                self.kept += said
                del self.kept[:-KEPT_LOG]

    def text(self) -> str:
        """What an ended process said last, without the progress that was drawn over."""
        self.reader.join(LONGEST_ENDING)
        text = bytes(self.kept).decode("utf-8", "replace").replace("\r\n", "\n")
        return "\n".join(line.rpartition("\r")[2] for line in text.split("\n"))
