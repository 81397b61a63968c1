"""What an adapter offers and what it may refuse.

A renderer is one module in `translator/renderers`; its name there (`_` read as `-`) is the renderer's name. It has:

    TITLE    the name people know
    LICENCE  under which it comes, as SPDX spells it
    INSTALL  the line to type where it is missing
    VERSION  (command, pattern): group 1 of the pattern in what the command prints is the version
    TIMING   pattern: group 1 in the log of a run is the seconds that tracing alone took
    export   (scene, settings) -> Export: pure, the same files for the same scene, with nothing installed.
             Raises Unsupported for what the renderer cannot carry, before anything runs.
    SUMMARY  (may be missing) pattern: what in the log of a run belongs in the report
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from reference.errors import CrossrayError
from reference.scene import Scene
from reference.text import dump

SMALLEST, LARGEST = 1e-25, 1e25  # of colours and coefficients in single precision, so that products stay in range
PYTHON = "python"  # as the first word of a command: the Python that runs crossray


@dataclass(frozen=True)
class Settings:
    """The picture to draw, always by the `exact` convention."""

    width: int = 1000
    height: int = 1000
    depth: int = 3  # bounces after the primary hit
    threads: int = 2  # that the renderer may use


@dataclass(frozen=True)
class Limits:
    """What the renderer's arithmetic cannot do better, in the assignment's units, for this scene.

    `precision`: the relative error that its points and directions may have. `gap`: how far from its start a shadow or
    mirrored ray may miss things, where the renderer starts its rays a little ahead. `far`: the distance from which on
    rays may miss things, 0 for none.
    """

    precision: float = 0.0
    gap: float = 0.0
    far: float = 0.0


@dataclass(frozen=True)
class Export:
    """A scene in a renderer's own language.

    `command` is run in a folder that holds `files` and leaves the picture `image` there: linear, levels / 255.
    `environment` is set for it, in the line that people type too.
    `notes` tell a reader what is not obvious about the files.
    """

    files: Mapping[str, str]
    command: tuple[str, ...]
    image: str
    notes: tuple[str, ...] = ()
    environment: Mapping[str, str] = field(default_factory=dict)
    limits: Limits = Limits()


class Unsupported(CrossrayError):
    """The renderer cannot carry this scene; reads as a sentence for the user."""


def number(value: float) -> str:
    """A number as any language of scenes reads it. Raises Unsupported for a product that overflowed."""
    if not math.isfinite(value):
        raise Unsupported("the scene's numbers are so large that their products overflow")
    return repr(float(value))


def single(value: float) -> str:
    """A number for a renderer that keeps it in single precision. Raises Unsupported where that would lose it."""
    if value and not SMALLEST <= abs(value) <= LARGEST:
        raise Unsupported(f"single precision cannot keep apart colours and coefficients as far from 1 as {value:g}")
    return number(value)


def source(scene: Scene, prefix: str) -> str:
    """The scene as the assignment writes it, every line behind `prefix`: a comment that an export traces back to."""
    return "".join(f"{prefix}{line}\n" for line in dump(scene).splitlines())


class Adapter(Protocol):
    """The shape of a renderer's module."""

    TITLE: str
    LICENCE: str
    INSTALL: str
    VERSION: tuple[tuple[str, ...], str]
    TIMING: str

    @staticmethod
    def export(scene: Scene, settings: Settings) -> Export:
        """The scene in the renderer's language."""
