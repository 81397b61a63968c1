"""What a certificate says, as text for people and as data for programs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from reference.certification import CERTAIN, KNIFE_EDGE, UNDECIDED, Certificate
from reference.proof import PROVEN, Admissible

LISTED = 10  # pixels, and colours of each, in the text


def as_text(certificate: Certificate) -> Iterator[str]:
    """The counts, and the first pixels that are not proven with the colours that they may have."""
    total = certificate.mask.size
    proven, edges, undecided = (certificate.count(kind) for kind in (CERTAIN, KNIFE_EDGE, UNDECIDED))
    yield f"{total} pixels: {proven} proven to {PROVEN:g} level, {edges} knife edges, {undecided} undecided"
    for (column, row), found in list(certificate.edges.items())[:LISTED]:
        yield f"column {column}, row {row}: {_colours(found)}"
    if (more := len(certificate.edges) - LISTED) > 0:
        yield f"and {more} more"


def _colours(found: Admissible) -> str:
    shown = [f"({', '.join(f'{value:.6g}' for value in colour.value)})" for colour in found.colours[:LISTED]]
    if (more := len(found.colours) - LISTED) > 0:
        shown.append(f"{more} more")
    if not found.complete:
        shown.append("colours that could not be found")
    return " or ".join(shown)


def as_data(certificate: Certificate) -> dict[str, Any]:
    """The same in full. Colours are in levels, not clamped; the first is that of the model's rule for ties."""
    height, width = certificate.mask.shape
    edges = [
        {
            "column": column,
            "row": row,
            "complete": found.complete,
            "colours": [list(colour.value) for colour in found.colours],
        }
        for (column, row), found in certificate.edges.items()
    ]
    counts = {"proven": CERTAIN, "knife-edge": KNIFE_EDGE, "undecided": UNDECIDED}
    return {
        "width": width,
        "height": height,
        "pixels": {name: certificate.count(kind) for name, kind in counts.items()},
        "edges": edges,
    }
