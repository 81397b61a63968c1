"""What the page and its plots show, worked out of what was measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import median
from typing import Any

from tables import known, times_faster, tracing
from turns import Entry

Results = Mapping[str, Any]
TITLES = {
    "povray": "POV-Ray",
    "tachyon": "Tachyon",
    "mitsuba": "Mitsuba 3",
    "radiance": "Radiance",
    "c++ double": "C++ double",
    "c++ float": "C++ float",
    "auto": "crossray auto",
    "double": "crossray double",
    "single": "crossray single",
    "certify": "certify",
}
OURS = ("auto", "double", "single")
BUILT = 10_000  # spheres from which on crossray's time is the whole one, building its tree included


def ours(part: Results) -> str:
    """The precision that ratios are to."""
    return str(part["machine"]["ours"])


def contenders(rows: Mapping[str, Mapping[str, Entry]], among: Mapping[str, str] = TITLES) -> list[str]:
    """Who was measured anywhere, in the order of TITLES."""
    return [name for name in among if any(name in row for row in rows.values())]


def others(rows: Mapping[str, Mapping[str, Entry]]) -> list[str]:
    """All but crossray."""
    return [name for name in contenders(rows) if name not in (*OURS, "certify")]


def example_ratios(part: Results) -> dict[str, dict[str, float]]:
    """By example and contender, how many times faster crossray is."""
    found = {
        scene: {name: times_faster(row.get(name), tracing(row[ours(part)])) for name in others(part["rows"])}
        for scene, row in part["rows"].items()
    }
    return {scene: {name: value for name, value in row.items() if value} for scene, row in found.items()}


def tracing_only(rows: Mapping[str, Any]) -> dict[str, dict[str, Entry]]:
    """The contenders of each number of spheres, crossray's time without what preparing took, as peers report theirs:
    but for many spheres, where it is the whole time.
    """
    return {
        number: {n: e if int(number) >= BUILT else alone(n, e) for n, e in row["contenders"].items()}
        for number, row in rows.items()
    }


def alone(name: str, entry: Entry) -> Entry:
    """A contender's entry with tracing alone, without preparing the scene, as peers report theirs."""
    return tracing(entry) if name in OURS and known(entry) else entry


def time_of(name: str) -> Callable[[Entry], float]:
    """Median seconds of tracing alone."""
    return lambda entry: median(alone(name, entry)["seconds"])


def nanoseconds(entry: Entry | None, side: str) -> float | None:
    """Of a pixel."""
    return 1e9 * median(entry["seconds"]) / int(side) ** 2 if entry and known(entry) else None
