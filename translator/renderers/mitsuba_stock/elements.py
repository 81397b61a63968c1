"""Elements of Mitsuba's XML that all parts of a scene use."""

from __future__ import annotations

from typing import Any

from reference.scene import Triple
from translator.contract import single, spaced
from translator.renderers.mitsuba_stock.limits import ORIGIN


def matrix(columns: list[Any], corner: list[float]) -> str:
    """A transform by three columns, the images of the axes, and a fourth, the image of (0, 0, 0)."""
    rows = [list(row) for row in zip(*columns, corner, strict=True)]
    text = "  ".join(spaced(row) for row in [*rows, [0.0, 0.0, 0.0, 1.0]])
    return f'<transform name="to_world"><matrix value="{text}"/></transform>'


def moved(point: Triple) -> list[float]:
    """Where a point of the assignment's world is in Mitsuba's."""
    return [a - b for a, b in zip(point, ORIGIN, strict=True)]


def constant(name: str, values: list[float]) -> str:
    """A colour kept as it is written, of any sign and size. Raises Unsupported beyond single precision."""
    value = " ".join(map(single, values))
    return f'<texture type="rawconstant" name="{name}"><vector name="value" value="{value}"/></texture>'
