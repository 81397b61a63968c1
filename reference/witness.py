"""A path with small errors that brings back a given colour: what rounding can do where mirrors magnify it.

Balls grow faster than errors do, and after a few round mirrors they hold everything. One path whose errors are known
proves as much: where each of its points and directions is off by no more than a renderer's own may be, and its colour
is the one in question, that renderer may find this colour.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from flint import arb
from numpy.typing import NDArray

from reference.enclosure import Point, Tables
from reference.proof import Prover
from reference.rules import Rules
from reference.scene import Triple
from reference.walk import UnboundedError, UndecidedError, Walk

Array = NDArray[np.float64]  # errors: for each point and direction in turn, as shares of the precision; or levels

BITS = 128
SIZES = (0.0, *(2.0**power for power in range(-10, 5, 2)))  # of the errors with which a search starts
TRIES = 64  # starts of each size; the one that comes nearest is followed
PROBE = 2.0**-10  # how far errors are varied to see what they do
STEPS = 12  # of Newton's method
STRAY = 16.0  # how far over the precision the errors may be on the way to such as are not
MET = 0.01  # levels


class _Path(Walk):
    """A walk whose points and directions are off by what is given, as shares of their largest coordinate."""

    def __init__(self, tables: Tables, rules: Rules, errors: Array) -> None:
        super().__init__(tables, rules, [], may_choose=False)
        self.errors = iter(errors)

    def loosened(self, point: Point) -> Point:
        size = max(abs(value.mid()) for value in point)
        x, y, z = (value + size * arb(error) for value, error in zip(point, next(self.errors), strict=True))
        return (x, y, z)


class _Search:
    """Newton's method for the errors that make a pixel's colour, clamped, the one in question."""

    def __init__(self, prover: Prover, tables: Tables, pixel: tuple[int, int], rules: Rules, goal: Array) -> None:
        self.depth, self.direction, self.tables = prover.depth, prover.direction(*pixel), tables
        self.precision, self.rules, self.goal = rules.precision, replace(rules, precision=0.0), goal

    def miss(self, errors: Array) -> Array:
        """What the path's colour lacks: levels; infinite for a path that is no path."""
        try:
            colour = _Path(self.tables, self.rules, errors * self.precision).colour(self.direction, self.depth)
        except (UndecidedError, UnboundedError):
            return np.full(3, math.inf)
        return np.asarray(self.goal - np.clip([float(channel.mid()) for channel in colour], 0, 255))

    def follow(self, errors: Array) -> Array | None:
        """Errors near those that meet the goal, none of them over 1: at each step the least change that would do."""
        for _ in range(STEPS):
            miss = self.miss(errors)
            if not (np.isfinite(miss).all() and np.abs(errors).max() <= STRAY):
                return None
            if np.abs(miss).max() <= MET:
                return errors if np.abs(errors).max() <= 1 else None
            probes = PROBE * np.eye(errors.size).reshape(-1, *errors.shape)
            slopes = np.array([miss - self.miss(errors + probe) for probe in probes]).T / PROBE
            if not np.isfinite(slopes).all():
                return None
            errors = errors + np.linalg.lstsq(slopes, miss, rcond=1e-9)[0].reshape(errors.shape)
        return None


def find_error(prover: Prover, column: int, row: int, colour: Triple, rules: Rules) -> float | None:
    """How large errors suffice, relative and within the precision of `rules`, for a path that brings back `colour`.

    None if none is found. The colour is met within a hundredth of a level. The search is the same each time.
    """
    pick = np.random.default_rng(0)
    with prover.tables(BITS) as tables:
        search = _Search(prover, tables, (column, row), rules, np.clip(colour, 0, 255))
        for size in SIZES:
            starts = size * pick.uniform(-1, 1, (TRIES if size else 1, 2 * prover.depth + 2, 3))
            errors = search.follow(min(starts, key=lambda start: float(np.abs(search.miss(start)).max())))
            if errors is not None:
                return rules.precision * float(np.abs(errors).max())
    return None
