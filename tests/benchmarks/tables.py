"""Numbers as the page shows them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from statistics import median

from turns import Entry, Pace, ratio

NONE = "–"
ROUNDS = Pace().rounds
INSTANT = 1e-6  # seconds: the least that is left of a time when another is taken off


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(row)} |\n" for row in lines)


def time(value: float) -> str:
    """Three digits, in seconds or milliseconds."""
    return f"{_digits(value)} s" if value >= 1 else f"{_digits(1000 * value)} ms"


def _digits(value: float) -> str:
    """Three significant digits, whole from 100 on."""
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def spread(entry: Entry | None) -> str:
    """Median, least and largest; or why there is none."""
    if not entry or "reason" in entry:
        return entry["reason"] if entry else NONE
    times = entry["seconds"]
    if len(times) == 1:
        return f"{time(times[0])} (once)"
    fewer = f", {len(times)} rounds" if len(times) < ROUNDS else ""
    return f"{time(median(times))} ({time(min(times))} to {time(max(times))}{fewer})"


def known(entry: Entry | None) -> bool:
    """Whether there are times."""
    return bool(entry and entry.get("seconds"))


def times_faster(theirs: Entry | None, ours: Entry | None) -> float | None:
    """The ratio of their time to ours."""
    if not theirs or not ours or not (known(theirs) and known(ours)):
        return None
    return ratio(theirs["seconds"], ours["seconds"])


def factor(value: float | None) -> str:
    """A ratio."""
    return NONE if value is None else f"{value:.1f}x" if value < 100 else f"{value:.0f}x"


def prepared(entry: Entry | None) -> float | None:
    """The median seconds of preparing the scene, if known."""
    return median(entry["prepared"]) if entry and entry.get("prepared") else None


def tracing(entry: Entry) -> Entry:
    """The entry without the time of preparing the scene, for a contender whose time includes it."""
    both = zip(entry["seconds"], entry["prepared"], strict=True)
    return entry | {"seconds": [max(INSTANT, whole - one) for whole, one in both]}
