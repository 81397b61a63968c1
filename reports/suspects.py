"""The pictures that the known mistakes make of one scene, and how far a picture is from each.

Pictures are compared in blocks of some pixels, on which antialiasing and jitter have little effect. What a JPEG does is
done to the mistake's picture, too.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import CrossrayError
from reference.mistakes import MISTAKES, Mistake
from reference.model import DOCUMENT
from reference.scene import Scene
from reference.slips import draw, missing
from reference.world import View
from reports.submission import Facts
from reports.verdict import store, worst_channel

Levels = NDArray[np.float32]

LARGEST = 1000  # pixels a side that mistakes are drawn at, at most
COARSE = 250  # blocks a side that pictures are compared in, or so
ROUGH = 2  # blocks beside each other, where that will do
QUIET = 1.0  # levels that a block may be off without a reason
MOST = 48.0  # levels: a block that is farther off counts no more
KEPT = 96  # pictures as a file keeps them, that are kept
PAIR_COST, FIT_COST = 1.7, 1.3  # how many times as much a second mistake, or a number, must explain of what is left
LEFT = 0.002  # of the difference: what is left unexplained that tells nothing


class Hypothesis:
    """A mistake, or two, with the whole picture that it makes (`whole`), and that in blocks."""

    def __init__(
        self,
        ids: tuple[str, ...],
        mistakes: tuple[Mistake, ...],
        blocks: Levels,
        whole: Callable[[], Levels],
        value: float | None = None,
    ) -> None:
        self.ids, self.mistakes, self.blocks, self.whole, self.value = ids, mistakes, blocks, whole, value

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
        self.rough = self.block * ROUGH
        self.small = replace(self.view, width=self.view.width // self.rough, height=self.view.height // self.rough)
        self.in_file = lru_cache(KEPT)(self._in_file)

    def draw(self, mistake: Mistake, *, small: bool = False) -> Levels | None:
        """The whole picture that a mistake makes, as in a file; or a `small` one, by few rays. None for none."""
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            try:
                return as_bytes(mistake.draw(self.scene, self.small if small else self.view))
            except CrossrayError:
                return None

    def suspect(
        self, ids: tuple[str, ...], mistakes: tuple[Mistake, ...], drawn: Mistake, value: float | None = None
    ) -> Hypothesis | None:
        """The hypothesis of a mistake that is drawn. None where it makes no picture."""
        made = self.draw(drawn)
        if made is None:
            return None
        return Hypothesis(ids, mistakes, blocks(made, self.block), lambda: self._drawn(drawn), value)

    def given(
        self, ids: tuple[str, ...], mistakes: tuple[Mistake, ...], whole: Levels, value: float | None = None
    ) -> Hypothesis:
        """The hypothesis of a picture that is there."""
        return Hypothesis(ids, mistakes, blocks(whole, self.block), lambda: whole, value)

    def _drawn(self, mistake: Mistake) -> Levels:
        made = self.draw(mistake)
        assert made is not None
        return made

    def blocks_of(self, levels: NDArray[Any]) -> Levels:
        """Somebody's picture, of any size, in the same blocks."""
        return blocks(resized(levels, self.view), self.block)

    def roughly(self, picture: Levels) -> Levels:
        """Blocks as small pictures have them."""
        return blocks(picture, ROUGH)[: self.small.height, : self.small.width]

    def _in_file(self, hypothesis: Hypothesis, facts: Facts) -> Levels:
        """What a file with these facts keeps of a hypothesis, in blocks; the last ones are kept."""
        return blocks(store(hypothesis.whole(), facts), self.block) if facts.lossy else hypothesis.blocks

    @cached_property
    def right_whole(self) -> Levels:
        """The right picture, truncated."""
        return as_bytes(draw(self.scene, DOCUMENT, self.view))

    @cached_property
    def right(self) -> Hypothesis:
        """That nothing is wrong."""
        return self.given((), (), self.right_whole)

    @cached_property
    def rounded(self) -> Hypothesis:
        """That nothing is wrong, with levels rounded."""
        return self.given((), (), as_bytes(np.rint(draw(self.scene, DOCUMENT, self.view))))

    @cached_property
    def singles(self) -> list[Hypothesis]:
        """Every known mistake that changes this scene's picture."""
        made = (self.suspect((id_,), (mistake,), mistake) for id_, mistake in MISTAKES.items() if not mistake.speckled)
        return [single for single in made if single and distance(single.blocks, self.right.blocks) > 0]

    @cached_property
    def missed(self) -> Levels:
        """How much of what meets nothing reaches each pixel."""
        return missing(self.scene, DOCUMENT, self.view)


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
    rows = np.add.reduce(levels[:height, :width].reshape(height // size, size, width, -1), 1, np.float32)
    parts = rows.reshape(height // size, width // size, size, -1)
    return np.asarray(sum(parts[:, :, part] for part in range(size)) / np.float32(size**2), np.float32)


def distance(one: Levels, other: Levels) -> float:
    """How far apart two pictures are: the largest channel of each block, without what is too small to tell, in all."""
    return float(off(np.abs(one - other)).sum())


def off(error: Levels) -> NDArray[np.float32]:
    """What counts of the error of each block."""
    return np.asarray(np.minimum(np.maximum(worst_channel(error) - QUIET, 0), MOST), np.float32)
