"""A comparison of two pictures that shows itself in a notebook."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import InputError
from reference.image import quantise, read_image
from reports.metrics import Measurement, measure

AMPLIFIED = 32  # the difference picture: 8 levels of error are white
Source = str | Path | NDArray[Any]


@dataclass(frozen=True)
class Comparison:
    """Two pictures, height x width x 3 in levels, and what is measured of them. In a notebook it shows itself."""

    right: NDArray[Any]
    other: NDArray[Any]
    names: tuple[str, str]
    measured: Measurement

    @property
    def agrees(self) -> bool:
        """Whether no channel of any pixel differs by more than half a level."""
        return not self.measured.over["0.5"]

    def __str__(self) -> str:
        """The numbers, one a line."""
        return self.measured.as_text()

    def _repr_html_(self) -> str:
        difference = np.abs(np.clip(self.right, 0, 255) - np.clip(self.other, 0, 255)) * AMPLIFIED
        pictures = zip(
            (*self.names, f"difference x {AMPLIFIED}"),
            (self.right, self.other, np.nan_to_num(difference, nan=255)),
            strict=True,
        )
        figures = "".join(
            f'<figure style="margin:0"><img src="{_address(levels)}" alt="{escape(name)}" '
            f'style="max-width:20em"><figcaption>{escape(name)}</figcaption></figure>'
            for name, levels in pictures
        )
        verdict = "agree" if self.agrees else "disagree"
        return (
            f'<div style="display:flex;gap:1em;flex-wrap:wrap">{figures}</div>'
            f"<p><strong>{verdict}</strong></p><pre>{escape(str(self))}</pre>"
        )


def compare(right: Source, other: Source) -> Comparison:
    """Compare two pictures, given as files or as arrays in levels. Raises InputError for what cannot be compared."""
    one, two = _load(right), _load(other)
    if one.shape != two.shape:
        raise InputError(f"expected two pictures of one size, found {_size(one)} and {_size(two)}")
    names = _name(right, "right"), _name(other, "other")
    return Comparison(one, two, names, measure(one, two))


def _load(source: Source) -> NDArray[Any]:
    levels = source if isinstance(source, np.ndarray) else read_image(Path(source))
    if levels.ndim != 3 or levels.shape[2] != 3:
        raise InputError(f"expected a picture of height x width x 3, found {' x '.join(map(str, levels.shape))}")
    return levels


def _size(levels: NDArray[Any]) -> str:
    return f"{levels.shape[1]}x{levels.shape[0]}"


def _name(source: Source, otherwise: str) -> str:
    return otherwise if isinstance(source, np.ndarray) else Path(source).name


def _address(levels: NDArray[Any]) -> str:
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(quantise(levels)).save(data, "PNG")
    return "data:image/png;base64," + base64.b64encode(data.getvalue()).decode("ascii")
