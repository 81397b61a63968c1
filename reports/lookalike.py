"""Wrong pictures of which each pixel might be right: all of them together are what a known mistake draws.

A mistake that moves edges by a part of a pixel, or that changes no more than a JPEG does, hides within what the pixels
may show. It is told by its own picture: what is left of the difference where that takes the right one's place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from reports.submission import Submission
from reports.suspects import QUIET, Suspects, distance, off
from reports.verdict import Verdict

VISIBLE = 8.0  # levels that a block must be off the right picture
SHOWN = 5e-4  # of the blocks that must be so
LEFT = 0.5  # of the difference: the most that the mistake's picture may leave; for right pictures it is larger than 1
CLOSEST = 6  # mistakes that are put through a JPEG as the picture was


def look_again(verdict: Verdict, of_scene: Callable[[], Suspects], submission: Submission) -> Verdict:
    """The verdict, or a new one with the reason "lookalike" where a known mistake draws that very picture."""
    facts = submission.facts
    if not verdict.right or (verdict.exact and not facts.lossy):
        return verdict
    suspects = of_scene()
    if submission.levels.shape[:2] != (suspects.view.height, suspects.view.width):
        return verdict
    picture = suspects.blocks_of(submission.levels)
    right = [suspects.in_file(one, facts) for one in (suspects.right, suspects.rounded)]
    error = np.minimum(*(off(np.abs(picture - one)) for one in right))
    if np.mean(error > VISIBLE - QUIET) <= SHOWN:
        return verdict
    closest = sorted(suspects.singles, key=lambda single: distance(picture, single.blocks))[:CLOSEST]
    most = LEFT * float(error.sum())
    if any(distance(picture, suspects.in_file(single, facts)) <= most for single in closest):
        return replace(verdict, right=False, reasons=("lookalike",))
    return verdict
