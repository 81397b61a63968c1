"""Writing files so that nothing half-written is left and nothing existing is lost."""

from __future__ import annotations

import atexit
import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from reference.errors import OutputError

UMASK = os.umask(0o077)  # which can only be read by changing it, for all threads
os.umask(UMASK)

_begun: set[Path] = set()  # temporary files that may exist


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its place when the block ends well, and is gone when it does not.

    Raises OutputError where the file cannot be written; what stood at `path` is then still there.
    """
    target = Path(os.path.realpath(path))
    temporary = target.parent / f".crossray-{os.urandom(8).hex()}{target.suffix}"
    _begun.add(temporary)  # before it is there: a signal may end the program at any moment
    try:
        if target.exists() and not target.is_file():
            found = "a directory" if target.is_dir() else "a device"
            raise OutputError(f"{path}: expected a file to write, found {found}")
        if target.exists() and not os.access(target, os.W_OK):
            raise OutputError(f"{path}: cannot be written: permission denied")
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        yield temporary
        if target.exists():
            shutil.copymode(target, temporary)
        else:
            temporary.chmod(0o666 & ~UMASK)
        os.replace(temporary, target)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {(error.strerror or str(error)).lower()}") from error
    finally:
        _clear(temporary)


def _clear(temporary: Path) -> None:
    with suppress(OSError):
        temporary.unlink()
    _begun.discard(temporary)


@atexit.register
def _clear_all() -> None:
    """What a signal kept from being cleared away."""
    for temporary in list(_begun):
        _clear(temporary)


def write_text(path: str | Path, text: str) -> None:
    """Write a UTF-8 text file whole or not at all. Raises OutputError."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")


def make_folder(path: str | Path) -> Path:
    """The folder at `path`, made with its parents where missing. Raises OutputError."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = "a file is in the way" if error.errno in (errno.EEXIST, errno.ENOTDIR) else error.strerror
        raise OutputError(f"{path}: cannot be made a folder: {(reason or str(error)).lower()}") from error
    return Path(path)
