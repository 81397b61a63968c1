"""What is said of a picture, in one sentence each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from reports.envelope import Envelope
from reports.registration import LEAST, Displacement
from reports.submission import Facts
from reports.verdict import Verdict, worst_channel

RIGHT = "Every pixel is one that a right tracer could have made."
ROUNDED = "Right, with levels rounded that the document truncates: no pixel is off by more than one level."
TOGETHER = {  # why pixels are wrong of which each might be right
    "displaced": "all of them displaced alike",
    "lookalike": "all of them as a known mistake draws them",
}
MOSTLY = 0.9  # of the wrong pixels are on the objects that are named
STRANGE = 0.5  # of the picture wrong without a known mistake: it may be one of something else


def form(facts: Facts) -> str:
    """A file's format."""
    sampling = f", {facts.subsampling}" if facts.subsampling else ""
    return f"{facts.format}, {facts.bits} bit {facts.channels}{sampling}"


def praise(verdict: Verdict) -> str:
    """Of a right picture."""
    return ROUNDED if verdict.rounding else RIGHT


def blame(verdict: Verdict, outside: int, total: int, where: str) -> str:
    """Of a wrong picture: how many pixels, of so many, are wrong, and where."""
    share = f"{outside / total:.2%}".replace(".00%", "%").replace("%", " %")
    what = "cannot be right"
    if set(verdict.reasons) <= set(TOGETHER):
        what = f"are off, {', '.join(TOGETHER[reason] for reason in verdict.reasons)}"
    return f"{outside} of {total} pixels ({share}) {what}, {where}."


def where(bounds: Envelope, excess: NDArray[Any]) -> str:
    """The objects that nearly all wrong pixels are on."""
    seen = Counter(bounds.objects[(worst_channel(excess) > 0)].tolist())
    names, told = [], 0
    for number, count in seen.most_common():
        names.append(bounds.names[number])
        told += count
        if told >= MOSTLY * seen.total():
            break
    if len(names) > 4:
        return "everywhere"
    if names == ["background"]:
        return "where nothing is seen"
    return "on " + " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def point_aside(moved: Displacement) -> str:
    """How a picture is displaced as a whole, and what to look at."""
    told = (
        (moved.right, "too far right", "too far left"),
        (moved.down, "too low", "too high"),
        (moved.wider, "too wide at the right and left border", "too narrow at the right and left border"),
        (moved.taller, "too tall at the upper and lower border", "too flat at the upper and lower border"),
    )
    parts = [f"{abs(size):.1f} pixels {more if size > 0 else less}" for size, more, less in told if abs(size) >= LEAST]
    return f"Everything is {', '.join(parts)}: which point of the screen does a pixel's ray go through?"


def advise(share: float, features: Sequence[str]) -> str:
    """What to do about a picture that shows none of the known mistakes."""
    if features:
        return f"The difference lies in the {' and '.join(features)}. Follow the rays of the worst pixel."
    if share > STRANGE:
        return "Most of it is unlike the scene: is it a picture of this scene at all, with the assignment's camera?"
    return "Follow the rays of the worst pixel and compare each number with your program's."
