"""Renderers that misbehave, a shell script each, offered as another distribution offers its own: from PYTHONPATH."""

import os
import time
from collections.abc import Mapping
from pathlib import Path

MODULE = """\
from translator.contract import Export
TITLE, LICENCE, INSTALL, TIMING = "Fake", "MIT", "get fake", "in ([0-9.]+) s"
VERSION = (("sh", "-c", {version!r}), r"Fake (\\S+)")
def export(scene, settings):
    return Export({{"draw.sh": {script!r}}}, ("sh", "draw.sh"), "scene.png")
"""
METADATA = "Metadata-Version: 2.1\nName: fakes\nVersion: 1.0\n"
ANSWERS = "echo Fake 1.2"


def offer(folder: Path, scripts: Mapping[str, str], versions: Mapping[str, str] | None = None) -> dict[str, str]:
    """Make renderers of shell scripts by their names; returns the environment in which they are installed."""
    information = folder / "fakes-1.0.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text(METADATA, encoding="utf-8")
    points = [f"{name} = fake_{name.replace('-', '_')}\n" for name in scripts]
    (information / "entry_points.txt").write_text("[crossray.renderers]\n" + "".join(points), encoding="utf-8")
    for name, script in scripts.items():
        version = (versions or {}).get(name, ANSWERS)
        text = MODULE.format(version=version, script=script + "\n")
        (folder / f"fake_{name.replace('-', '_')}.py").write_text(text, encoding="utf-8")
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    return os.environ | {"PYTHONPATH": path}


def hang(note: Path) -> str:
    """A script that ignores what can be ignored, starts another process, writes both their ids and hangs."""
    return f"trap '' TERM INT HUP; sleep 60 & echo $$ $! > {note}.part; mv {note}.part {note}; sleep 60; sleep 60"


def wait_for(*notes: Path) -> list[int]:
    """The ids that such scripts have written, once they have."""
    end = time.monotonic() + 30
    while not all(note.exists() for note in notes):
        assert time.monotonic() < end
        time.sleep(0.01)
    return [int(word) for note in notes for word in note.read_text(encoding="ascii").split()]


def is_running(process: int) -> bool:
    """Whether a process is there and not only waits for its parent to notice its end."""
    try:
        state = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"


def are_gone(processes: list[int]) -> bool:
    """Whether none is running, or very soon none."""
    end = time.monotonic() + 2
    while any(map(is_running, processes)):
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True
