"""Whether a picture is of the scene at all: a blank one or a photograph has no mistake of the assignment to name."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.envelope import Envelope
from reports.submission import Submission

SIDE = 64  # pixels to which pictures are reduced
SCALES = (0.5, 0.6, 0.75, 0.9, 1.0, 1.1, 1.35, 1.7, 2.0)  # of fields of view that are tried
BLANK = 3.0  # levels from the darkest to the brightest of a channel; twice that where a format is not exact
ALIKE = 0.3  # correlation, of levels or of edges: less is no likeness

Grey = NDArray[np.float64]


def blank(envelope: Envelope, submission: Submission) -> str | None:
    """In one sentence, that the picture has one colour; None where it has more, or should have one."""
    found = submission.levels
    if _spread(found) > BLANK * (2 if submission.facts.lossy else 1) or _spread(envelope.centre) <= BLANK:
        return None
    if submission.facts.transparent and not found.any():
        return "The picture is transparent all over: did the program write what it has drawn?"
    colour = ", ".join(str(int(level)) for level in np.median(found, axis=(0, 1)))
    return f"The picture is blank, all of it is ({colour}): did the program write what it has drawn?"


def unlike(envelope: Envelope, submission: Submission) -> str | None:
    """In one sentence, why the picture cannot be of the scene; None where it can, with whatever mistake.

    Turned, mirrored, in another size on the screen, in other colours or negative, a picture is still alike.
    """
    if _spread(envelope.centre) <= BLANK or resemblance(envelope.centre, submission.levels) >= ALIKE:
        return None
    return "The picture has nothing in common with this scene; it may be of another one, or no tracer's at all."


def resemblance(right: NDArray[Any], found: NDArray[Any]) -> float:
    """The largest correlation, 0 to 1, of levels or of edges of two pictures, in whatever position and size."""
    shown, best = _reduce(found), 0.0
    targets = [picture for picture in (shown, _edges(shown)) if picture.std() > 0]
    for guess in _positions(_reduce(right)):
        for target, candidate in zip(targets, (guess, _edges(guess)), strict=False):
            if candidate.std() > 0:
                best = max(best, abs(float(np.corrcoef(target.ravel(), candidate.ravel())[0, 1])))
    return best


def _spread(levels: NDArray[Any]) -> float:
    return float(np.ptp(levels, axis=(0, 1)).max())


def _reduce(levels: NDArray[Any]) -> Grey:
    """Grey, SIDE x SIDE: means over areas."""
    from PIL import Image

    grey = Image.fromarray(np.clip(levels, 0, 255).mean(axis=-1).astype(np.float32))
    return np.asarray(grey.resize((SIDE, SIDE), Image.Resampling.BOX), np.float64)


def _edges(grey: Grey) -> Grey:
    """How steep the picture is, wherever the light comes from; steps of a level count little more than of several."""
    down, right = np.gradient(grey)
    return np.asarray(np.sqrt(np.hypot(down, right)))


def _positions(grey: Grey) -> Iterator[Grey]:
    """The picture turned and mirrored, larger and smaller about its centre."""
    places = np.arange(SIDE) - (SIDE - 1) / 2
    for scale in SCALES:
        at = np.clip(np.rint(places / scale + (SIDE - 1) / 2), 0, SIDE - 1).astype(int)
        scaled = grey[np.ix_(at, at)]
        for turned in (scaled, scaled.T):
            yield from (turned, turned[::-1], turned[:, ::-1], turned[::-1, ::-1])
