"""Mistakes that come and go from pixel to pixel: a pixel is right, or as the mistake has it, by chance of rounding."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.mistakes import MISTAKES
from reports.suspects import Hypothesis, Levels, Suspects, blocks, resized

VISIBLE = 8.0  # levels by which a mistake must change a pixel for it to tell anything
TILE = 4  # pixels a side, in which right and wrong ones are mixed
PART = 0.02  # of the way from right to wrong
MIXED = 0.6  # of the wrong pixels lie in tiles that are mixed
SPREAD = 0.15  # the least standard deviation, in a mixed tile, of how far pixels are on that way


def speckles(suspects: Suspects, levels: NDArray[Any]) -> Iterator[Hypothesis]:
    """What a picture, of any size, has of each mistake that comes and goes, where it is speckled."""
    found, right = resized(levels, suspects.view), suspects.right_whole
    for id_, mistake in MISTAKES.items():
        marred = suspects.draw(mistake) if mistake.speckled else None
        if marred is None:
            continue
        part = _part(found - right, marred - right)
        if _is_mixed(part):
            yield suspects.given((id_,), (mistake,), right + part[..., None] * (marred - right))


def _part(change: Levels, full: Levels) -> NDArray[np.float32]:
    """How far each pixel is on the way from right, 0, to wrong, 1: the nearest point of that way."""
    length = np.square(full).sum(axis=-1)
    along = (change * full).sum(axis=-1) / np.maximum(length, 1)
    return np.asarray(np.where(length > VISIBLE**2, np.clip(along, 0, 1), 0), np.float32)


def _is_mixed(part: NDArray[np.float32]) -> bool:
    """Whether right and wrong pixels lie side by side, not in areas."""
    mean, square = (blocks(values[..., None], TILE)[..., 0] for values in (part, part * part))
    spread = np.sqrt(np.maximum(square - mean * mean, 0))
    wrong = mean * (mean > PART)
    return bool(wrong.sum() > 0 and wrong[spread > SPREAD].sum() >= MIXED * wrong.sum())
