"""Contenders measured in turn, so that a change of the machine's speed meets all alike; medians and ratios."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import CrossrayError

Picture = NDArray[np.floating[Any]]
Entry = dict[str, Any]  # what is kept of a contender, as JSON


@dataclass(frozen=True)
class Run:
    """One measurement: the seconds that count, those of preparing the scene where known, and the picture."""

    seconds: float
    prepared: float | None = None
    picture: Picture | None = None


@dataclass(frozen=True)
class Pace:
    """How often to measure: `rounds` after one that does not count, as far as `budget` seconds a contender allow."""

    rounds: int = 5
    budget: float = 15.0
    renders: int = 5  # within a round, of which the median counts, where a contender can draw more than once
    timeout: float = 90.0  # seconds a peer's whole process may take


QUICK = Pace(rounds=0, renders=1)


def seconds(action: Callable[[], object]) -> float:
    """How long an action takes."""
    start = perf_counter()
    action()
    return perf_counter() - start


def in_turn(actions: Mapping[str, Callable[[], Run]], pace: Pace) -> dict[str, Entry]:
    """Of each contender the seconds round by round, or the reason why there are none.

    `off` is how many pixels are over half a level off the first contender's, `whole` what one run takes in all. Where
    the budget allows no further round, the first one counts and `cold` is set.
    """
    entries: dict[str, Entry] = {}
    left: dict[str, int] = {}
    first: Picture | None = None
    for name, action in actions.items():
        start = perf_counter()
        try:
            run = action()
        except CrossrayError as error:
            entries[name] = {"reason": str(error)}
            continue
        whole = perf_counter() - start
        left[name] = min(pace.rounds, int(pace.budget / whole))
        entries[name] = entry = {"seconds": [], "prepared": [], "whole": whole, "cold": left[name] == 0}
        if entry["cold"]:
            _keep(entry, run)
        if run.picture is not None:
            first = run.picture if first is None else first
            entry["off"] = pixels_off(run.picture, first)
    for round_ in range(max(left.values(), default=0)):
        for name in left:
            if round_ < left[name] and "reason" not in entries[name]:
                try:
                    _keep(entries[name], actions[name]())
                except CrossrayError as error:
                    entries[name] = {"reason": str(error)}
    return entries


def _keep(entry: Entry, run: Run) -> None:
    entry["seconds"].append(run.seconds)
    if run.prepared is not None:
        entry["prepared"].append(run.prepared)


def pixels_off(one: Picture, other: Picture) -> int:
    """How many pixels differ by more than half a level in any channel, both clamped."""
    error = np.abs(np.clip(one, 0, 255) - np.clip(other, 0, 255))
    return int((~(error <= 0.5)).any(axis=-1).sum())


def ratio(theirs: Sequence[float], ours: Sequence[float]) -> float:
    """The median of the ratios round by round; where one was measured less often, of the rounds that both have."""
    return median(a / b for a, b in zip(theirs, ours, strict=False))
