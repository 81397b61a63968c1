"""Two mistakes at once: guessed from what each changes, drawn small, and the most promising drawn whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations

import numpy as np

from reference.mistakes import MISTAKES, Mistake, combine
from reports.suspects import Hypothesis, Levels, Suspects, blocks, distance

SIDE = 60  # blocks a side, or so, on which pairs are guessed at
SKETCHED, DRAWN = 24, 7  # pairs that are drawn small, and whole
BEST = 2  # of the guesses are drawn whole in any case: a small picture has another largest level
DIM = 4.0  # levels, below which a ratio tells nothing
BRIGHT, WHITE = 16.0, 254.0  # levels between which a ratio tells much

Pair = tuple[Hypothesis, Hypothesis]


def pairs(suspects: Suspects, picture: Levels, singles: Sequence[Hypothesis]) -> Iterator[Hypothesis]:
    """The pairs of single mistakes that explain most of a picture in blocks."""
    sketched: list[tuple[float, int, Pair, Mistake]] = []
    rough = suspects.roughly(picture)
    for one, other in _guessed(suspects, picture, singles):
        both = combine(one.mistakes[0], other.mistakes[0])
        made = suspects.draw(both, small=True) if both else None
        if both and made is not None:
            sketched.append((distance(rough, made), len(sketched), (one, other), both))
        if len(sketched) == SKETCHED:
            break
    chosen = [*sketched[:BEST], *sorted(sketched[BEST:])][:DRAWN]
    for _, _, (one, other), both in chosen:
        ids, mistakes = (*one.ids, *other.ids), (*one.mistakes, *other.mistakes)
        if found := suspects.suspect(ids, mistakes, both):
            yield found


def _guessed(suspects: Suspects, picture: Levels, singles: Sequence[Hypothesis]) -> list[Pair]:
    """All pairs, those first whose guessed picture is closest."""
    coarse = max(1, min(picture.shape[:2]) // SIDE)
    target, right = blocks(picture, coarse), blocks(suspects.right.blocks, coarse)
    alone = [blocks(one.blocks, coarse) for one in singles]
    guesses = []
    for one, other in combinations(range(len(singles)), 2):
        if _row(singles[one]) != _row(singles[other]):
            made = _guesses(singles[one], singles[other], right, alone[one], alone[other], target)
            guesses.append((min(distance(guess, target) for guess in made), one, other))
    return [(singles[one], singles[other]) for _, one, other in sorted(guesses)]


def _row(single: Hypothesis) -> str:
    return single.ids[0].partition("/")[0]


def _guesses(
    a: Hypothesis, b: Hypothesis, right: Levels, one: Levels, other: Levels, target: Levels
) -> Iterator[Levels]:
    """Guesses at a pair's picture: what each adds, added; what each dims, multiplied; one done to the other's."""
    yield np.clip(one + other - right, 0, 255)
    yield np.clip(one * (other / np.maximum(right, DIM)), 0, 255)
    for first, second in ((one, b), (other, a)):
        if transform := ON_LEVELS.get(second.ids[0]):
            yield transform(first)
        if second.ids == ("Q6",):
            yield scaled(first, target)


def scaled(levels: Levels, target: Levels) -> Levels:
    """Levels times what makes most of them those of the target, as a picture that is divided by its largest level."""
    bright = (levels > BRIGHT) & (levels < WHITE)
    share = float(np.median(target[bright] / levels[bright])) if bright.any() else 1.0
    return np.asarray(np.clip(levels * np.float32(share), 0, 255), np.float32)


ON_LEVELS: dict[str, Callable[[Levels], Levels]] = {
    "C1": lambda levels: levels[::-1],
    "C2": lambda levels: levels[:, ::-1],
    "C3": lambda levels: levels.swapaxes(0, 1) if levels.shape[0] == levels.shape[1] else levels,
    "Q4": MISTAKES["Q4"].after,
    "Q5": MISTAKES["Q5"].after,
}
