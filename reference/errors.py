"""The exception tree. Library code raises; only the command line turns errors into messages and exit codes.

CrossrayError
├── InputError          what was asked for cannot be done as asked
│   └── SceneError      a scene file is wrong, at a place
└── FailureError        something that should have worked did not
    ├── OutputError     a file could not be written
    ├── DeviceError     Dr.Jit has no backend that works here
    └── RendererError   another renderer crashed, ran out of time or left no usable picture
"""

from __future__ import annotations


class CrossrayError(Exception):
    """Base of everything crossray raises on purpose."""


class InputError(CrossrayError):
    """Bad input: a missing file, a wrong option, an unknown format."""


class SceneError(InputError):
    """A scene file is wrong. Reads as `path:line:column: expected ..., found ...`, both counted from 1."""

    def __init__(self, path: str, line: int, column: int, expected: str, found: str) -> None:
        super().__init__(f"{path}:{line}:{column}: expected {expected}, found {found}")
        self.path, self.line, self.column, self.expected, self.found = path, line, column, expected, found


class SceneWarning(UserWarning):
    """A legal but unusual number in a scene file. Reads as `path:line:column: ...`."""


class FailureError(CrossrayError):
    """A sound request that could not be carried out."""


class OutputError(FailureError):
    """A file could not be written; what stood there before still does."""


class DeviceError(FailureError):
    """Dr.Jit cannot run on this machine as asked."""


class RendererError(FailureError):
    """A renderer crashed, ran out of time or left no usable picture. `log` holds what it printed."""

    def __init__(self, message: str, log: str = "") -> None:
        super().__init__(message)
        self.log = log


def plain(message: str) -> str:
    """One line that no terminal takes for a command: names of files and what renderers say can hold anything."""
    return "".join(letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in message)
