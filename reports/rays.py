"""The ray tree behind a pixel as rows of a table, for people who look for their own mistake."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from reference.explanation import Bounce, Explanation


def ray_rows(explanation: Explanation) -> list[dict[str, str]]:
    """One row a ray: what it hits, its terms, why the diffuse one is as it is, and what it adds to the pixel."""
    return [_row(bounce) for bounce in explanation.bounces]


def _row(bounce: Bounce) -> dict[str, str]:
    ray = f"reflection {bounce.depth}" if bounce.depth else "camera"
    if bounce.hit is None:
        return {"ray": ray, "hit": "nothing", "adds": ""}
    if bounce.lit:
        why = f"lit, n·l = {bounce.cosine:.4f}"
    elif bounce.blockers:
        why = f"in the shadow of {bounce.blockers[0].surface}"
    else:
        why = "faces away from the light" if not bounce.cosine else "in shadow"
    return {
        "ray": ray,
        "hit": f"{bounce.hit}, t = {bounce.t:.4f}",
        "ambient": triple(bounce.ambient),
        "diffuse": triple(bounce.diffuse),
        "why": why,
        "share": f"{bounce.weight:.4g}",
        "adds": triple(bounce.contribution),
    }


def pixel_sentence(explanation: Explanation, found: Sequence[float]) -> str:
    """What was expected at a pixel, how that comes about, and what was found."""
    hits = []
    for bounce in explanation.bounces:
        row = _row(bounce)
        who = "its ray" if not bounce.depth else "the mirrored ray"
        hits.append(f"{who} hits {bounce.hit} ({row['why']})" if bounce.hit else f"{who} hits nothing")
    right = ", ".join(map(str, explanation.bytes))
    yours = ", ".join(f"{value:.0f}" for value in found)
    return (
        f"The worst pixel, column {explanation.column}, row {explanation.row}: yours is ({yours}), right is ({right}): "
        f"{', '.join(hits)}."
    )


def triple(values: Sequence[float] | None) -> str:
    """Levels with one digit after the point."""
    return " ".join(f"{value:.1f}" for value in values or ())


def as_rows(explanation: Explanation) -> dict[str, Any]:
    """The table and its sum."""
    return {"rays": ray_rows(explanation), "sum": " ".join(map(str, explanation.bytes))}
