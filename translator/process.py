"""Running another program: in a private folder, a cleaned environment and a time limit; what it said is kept."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import site
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import IO

from reference.errors import RendererError

KEPT_LOG = 64 * 1024  # bytes, from the end
LARGEST_FILE = 8 << 30  # bytes that a program may write into one file
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
        "PATH": os.environ.get("PATH", os.defpath),
        "PYTHONUSERBASE": site.getuserbase(),
        "LANG": "C.UTF-8",
        "HOME": str(folder),
        "TMPDIR": str(folder),
    }
    environment |= {name: os.environ[name] for name in KEPT_VARIABLES if name in os.environ}
    program = shutil.which(command[0])
    if program is None:
        raise RendererError(f"{command[0]} is not installed")
    with tempfile.TemporaryFile() as log:
        try:
            process = subprocess.Popen(
                [program, *command[1:]],
                cwd=folder,
                env=environment | extra,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        except OSError as error:
            raise RendererError(f"{program} does not start: {error.strerror}") from error
        _running.add(process)
        try:
            with suppress(ProcessLookupError):
                resource.prlimit(process.pid, resource.RLIMIT_CORE, (0, 0))
                resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (LARGEST_FILE, LARGEST_FILE))
            code = process.wait(timeout)
        except subprocess.TimeoutExpired:
            raise RendererError(f"it ran out of time ({timeout:g} s)", _tail(log)) from None
        finally:
            _kill_group(process)
            _running.discard(process)
        text = _tail(log)
        if code < 0:
            raise RendererError(f"it was stopped by {_signal_name(-code)}", text)
        if code > 0:
            raise RendererError(f"it failed with exit code {code}", text)
        return text


def stop_all() -> None:
    """Kill whatever runs at the moment, in any thread: each run_process that waits for it raises RendererError."""
    for process in list(_running):
        _kill_group(process)


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


def _tail(file: IO[bytes]) -> str:
    """The end of a log, without the progress that was drawn over."""
    file.seek(max(0, file.seek(0, os.SEEK_END) - KEPT_LOG))
    text = file.read().decode("utf-8", "replace").replace("\r\n", "\n")
    return "\n".join(line.rpartition("\r")[2] for line in text.split("\n"))
