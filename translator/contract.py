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

A renderer of somebody else is such a module in a distribution of its own, which offers it as an entry point:

    [project.entry-points."crossray.renderers"]
    my-tracer = "my_tracer_adapter"

`tests/example_renderer` is one, to copy: `pip install` it beside crossray, and every command knows `my-tracer`. Its
adapter may use `reference.scene`, `reference.text`, `translator.likeness` and this module. What it does wrong costs
its own pictures only.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import Protocol, cast

from reference.errors import CrossrayError
from reference.scene import EYE, Scene, Triple
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
    rays may miss things, 0 for none. `ahead`: shadow and mirrored rays start off their surface, along its normal, by
    this times 1 + the largest coordinate of the point as seen from `origin`. `short`: shadow rays end before the light
    by this share of the way. Raises ValueError for what is no finite number, or below 0.
    """

    precision: float = 0.0
    gap: float = 0.0
    far: float = 0.0
    ahead: float = 0.0
    origin: Triple = EYE
    short: float = 0.0

    def __post_init__(self) -> None:
        sizes = (self.precision, self.gap, self.far, self.ahead, self.short)
        if not (all(0 <= value < math.inf for value in sizes) and all(map(math.isfinite, self.origin))):
            raise ValueError(f"expected finite limits from 0 on, found {self}")


@dataclass(frozen=True)
class Export:
    """A scene in a renderer's own language.

    `command` is run in a folder that holds `files` and leaves the picture `image` there: linear, levels / 255.
    `environment` is set for it, in the line that people type too. `notes` tell a reader what is not obvious about the
    files. Raises ValueError for a name that leads out of the folder, and TypeError for what is no text.
    """

    files: Mapping[str, str]
    command: tuple[str, ...]
    image: str
    notes: tuple[str, ...] = ()
    environment: Mapping[str, str] = field(default_factory=dict)
    limits: Limits = Limits()

    def __post_init__(self) -> None:
        texts = [*self.files, *self.files.values(), *_words(self.command), self.image, *_words(self.notes)]
        texts += [*self.environment, *self.environment.values()]
        if wrong := [text for text in texts if not isinstance(text, str)]:
            raise TypeError(f"expected text in an export, found {wrong[0]!r}")
        if not self.command:
            raise ValueError("expected a command, found none")
        if not isinstance(self.limits, Limits):
            raise TypeError(f"expected Limits, found {self.limits!r}")
        for name in (*self.files, self.image):
            place = PurePosixPath(name)
            if place.is_absolute() or not place.parts or ".." in place.parts or "\0" in name:
                raise ValueError(f"expected a name inside the folder of the export, found {name!r}")


class Unsupported(CrossrayError):
    """The renderer cannot carry this scene; reads as a sentence for the user."""


def number(value: float) -> str:
    """A number as any language of scenes reads it. Raises Unsupported for a product that overflowed."""
    if not math.isfinite(value):
        raise Unsupported("the scene's numbers are so large that their products overflow")
    return repr(float(value))


def spaced(values: Iterable[float]) -> str:
    """Numbers with spaces between them, each as `number` has it."""
    return " ".join(map(number, values))


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


def check_adapter(module: object) -> Adapter:
    """The same module, once it has what an adapter needs. Raises TypeError for what is missing or of another kind."""
    for name in ("TITLE", "LICENCE", "INSTALL", "TIMING"):
        if not isinstance(getattr(module, name, None), str):
            raise TypeError(f"it has no text {name}")
    match getattr(module, "VERSION", None):
        case (tuple(command), str(pattern)) if command and all(isinstance(word, str) for word in command):
            patterns = {"VERSION": pattern, "TIMING": cast(Adapter, module).TIMING}
        case _:
            raise TypeError("its VERSION is not a command and a pattern")
    for name, pattern in patterns.items():
        if not re.compile(pattern).groups:
            raise TypeError(f"its pattern {name} has no group")
    re.compile(getattr(module, "SUMMARY", ""))
    if not callable(getattr(module, "export", None)):
        raise TypeError("it has no function export")
    return cast(Adapter, module)


def _words(value: tuple[str, ...]) -> tuple[str, ...]:
    if not isinstance(value, tuple):
        raise TypeError(f"expected a tuple of texts, found {value!r}")
    return value
