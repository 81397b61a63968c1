"""Why a pixel differs from the certified truth: one class for each pixel, by proof, or none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference.proof import Admissible, Colour, Prover
from reference.rules import DOCUMENT_RULES, Rules
from reference.scene import EYE, Triple
from reference.witness import find_error
from reports.metrics import TOLERANCE

KNIFE_EDGE, DOCUMENT_WINDOW = "knife-edge", "document-window"
PRECISION, LIMIT = "renderer-precision", "declared-limit"
CLASSES = {
    KNIFE_EDGE: "No precision can decide the pixel, and this is one of the colours that it may have.",
    DOCUMENT_WINDOW: "The colour by the document's text, whose smallest distance is 1e-4 where the truth has none.",
    PRECISION: "The other side of a branch, or a path between mirrors, within the error of the renderer's arithmetic.",
    LIMIT: "The colour by rays that start where the renderer starts them, or without what is closer to their start, or"
    " farther, than it can see.",
}
STEPS = (2.0**-8, 2.0**-4, 1.0)  # of the declared precision: the smallest that explains a pixel is named
CLOSE = 0.1  # levels: how near a renderer must come to the colour of another branch
WEAK = 0.5  # levels: a colour that leeway makes wider than this is no evidence
GIVE_UP = 16_000  # unexplained pixels times surfaces; what is left then is not examined
GIVE_UP_PATHS = 400  # unexplained pixels times the square of the rays on a path; then no paths are searched any more


class Reason(NamedTuple):
    """A class and the evidence for it."""

    kind: str
    evidence: str


def account(
    prover: Prover, limits: Mapping[str, Any], picture: NDArray[Any], places: NDArray[np.intp]
) -> list[Reason | None]:
    """A reason for each of `places` (row, column) of a picture in levels, None for those that are unexplained.

    `limits` are what the renderer declared: `precision`, the relative error of its points and directions; `gap` and
    `far`, the distances from the start of a ray up to which and from which on it may miss things; `ahead`, `origin` and
    `short`, where its rays start and end. After many unexplained pixels no paths with errors are searched for the rest,
    and after very many the rest counts as unexplained, too.
    """
    most = max(50, GIVE_UP // max(1, prover.surfaces))
    most_searched = max(5, GIVE_UP_PATHS // (prover.depth + 1) ** 2)
    reasons: list[Reason | None] = []
    unexplained = 0
    for row, column in places.tolist():
        red, green, blue = map(float, picture[row, column])
        value, search = (red, green, blue), unexplained < most_searched
        reason = explain_pixel(prover, limits, column, row, value, search) if unexplained < most else None
        unexplained += reason is None
        reasons.append(reason)
    return reasons


def explain_pixel(
    prover: Prover, limits: Mapping[str, Any], column: int, row: int, value: Triple, search: bool = True
) -> Reason | None:
    """Which class holds `value`, the colour that a renderer gave a pixel; None for no class.

    Without `search` no paths with errors are searched, which takes long.
    """
    if not all(map(math.isfinite, value)):
        return None
    truth = prover.admissible(column, row)
    if not truth.proven and not truth.exhausted and any(_holds(colour, value) for colour in truth.colours):
        number = f"{len(truth.colours)}" if truth.complete else f"at least {len(truth.colours)}"
        return Reason(KNIFE_EDGE, f"one of {number} admissible colours")
    if _explains(prover.admissible(column, row, DOCUMENT_RULES), truth.colours, value, TOLERANCE):
        return Reason(DOCUMENT_WINDOW, "the colour by the document's text")
    precision, gap, far, ahead, short = (
        limits.get(name, 0.0) for name in ("precision", "gap", "far", "ahead", "short")
    )
    start = Rules(ahead=ahead, origin=tuple(limits.get("origin", EYE)), short=short)
    usual = truth.colours
    if ahead or short:
        other = prover.admissible(column, row, start).colours
        if any(_is_evidence(colour, value) for colour in other):
            return Reason(LIMIT, f"the colour by rays that start off their surface, by {ahead:g} of the coordinates")
        usual += other
    for kind, sight in ((PRECISION, start), (LIMIT, replace(start, gap=gap, far=far))):
        widest = replace(sight, precision=precision)
        if not widest.has_leeway or (kind == LIMIT and not sight.has_leeway):
            continue
        found = prover.admissible(column, row, widest)
        if found.complete and not any(_holds(colour, value) for colour in found.colours):
            continue
        for step in (0.0, *STEPS) if sight.has_leeway else STEPS:
            rules = replace(sight, precision=precision * step)
            if not found.proven and _explains(prover.admissible(column, row, rules), usual, value, CLOSE):
                return Reason(kind, f"the other side of a branch, reached by {_evidence(rules)}")
        searched = search and kind == PRECISION and not any(_holds(colour, value) for colour in truth.colours)
        if searched and (error := find_error(prover, column, row, value, widest)):
            return Reason(kind, f"a path with errors of up to 2^{math.log2(error):.1f} of the coordinates")
    return None


def _explains(other: Admissible, usual: tuple[Colour, ...], value: Triple, tolerance: float) -> bool:
    """Whether the value is a sharp colour of a branch that does not agree with the usual ones."""
    return any(
        _is_evidence(colour, value, tolerance) and not any(_holds(colour, right.value) for right in usual)
        for colour in other.colours
    )


def _is_evidence(colour: Colour, value: Triple, tolerance: float = CLOSE) -> bool:
    """Whether a colour is sharp and the value's."""
    return max(colour.radius) <= WEAK and _holds(colour, value, tolerance)


def _holds(colour: Colour, value: Triple, tolerance: float = TOLERANCE) -> bool:
    """Whether each channel of the value, clamped, is within the colour's ball, widened by `tolerance` levels."""
    return all(
        _clamped(centre - radius) - tolerance <= _clamped(found) <= _clamped(centre + radius) + tolerance
        for centre, radius, found in zip(colour.value, colour.radius, value, strict=True)
    )


def _clamped(level: float) -> float:
    return min(255.0, max(0.0, level))


def _evidence(rules: Rules) -> str:
    sight = [f"nearer than {rules.gap:g} to the start of a ray"] if rules.gap else []
    sight += [f"farther than {rules.far:g} from it"] if rules.far else []
    parts = [f"missing what is {' or '.join(sight)}"] if sight else []
    parts += [f"an error of 2^{math.log2(rules.precision):g} of the coordinates"] if rules.precision else []
    return " and ".join(parts)
