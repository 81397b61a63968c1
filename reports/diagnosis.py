"""Which mistakes a wrong picture shows: each known mistake's own picture is held against it.

What a hypothesis explains is the share of the difference to the right picture that is gone where the mistake's picture
takes its place. One mistake is preferred to a number fitted, and that to two mistakes at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.fitting import fitted
from reports.pairs import pairs
from reports.speckles import speckles
from reports.submission import Facts
from reports.suspects import LEFT, Hypothesis, Levels, Suspects, distance, off

NAMED = 0.7  # the least share of a cause that is named, not guessed
RIVAL = 3.0  # times as much as the best leaves unexplained, what another that is named may leave
GUESS = 0.25  # the least share of a cause that is listed
PLAIN, FEW = 5.0, 0.002  # levels that a block is off beyond doubt, and the share of blocks that may be
AUDIBLE = 1.1  # times the noise of its file: what a difference must be at least
SURE = 0.985  # the share of the difference from which on nothing else is looked for, where a JPEG is not done again
CLOSEST = 12  # mistakes that are put through a JPEG as the picture was
LISTED = 5


@dataclass(frozen=True)
class Cause:
    """A mistake, or several, that would make the picture: `share` is how much of the difference that explains."""

    id: str
    title: str
    share: float
    looks: str
    hint: str
    features: tuple[str, ...]
    named: bool
    parts: tuple[tuple[str, str], ...]  # id and title of each mistake
    value: float | None = None  # of a number that was fitted


def diagnose(suspects: Suspects, levels: NDArray[Any], facts: Facts) -> list[Cause]:
    """The likeliest causes of a wrong picture (height x width x 3, in levels), most likely first; maybe none.

    What its format alone would do to the right picture is no difference that a cause could explain.
    """
    picture = suspects.blocks_of(levels)
    again = facts.lossy and levels.shape[:2] == (suspects.view.height, suspects.view.width)

    def kept(hypothesis: Hypothesis) -> Levels:
        return suspects.in_file(hypothesis, facts) if again else hypothesis.blocks

    base = distance(picture, kept(suspects.right))
    if base <= 0:
        return []
    noise = distance(kept(suspects.rounded), kept(suspects.right))
    if base < AUDIBLE * noise:
        noise = 0.0

    def weigh(hypotheses: Iterable[Hypothesis]) -> list[tuple[float, Hypothesis]]:
        return [(1 - max(0.0, distance(picture, kept(one)) - noise) / (base - noise), one) for one in hypotheses]

    singles = sorted(suspects.singles, key=lambda single: distance(picture, single.blocks))
    found = weigh(singles[:CLOSEST] if again else singles)
    found += weigh(speckles(suspects, levels))
    enough = SURE if facts.lossy and not again else 1.0
    if not _is_settled(picture, enough, found, kept):
        found += weigh(fitted(suspects, picture, light=_best(found)[0] < NAMED))
    if not _is_settled(picture, enough, found, kept):
        found += weigh(pairs(suspects, picture, singles))
    return _causes(found)


def _best(found: list[tuple[float, Hypothesis]]) -> tuple[float, Hypothesis | None]:
    return max(found, key=lambda pair: pair[0], default=(0.0, None))


def _is_settled(
    picture: Levels, enough: float, found: list[tuple[float, Hypothesis]], kept: Callable[[Hypothesis], Levels]
) -> bool:
    """Whether what the best hypothesis leaves is no more than JPEG and antialiasing may do."""
    share, best = _best(found)
    if best is None or share < NAMED:
        return False
    return share > enough or float(np.mean(off(np.abs(picture - kept(best))) > PLAIN)) < FEW


def _causes(found: list[tuple[float, Hypothesis]]) -> list[Cause]:
    """The best of each mistake, without those that explain next to nothing, or are a better one and something more."""
    best = _best(found)[0]
    causes: list[Cause] = []
    for share, hypothesis in sorted(found, key=lambda pair: pair[1].rank(pair[0])):
        cause = _cause(share, hypothesis, share >= NAMED and 1 - share <= RIVAL * max(1 - best, LEFT))
        if share >= GUESS and not any({*known.parts} <= {*cause.parts} for known in causes):
            causes.append(cause)
    return causes[:LISTED]


def _cause(share: float, hypothesis: Hypothesis, named: bool) -> Cause:
    ids = [id_.partition("/")[0] for id_ in hypothesis.ids]
    mistakes = hypothesis.mistakes
    return Cause(
        id="+".join(ids),
        title="; and ".join(mistake.title for mistake in mistakes),
        share=round(max(0.0, share), 4),
        looks="; ".join(mistake.looks for mistake in mistakes),
        hint=" ".join(mistake.hint for mistake in mistakes),
        features=tuple(dict.fromkeys(mistake.feature for mistake in mistakes)),
        named=named,
        parts=tuple((id_, mistake.title) for id_, mistake in zip(ids, mistakes, strict=True)),
        value=hypothesis.value,
    )
