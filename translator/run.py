"""Running another renderer: a private folder, a cleaned environment, a time limit, and everything it said."""

from __future__ import annotations

import os
import re
import resource
import shlex
import shutil
import signal
import site
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import InputError, OutputError, RendererError
from reference.files import make_folder, write_text
from reference.image import read_image
from reference.scene import Scene
from translator.contract import PYTHON, Export, Settings, Unsupported
from translator.registry import adapter

RENDERED, UNSUPPORTED, NOT_INSTALLED, FAILED = "rendered", "unsupported", "not-installed", "failed"
KEPT_LOG = 64 * 1024  # bytes, from the end
LARGEST_FILE = 8 << 30  # bytes that a renderer may write into one file
KEPT_VARIABLES = ("DRJIT_LIBLLVM_PATH",)  # which LLVM the user chose
LONGEST_VERSION = 60.0  # seconds a program may take to tell its version


@dataclass(frozen=True)
class Outcome:
    """What became of one renderer on one scene. `picture` is in levels; `trace_seconds` excludes start and files."""

    renderer: str
    title: str
    status: str
    version: str | None = None
    reason: str | None = None
    seconds: float | None = None
    trace_seconds: float | None = None
    picture: NDArray[np.floating[Any]] | None = None
    command: str = ""
    log: str = ""
    notes: tuple[str, ...] = ()
    limits: Mapping[str, float] = field(default_factory=dict)
    summary: str | None = None


def run_renderer(name: str, scene: Scene, settings: Settings, timeout: float = 600) -> Outcome:
    """Draw `scene` with the renderer of that name. Whatever goes wrong on its side is in the outcome, not raised."""
    renderer = adapter(name)
    version = installed_version(name)
    if version is None:
        return Outcome(name, renderer.TITLE, NOT_INSTALLED, reason=f"not installed; to have it: {renderer.INSTALL}")
    try:
        export = renderer.export(scene, settings)
    except Unsupported as refusal:
        return Outcome(name, renderer.TITLE, UNSUPPORTED, version, str(refusal))
    command = command_line(export)
    start = time.perf_counter()
    try:
        picture, log = draw(export, settings, timeout)
    except (RendererError, OutputError, OSError) as error:
        seconds = time.perf_counter() - start
        log = error.log if isinstance(error, RendererError) else ""
        return Outcome(
            name,
            renderer.TITLE,
            FAILED,
            version,
            _reason(str(error), log),
            seconds,
            command=command,
            log=log,
            notes=export.notes,
        )
    seconds = time.perf_counter() - start
    timing = re.search(renderer.TIMING, log)
    trace_seconds = float(timing[1]) if timing else None
    summary = re.search(getattr(renderer, "SUMMARY", r"(?!)"), log)
    return Outcome(
        name,
        renderer.TITLE,
        RENDERED,
        version,
        None,
        seconds,
        trace_seconds,
        picture,
        command,
        log,
        export.notes,
        asdict(export.limits),
        summary[0] if summary else None,
    )


def _reason(message: str, log: str) -> str:
    """What went wrong, with the last that the renderer said."""
    last = next((line.strip() for line in reversed(log.splitlines()) if line.strip()), "")
    return f"{message}: {last[:200]}" if last else message


def draw(export: Export, settings: Settings, timeout: float) -> tuple[NDArray[np.floating[Any]], str]:
    """Run an export in a private folder that is gone afterwards. Returns levels and log; raises RendererError."""
    with tempfile.TemporaryDirectory(prefix="crossray-") as folder:
        write_export(export, folder)
        log = _run(_resolve(export.command), Path(folder), dict(export.environment), timeout)
        try:
            picture = read_image(Path(folder, export.image))
        except InputError as error:
            raise RendererError(f"it left no usable picture ({str(error).partition('expected ')[2]})", log) from error
    if picture.shape != (settings.height, settings.width, 3):
        found = f"{picture.shape[1]}x{picture.shape[0]}"
        raise RendererError(f"expected a picture of {settings.width}x{settings.height}, found {found}", log)
    return picture, log


def write_export(export: Export, folder: str | Path) -> None:
    """Write the files of an export into `folder`. Raises OutputError."""
    for name, text in export.files.items():
        path = Path(folder, name)
        make_folder(path.parent)
        write_text(path, text)


def command_line(export: Export) -> str:
    """The line to type in the folder of the export."""
    return shlex.join(_resolve(export.command))


@cache
def installed_version(name: str) -> str | None:
    """What version of the renderer this machine has, or None for none that answers."""
    command, pattern = adapter(name).VERSION
    with tempfile.TemporaryDirectory(prefix="crossray-") as folder:
        try:
            answer = _run(_resolve(command), Path(folder), {}, LONGEST_VERSION)
        except RendererError:
            return "unknown" if command[0] != PYTHON and shutil.which(command[0]) else None
    match = re.search(pattern, answer)
    return match[1] if match else "unknown"


def _resolve(command: tuple[str, ...]) -> list[str]:
    """The command with this Python for `python`."""
    return [sys.executable if command[0] == PYTHON else command[0], *command[1:]]


def _run(command: list[str], folder: Path, extra: dict[str, str], timeout: float) -> str:
    """Run in `folder` with nothing of the user's environment but where programs are. Returns the end of the log."""
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
        try:
            with suppress(ProcessLookupError):
                resource.prlimit(process.pid, resource.RLIMIT_CORE, (0, 0))
                resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (LARGEST_FILE, LARGEST_FILE))
            code = process.wait(timeout)
        except subprocess.TimeoutExpired:
            raise RendererError(f"it ran out of time ({timeout:g} s)", _tail(log)) from None
        finally:
            _kill_group(process)
        text = _tail(log)
        if code < 0:
            raise RendererError(f"it was stopped by {_signal_name(-code)}", text)
        if code > 0:
            raise RendererError(f"it failed with exit code {code}", text)
        return text


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
