"""Which mistakes a wrong picture shows: each known mistake's own picture is held against it.

A picture and each hypothesis are compared in blocks of some pixels, on which JPEG, antialiasing and jitter have little
effect. What a hypothesis explains is the share of the difference to the right picture that is gone where the mistake's
picture takes its place. One mistake is preferred to a number fitted, and that to two mistakes at once.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import CrossrayError
from reference.mistakes import FAMILIES, MISTAKES, Family, Mistake, combine, light_at
from reference.model import DOCUMENT
from reference.scene import LIGHT, Scene
from reference.slips import draw, missing
from reference.world import View
from reports.submission import Facts
from reports.verdict import store

Levels = NDArray[np.float32]

LARGEST = 1000  # pixels a side that mistakes are drawn at, at most
COARSE = 250  # blocks a side that pictures are compared in, or so
ROUGH = 2  # blocks beside each other, where that will do
QUIET = 1.0  # levels that a block may be off without a reason
MOST = 48.0  # levels: a block that is farther off counts no more
NAMED = 0.7  # the least share of a cause that is named, not guessed
RIVAL = 3.0  # times as much as the best leaves unexplained, what another that is named may leave
GUESS = 0.25  # the least share of a cause that is listed
LEFT = 0.004  # of the difference: what is left unexplained that tells nothing
PAIR_COST, FIT_COST = 1.7, 1.3  # how many times as much a second mistake, or a number, must explain of what is left
PLAIN, FEW = 5.0, 0.002  # levels that a block is off beyond doubt, and the share of blocks that may be
AUDIBLE = 1.1  # times the noise of its file: what a difference must be at least
SURE = 0.985  # the share of a JPEG's difference from which on nothing else is looked for
LISTED = 5
PAIRED = 8  # pairs that are drawn
NEARBY = (0.8, 0.9, 0.95, 0.975, 1.025, 1.05, 1.1, 1.2)  # times the right number, that are tried
PROMISING = 0.97  # of the difference may be left by a family's best number for it to be looked into
SPECKS = 0.9  # of the pixels that are off must be just as the mistake has them, where it comes and goes


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


class Hypothesis:
    """A mistake and its picture, as blocks."""

    def __init__(self, ids: tuple[str, ...], mistakes: tuple[Mistake, ...], blocks: Levels, value: float | None = None):
        self.ids, self.mistakes, self.blocks, self.value = ids, mistakes, blocks, value

    def rank(self, share: float) -> float:
        """What is left unexplained, dearer for a second mistake or a number that was fitted: the less the better."""
        cost: float = PAIR_COST ** (len(self.ids) - 1) * FIT_COST ** (self.value is not None)
        return max(1 - share, LEFT) * cost


class Suspects:
    """The pictures of all known mistakes for one scene, size and depth; made once, for many pictures."""

    def __init__(self, scene: Scene, view: View) -> None:
        self.scene = scene
        shrink = -(-max(view.width, view.height) // LARGEST)
        self.view = replace(view, width=-(-view.width // shrink), height=-(-view.height // shrink))
        self.block = max(1, min(self.view.width, self.view.height) // COARSE)
        self._noise: dict[Any, float] = {}
        self.rough = self.block * ROUGH
        self.small = replace(self.view, width=self.view.width // self.rough, height=self.view.height // self.rough)

    def draw(self, mistake: Mistake, *, roughly: bool = False) -> Levels | None:
        """The picture that a mistake makes, as in a file, in blocks; or `roughly`, by few rays. None for none."""
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            try:
                levels = mistake.draw(self.scene, self.small if roughly else self.view)
            except CrossrayError:
                return None
        return blocks(as_bytes(levels), 1 if roughly else self.block)

    def blocks_of(self, levels: NDArray[Any]) -> Levels:
        """Somebody's picture, of any size, in the same blocks."""
        return blocks(resized(levels, self.view), self.block)

    def roughly(self, picture: Levels) -> Levels:
        """Blocks as `draw` has them roughly."""
        return blocks(picture, ROUGH)[: self.small.height, : self.small.width]

    @cached_property
    def right(self) -> Levels:
        """The right picture in blocks."""
        return blocks(as_bytes(draw(self.scene, DOCUMENT, self.view)), self.block)

    def noise(self, facts: Facts) -> float:
        """How far the right picture is from itself, once it has been through a file with these facts."""
        if facts.tables not in self._noise:
            whole = as_bytes(draw(self.scene, DOCUMENT, self.view))
            self._noise[facts.tables] = distance(blocks(store(whole, facts), self.block), self.right)
        return self._noise[facts.tables]

    @cached_property
    def singles(self) -> list[Hypothesis]:
        """Every known mistake that changes this scene's picture."""
        drawn = ((id_, mistake, self.draw(mistake)) for id_, mistake in MISTAKES.items())
        return [
            Hypothesis((id_,), (mistake,), picture)
            for id_, mistake, picture in drawn
            if picture is not None and not mistake.speckled and distance(picture, self.right) > 0
        ]

    @cached_property
    def missed(self) -> Levels:
        """How much of what meets nothing reaches each block."""
        return blocks(missing(self.scene, DOCUMENT, self.view), self.block)


def as_bytes(levels: NDArray[Any]) -> Levels:
    """Clamped and truncated, as in a file."""
    whole = np.floor(np.fmin(np.fmax(np.asarray(levels, np.float32), 0), 255))  # what is not a number becomes 0
    return np.asarray(whole, np.float32)


def resized(levels: NDArray[Any], view: View) -> Levels:
    """The picture at the size of a view, by the mean of what falls into each pixel, or its nearest."""
    height, width = levels.shape[:2]
    if (height, width) == (view.height, view.width):
        return np.asarray(levels, np.float32)
    if height % view.height == 0 and width % view.width == 0 and height // view.height == width // view.width:
        return blocks(np.asarray(levels, np.float32), height // view.height)
    from skimage.transform import resize

    shape = (view.height, view.width)
    return np.asarray(resize(np.asarray(levels, np.float32), shape, order=1, anti_aliasing=True), np.float32)


def blocks(levels: NDArray[Any], size: int) -> Levels:
    """The means of blocks of size x size pixels; what is left over at the right and below is left out."""
    height, width = (side // size * size for side in levels.shape[:2])
    if size == 1:
        return np.asarray(levels, np.float32)
    parts = levels[:height, :width].reshape(height // size, size, width // size, size, -1)
    return np.asarray(np.add.reduce(np.add.reduce(parts, 3, np.float32), 1) / size**2, np.float32)


def distance(one: Levels, other: Levels) -> float:
    """How far apart two pictures are: the largest channel of each block, without what is too small to tell, in all."""
    return float(off(np.abs(one - other)).sum())


def off(error: Levels) -> NDArray[np.float32]:
    """What counts of the error of each block."""
    worst = np.maximum(np.maximum(error[..., 0], error[..., 1]), error[..., 2])
    return np.asarray(np.minimum(np.maximum(worst - QUIET, 0), MOST), np.float32)


def diagnose(suspects: Suspects, levels: NDArray[Any], facts: Facts) -> list[Cause]:
    """The likeliest causes of a wrong picture (height x width x 3, in levels), most likely first; maybe none.

    What its format alone would do to the right picture is no difference that a cause could explain.
    """
    picture = suspects.blocks_of(levels)
    base, noise = distance(picture, suspects.right), suspects.noise(facts)
    if base <= 0:
        return []
    if base < AUDIBLE * noise:
        noise = 0.0

    def share(hypothesis: Hypothesis) -> float:
        return 1 - max(0.0, distance(picture, hypothesis.blocks) - noise) / (base - noise)

    found = [(share(single), single) for single in suspects.singles]
    found += [(share(speck), speck) for speck in _speckles(suspects, levels)]
    enough = SURE if noise else 1 - 2 * LEFT
    for further in (_fitted, _pairs):
        if not _is_settled(picture, enough, max(found, key=lambda pair: pair[0], default=None)):
            found += [(share(one), one) for one in further(suspects, picture, found)]
    found.sort(key=lambda pair: pair[1].rank(pair[0]))
    causes: list[Cause] = []
    best = max((part for part, _ in found), default=0.0)
    for part, hypothesis in found:
        cause = _cause(part, hypothesis, part >= NAMED and 1 - part <= RIVAL * max(1 - best, LEFT))
        if part >= GUESS and cause.id not in [known.id for known in causes]:
            causes.append(cause)
    return causes[:LISTED]


def _is_settled(picture: Levels, enough: float, best: tuple[float, Hypothesis] | None) -> bool:
    """Whether what the best hypothesis leaves is no more than JPEG and antialiasing may do."""
    if best is None or best[0] < NAMED:
        return False
    return best[0] > enough or float(np.mean(off(np.abs(picture - best[1].blocks)) > PLAIN)) < FEW


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


def _speckles(suspects: Suspects, levels: NDArray[Any]) -> Iterator[Hypothesis]:
    """Mistakes that come and go: pixels are right, or just as the mistake has them, side by side."""
    full = resized(levels, suspects.view)
    right = as_bytes(draw(suspects.scene, DOCUMENT, suspects.view))
    wrong = np.abs(full - right).max(axis=-1) > 8
    if not wrong.any():
        return
    for id_, mistake in MISTAKES.items():
        if not mistake.speckled:
            continue
        marred = as_bytes(mistake.draw(suspects.scene, suspects.view))
        can = np.abs(marred - right).max(axis=-1) > 8
        as_told = wrong & (np.abs(full - marred).max(axis=-1) <= 8)
        if as_told.sum() < SPECKS * wrong.sum() or wrong.sum() > 0.95 * can.sum():
            continue
        mixed = np.where(as_told[..., None], marred, right)
        yield Hypothesis((id_,), (mistake,), blocks(mixed, suspects.block))


def _fitted(suspects: Suspects, picture: Levels, found: Any) -> Iterator[Hypothesis]:
    """The families' best numbers."""
    for id_, family in FAMILIES.items():
        yield from _best_value(suspects, picture, id_, family)
    yield from _background(suspects, picture)
    if max((part for part, _ in found), default=0.0) < NAMED:
        yield _light(suspects, picture)


def _best_value(suspects: Suspects, picture: Levels, id_: str, family: Family) -> Iterator[Hypothesis]:
    @cache
    def error(value: float) -> float:
        made = suspects.draw(family.of(value), roughly=True)
        return np.inf if made is None else distance(rough, made)

    rough = suspects.roughly(picture)

    low, high = family.bounds
    grid = np.geomspace(low, high, 7) if low > 0 else np.linspace(low, high, 7)
    right = family.right(suspects.scene)
    starts = [*map(float, grid), *(right * share for share in NEARBY if low <= right * share <= high)]
    best = min(starts, key=error)
    if error(best) > PROMISING * distance(rough, suspects.roughly(suspects.right)):
        return
    step = grid[1] / grid[0] if low > 0 else grid[1] - grid[0]
    for _ in range(9):  # the interval around the best is divided again and again
        step = step**0.5 if low > 0 else step / 2
        sides = (best / step, best * step) if low > 0 else (best - step, best + step)
        best = min((best, *(float(np.clip(value, low, high)) for value in sides)), key=error)
    mistake = family.mistake(best, suspects.scene)
    if (made := suspects.draw(mistake)) is not None:
        yield Hypothesis((id_,), (mistake,), made, best)


def _background(suspects: Suspects, picture: Levels) -> Iterator[Hypothesis]:
    """The colour that is seen where rays meet nothing: what is over there, by channel."""
    seen = suspects.missed.max(axis=-1) > 0.9
    if seen.sum() < 16:
        return
    colour = np.median((picture - suspects.right)[seen], axis=0)
    if np.abs(colour).max() <= 2 * QUIET:
        return
    told = ", ".join(f"{level:.0f}" for level in colour)
    mistake = replace(MISTAKES["R14"], title=f"the background is ({told}), not black")
    made = np.clip(suspects.right + suspects.missed * colour, 0, 255).astype(np.float32)
    yield Hypothesis(("R14",), (mistake,), made, float(colour.max()))


def _light(suspects: Suspects, picture: Levels) -> Hypothesis:
    """The place of the light that explains most: from usual ones, along each axis with ever smaller steps."""

    @cache
    def error(place: tuple[float, float, float]) -> float:
        made = suspects.draw(light_at(place), roughly=True)
        return np.inf if made is None else distance(rough, made)

    rough = suspects.roughly(picture)

    x, y, z = LIGHT
    starts = [(-x, y, z), (x, -y, z), (x, y, -z), (-x, y, -z), (x, y, 0.0), (0.0, y, 0.0), (0.0, y, z), (0.0, 0.0, 0.0)]
    best = min(starts, key=error)
    step = 250.0
    while step >= 4:
        sides = [
            tuple(c + step * sign * (i == axis) for i, c in enumerate(best)) for axis in range(3) for sign in (1, -1)
        ]
        better: Any = min([best, *sides], key=error)
        step = step / 2 if better == best else step
        best = better
    made = suspects.draw(light_at(best))
    return Hypothesis(("LP",), (light_at(best),), suspects.right if made is None else made)


def _pairs(suspects: Suspects, picture: Levels, found: list[tuple[float, Hypothesis]]) -> Iterator[Hypothesis]:
    """Two mistakes at once: first guessed as the sum of what each changes, then drawn."""
    singles = [one for _, one in found if len(one.ids) == 1 and not one.mistakes[0].speckled]
    coarse = max(1, min(picture.shape[:2]) // 60)
    target, right = blocks(picture, coarse), blocks(suspects.right, coarse)
    changes = [blocks(one.blocks, coarse) - right for one in singles]
    guesses = []
    for one, other in combinations(range(len(singles)), 2):
        a, b = singles[one], singles[other]
        if a.ids[0].partition("/")[0] == b.ids[0].partition("/")[0]:
            continue
        guess = min(_after(a, b, right, changes[one], changes[other], target))
        guesses.append((guess, one, other))
    guesses.sort()
    tried = 0
    for _, one, other in guesses:
        if tried == PAIRED:
            return
        both = combine(singles[one].mistakes[0], singles[other].mistakes[0])
        made = suspects.draw(both) if both else None
        if made is None:
            continue
        tried += 1
        ids = (*singles[one].ids, *singles[other].ids)
        yield Hypothesis(ids, (singles[one].mistakes[0], singles[other].mistakes[0]), made)


def _after(a: Hypothesis, b: Hypothesis, right: Levels, one: Levels, other: Levels, target: Levels) -> Iterator[float]:
    """How far off the guesses at a pair's picture are: what each changes, added; or done with the other's picture."""
    yield distance(np.clip(right + one + other, 0, 255), target)
    for first, second in ((one, b), (other, a)):
        if transform := ON_LEVELS.get(second.ids[0]):
            yield distance(transform(np.clip(right + first, 0, 255)), target)


ON_LEVELS: dict[str, Callable[[Levels], Levels]] = {
    "C1": lambda levels: levels[::-1],
    "C2": lambda levels: levels[:, ::-1],
    "C3": lambda levels: levels.swapaxes(0, 1) if levels.shape[0] == levels.shape[1] else levels,
    "Q4": MISTAKES["Q4"].after,
    "Q5": MISTAKES["Q5"].after,
}
