"""How time grows with the number of spheres: 10 to a million of them."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from peers import DEPTH, SCALAR, Task, missing
from spheres import sphere_scene
from turns import Entry, Pace, in_turn, seconds

from reference.text import dump, parse

NUMBERS = (10, 100, 1_000, 10_000, 100_000, 1_000_000)
PEERS = ["povray", "tachyon", "mitsuba", "c++ double"]
LONGEST, LONGEST_SCALAR = 120.0, 20.0  # seconds that a run may take if time grows as the number does
FITTED_FROM = 1_000  # spheres


def measure_objects(pace: Pace, side: int = 1000, numbers: tuple[int, ...] = NUMBERS) -> dict[str, Any]:
    """Tracing by everyone, as long as it does not take too long, and reading the scene file by crossray."""
    absent = missing(PEERS)
    rows: dict[str, Any] = {}
    last: dict[str, Entry] = {}
    for number in numbers:
        print(f"objects: {number}", file=sys.stderr)
        scene = sphere_scene(number)
        text = dump(scene)
        reading = seconds(partial(parse, text))
        actions = Task(scene, side, pace).contenders([name for name in PEERS if name not in absent])
        reasons = {name: too_long(name, number, last.get(name)) for name in actions}
        row: dict[str, Entry] = {name: {"reason": reason} for name, reason in reasons.items() if reason}
        row |= in_turn({name: action for name, action in actions.items() if name not in row}, pace)
        last |= {name: {**entry, "number": number} for name, entry in row.items() if not reasons[name]}
        rows[str(number)] = {"contenders": row, "reading": reading, "bytes": len(text)}
    return {"side": side, "depth": DEPTH, "missing": absent, "rows": rows}


def too_long(name: str, number: int, last: Entry | None) -> str | None:
    """Why a contender is not even tried, after what it did with the most spheres that it was tried with."""
    if last is None:
        return None
    if "reason" in last:
        return f"not tried after {last['number']:,}"
    scalar = name in SCALAR
    expected = (last["seconds"][-1] if scalar else last["whole"]) * number / last["number"]
    if expected <= (LONGEST_SCALAR if scalar else LONGEST):
        return None
    taken = expected / number * last["number"]
    return f"not tried: {'tracing' if scalar else 'a whole run'} took {taken:.0f} s with {last['number']:,}"


def growth(rows: dict[str, Any], name: str, time: Callable[[Entry], float]) -> float | None:
    """The exponent of a contender's time in the number of spheres, by least squares from FITTED_FROM on."""
    found = {int(number): row["contenders"].get(name, {}) for number, row in rows.items() if int(number) >= FITTED_FROM}
    points = [(math.log(number), math.log(time(entry))) for number, entry in found.items() if entry.get("seconds")]
    if len(points) < 2:
        return None
    across, up = np.transpose(points)
    return float(np.polyfit(across, up, 1)[0])
