"""What installations take on disk, from what pip and Debian record of them."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Iterable
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
OURS = ("crossray.py", "reference", "translator", "reports", "scenes")  # an editable installation records none of it
FIELDS = ("Package", "Essential", "Installed-Size", "Pre-Depends", "Depends")


class Size(NamedTuple):
    """Bytes of a package alone, and of all that it needs with it."""

    alone: int
    whole: int


def installed_size(line: str, more: Iterable[str] = ()) -> Size | None:
    """Of the package that a line like `pip install x` or `apt-get install x` installs; None where it is not there.

    Of `pip install 'x[y]'` it is what the extra y adds to x. `more` are packages that are needed without being named.
    A Debian package is counted without what every Debian has.
    """
    match = re.match(r"(pip|apt-get) install '?([\w.+-]+)(?:\[([\w-]+)\])?", line)
    if not match:
        return None
    named = {match[2]}
    if match[3]:
        named = {*(_python_needs(match[2], match[3]) or ())} - {*(_python_needs(match[2]) or ())}
    packages, sizes, base = (
        (_python_closure, _python_size, set[str]())
        if match[1] == "pip"
        else (_debian_closure, _debian_size, _debian_closure(_essential()))
    )
    if not named or not named <= packages(named):
        return None
    return Size(sum(map(sizes, named)), sum(map(sizes, packages([*named, *more]) - base)))


def _closure(first: Iterable[str], needs: Callable[[str], Iterable[str] | None]) -> set[str]:
    """The packages and all that they need, as far as they are installed."""
    found: set[str] = set()
    waiting = list(first)
    while waiting:
        name = waiting.pop()
        if name not in found and (needed := needs(name)) is not None:
            found.add(name)
            waiting += needed
    return found


def _python_closure(first: Iterable[str]) -> set[str]:
    return _closure(first, _python_needs)


def _python_needs(name: str, extra: str = "") -> list[str] | None:
    try:
        wanted = map(Requirement, metadata.requires(name) or [])
    except metadata.PackageNotFoundError:
        return None
    return [each.name.lower() for each in wanted if not each.marker or each.marker.evaluate({"extra": extra})]


def _python_size(name: str) -> int:
    places = [ROOT / part for part in OURS] if name == "crossray" else []
    paths = [path for place in places for path in (place, *place.rglob("*")) if path.suffix != ".pyc"]
    paths += [Path(str(file.locate())) for file in metadata.files(name) or []]
    return sum(path.stat().st_size for path in {path.resolve() for path in paths} if path.is_file())


@cache
def _debian() -> dict[str, dict[str, str]]:
    """What dpkg knows of each installed package."""
    if not shutil.which("dpkg-query"):
        return {}
    form = "\\t".join(f"${{{field}}}" for field in FIELDS) + "\\n"
    answer = subprocess.run(["dpkg-query", "--show", "-f", form], capture_output=True, text=True, check=True).stdout
    rows = [dict(zip(FIELDS, line.split("\t"), strict=True)) for line in answer.splitlines()]
    return {row["Package"]: row for row in rows if row["Installed-Size"]}


def _essential() -> list[str]:
    return [name for name, row in _debian().items() if row["Essential"] == "yes"]


def _debian_closure(first: Iterable[str]) -> set[str]:
    return _closure(first, _debian_needs)


def _debian_needs(name: str) -> list[str] | None:
    if name not in _debian():
        return None
    needed = f"{_debian()[name]['Pre-Depends']},{_debian()[name]['Depends']}"
    return [word for group in needed.split(",") for word in re.findall(r"(?:^|\|)\s*([a-z0-9][\w.+-]*)", group)]


def _debian_size(name: str) -> int:
    return int(_debian()[name]["Installed-Size"]) * 1024
