"""What becomes of a scene in another renderer: its picture, or why there is none."""

from __future__ import annotations

import math
import re
import shlex
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import InputError, OutputError, RendererError
from reference.files import make_folder, write_text
from reference.image import read_image
from reference.scene import Scene
from translator.contract import PYTHON, Export, Settings, Unsupported
from translator.process import find_program, run_process
from translator.registry import adapter

RENDERED, UNSUPPORTED, NOT_INSTALLED, FAILED = "rendered", "unsupported", "not-installed", "failed"
LONGEST_VERSION = 60.0  # seconds a program may take to tell its version


@dataclass(frozen=True)
class Outcome:
    """What became of one renderer on one scene, on as many threads.

    `picture` is in levels; `trace_seconds` excludes start and files.
    """

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
    threads: int = 1


def run_renderer(name: str, scene: Scene, settings: Settings, timeout: float = 600) -> Outcome:
    """Draw `scene` with the renderer of that name, in at most `timeout` seconds.

    Whatever goes wrong on its side is in the outcome, not raised. Raises InputError for a name that is no renderer's.
    """
    outcome = Outcome(name, name, FAILED, threads=settings.threads)
    try:
        renderer = adapter(name)
        outcome = replace(outcome, title=renderer.TITLE, version=installed_version(name))
        if outcome.version is None:
            missing = f"not installed; to have it: {renderer.INSTALL}"
            return replace(outcome, status=NOT_INSTALLED, reason=missing)
        export = export_scene(name, scene, settings)
    except Unsupported as refusal:
        return replace(outcome, status=UNSUPPORTED, reason=str(refusal))
    except RendererError as error:
        return replace(outcome, reason=str(error), log=error.log)
    except OSError as error:
        return replace(outcome, reason=str(error))
    outcome = replace(outcome, command=command_line(export), notes=export.notes, limits=asdict(export.limits))
    start = time.perf_counter()
    try:
        picture, log = draw(export, settings, timeout)
    except (RendererError, OutputError, OSError) as error:
        log = error.log if isinstance(error, RendererError) else ""
        return replace(outcome, reason=_reason(str(error), log), seconds=time.perf_counter() - start, log=log)
    seconds = time.perf_counter() - start
    summary = re.search(getattr(renderer, "SUMMARY", r"(?!)"), log)
    return replace(
        outcome,
        status=RENDERED,
        seconds=seconds,
        trace_seconds=_number(re.search(renderer.TIMING, log)),
        picture=picture,
        log=log,
        summary=summary[0] if summary else None,
    )


def _number(match: re.Match[str] | None) -> float | None:
    """What a pattern found, if it is a finite number."""
    try:
        value = float(match[1] or "") if match else math.nan
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _reason(message: str, log: str) -> str:
    """What went wrong, with the last that the renderer said."""
    last = next((line.strip() for line in reversed(log.splitlines()) if line.strip()), "")
    return f"{message}: {last[:200]}" if last else message


def export_scene(name: str, scene: Scene, settings: Settings) -> Export:
    """The scene in that renderer's language. Raises Unsupported, and RendererError for an adapter that is at fault."""
    renderer = adapter(name)
    try:
        export = renderer.export(scene, settings)
        if not isinstance(export, Export):
            raise TypeError(f"expected an Export, found {export!r}")
    except Unsupported:
        raise
    except (Exception, SystemExit) as error:  # adapters can be anybody's
        reason = f"its adapter failed: {type(error).__name__}: {error}"
        raise RendererError(reason, traceback.format_exc()) from error
    return export


def draw(export: Export, settings: Settings, timeout: float) -> tuple[NDArray[np.floating[Any]], str]:
    """Run an export in a private folder that is gone afterwards. Returns levels and log; raises RendererError."""
    with tempfile.TemporaryDirectory(prefix="crossray-") as folder:
        write_export(export, folder)
        log = run_process(_resolve(export.command), Path(folder), dict(export.environment), timeout)
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
    settings = [f"{name}={shlex.quote(value)}" for name, value in export.environment.items()]
    return " ".join([*settings, shlex.join(_resolve(export.command))])


@cache
def installed_version(name: str) -> str | None:
    """What version of the renderer this machine has, or None for none that answers."""
    command, pattern = adapter(name).VERSION
    with tempfile.TemporaryDirectory(prefix="crossray-") as folder:
        try:
            answer = run_process(_resolve(command), Path(folder), {}, LONGEST_VERSION)
        except RendererError:
            return "unknown" if command[0] != PYTHON and find_program(command[0]) else None
    match = re.search(pattern, answer)
    return (match[1] if match else None) or "unknown"


def _resolve(command: tuple[str, ...]) -> list[str]:
    """The command with this Python for `python`."""
    return [sys.executable if command[0] == PYTHON else command[0], *command[1:]]
