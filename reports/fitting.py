"""Mistakes with a number, or a place, that is found by trying: the field of view, the light, the background."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from reference.mistakes import FAMILIES, MISTAKES, Family, light_at
from reference.scene import LIGHT
from reports.suspects import QUIET, Hypothesis, Levels, Suspects, as_bytes, blocks, distance

NEARBY = (0.8, 0.9, 0.95, 0.975, 1.025, 1.05, 1.1, 1.2)  # times the right number, that are tried
PROMISING = 0.97  # of the difference may be left by a family's best number for it to be looked into
HALVINGS = 9  # of the interval around the best number
MISSED = 0.9  # of what a block shows is what meets nothing
FIRST_STEP, LAST_STEP = 250.0, 4.0  # of the light


def fitted(suspects: Suspects, picture: Levels, *, light: bool) -> Iterator[Hypothesis]:
    """Each family with its best number for a picture in blocks, and the light's best place if it is asked for."""
    for id_, family in FAMILIES.items():
        yield from _best_value(suspects, picture, id_, family)
    yield from _background(suspects, picture)
    if light:
        yield from _best_light(suspects, picture)


def _best_value(suspects: Suspects, picture: Levels, id_: str, family: Family) -> Iterator[Hypothesis]:
    @cache
    def error(value: float) -> float:
        made = suspects.draw(family.of(value), small=True)
        return np.inf if made is None else distance(rough, made)

    rough = suspects.roughly(picture)
    low, high = family.bounds
    grid = np.geomspace(low, high, 7) if low > 0 else np.linspace(low, high, 7)
    right = family.right(suspects.scene)
    starts = [*map(float, grid), *(right * share for share in NEARBY if low <= right * share <= high)]
    best = min(starts, key=error)
    if error(best) > PROMISING * distance(rough, suspects.roughly(suspects.right.blocks)):
        return
    step = grid[1] / grid[0] if low > 0 else grid[1] - grid[0]
    for _ in range(HALVINGS):
        step = step**0.5 if low > 0 else step / 2
        sides = (best / step, best * step) if low > 0 else (best - step, best + step)
        best = min((best, *(float(np.clip(value, low, high)) for value in sides)), key=error)
    mistake = family.mistake(best, suspects.scene)
    if found := suspects.suspect((id_,), (mistake,), mistake, best):
        yield found


def _background(suspects: Suspects, picture: Levels) -> Iterator[Hypothesis]:
    """The colour that is seen where rays meet nothing: what is over there, by channel."""
    seen = blocks(suspects.missed, suspects.block).max(axis=-1) > MISSED
    if seen.sum() < 16:
        return
    colour = np.median((picture - suspects.right.blocks)[seen], axis=0)
    if np.abs(colour).max() <= 2 * QUIET:
        return
    told = ", ".join(f"{level:.0f}" for level in colour)
    mistake = replace(MISTAKES["R14"], title=f"the background is ({told}), not black")
    whole = as_bytes(suspects.right_whole + suspects.missed * colour)
    yield suspects.given(("R14",), (mistake,), whole, float(colour.max()))


def _best_light(suspects: Suspects, picture: Levels) -> Iterator[Hypothesis]:
    """The place of the light that explains most: from usual ones, along each axis with ever smaller steps."""

    @cache
    def error(place: tuple[float, float, float]) -> float:
        made = suspects.draw(light_at(place), small=True)
        return np.inf if made is None else distance(rough, made)

    rough = suspects.roughly(picture)
    x, y, z = LIGHT
    starts = [(-x, y, z), (x, -y, z), (x, y, -z), (-x, y, -z), (x, y, 0.0), (0.0, y, 0.0), (0.0, y, z), (0.0, 0.0, 0.0)]
    best = min(starts, key=error)
    step = FIRST_STEP
    while step >= LAST_STEP:
        sides = [
            tuple(c + step * sign * (i == axis) for i, c in enumerate(best)) for axis in range(3) for sign in (1, -1)
        ]
        better: Any = min([best, *sides], key=error)
        step = step / 2 if better == best else step
        best = better
    mistake = light_at(best)
    if found := suspects.suspect(("LP",), (mistake,), mistake):
        yield found
