"""The pictures of a grade: files beside grade.json, small enough for a class, exact where a pixel matters."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.files import make_folder, replacing
from reference.image import Picture, quantise

AMPLIFIED = 8  # the difference picture: 32 levels are white
THUMB, SMALL = 112, 224  # pixels a side
QUALITIES = (85, 70, 50, 30, 10)  # of JPEG, the first that is small enough
PIXELS_A_BYTE = 4
ZOOM = 21  # pixels a side around the worst one


@dataclass(frozen=True)
class Album:
    """Where the pictures go, in `folder`, and how large the largest are; `exact` ones lose nothing but size."""

    folder: Path
    side: int
    exact: bool

    def save(self, name: str, levels: Picture, side: int | None = None) -> str:
        """Write a picture scaled down to at most `side` pixels a side; returns its name with the ending."""
        from PIL import Image

        image = Image.fromarray(quantise(levels))
        limit = self.side if side is None else side
        if max(image.size) > limit:
            image.thumbnail((limit, limit), Image.Resampling.BOX)
        if side is None and self.exact:
            data = io.BytesIO()
            image.save(data, "PNG")
            return self._write(f"{name}.png", data)
        for quality in QUALITIES:
            data = io.BytesIO()
            image.save(data, "JPEG", quality=quality, subsampling="4:2:0")
            if data.tell() <= limit * limit // PIXELS_A_BYTE:
                break
        return self._write(f"{name}.jpg", data)

    def save_difference(self, name: str, excess: NDArray[np.floating[Any]], side: int | None = None) -> str:
        """Likewise for an error in levels, amplified; scaled down, the worst pixel of each tile remains."""
        limit = self.side if side is None else side
        factor = -(-max(excess.shape[:2]) // limit)
        return self.save(name, tiled(excess, factor) * AMPLIFIED, side)

    def save_zoom(self, name: str, levels: Picture, column: int, row: int) -> str:
        """Write the surroundings of a pixel, pixel by pixel."""
        from PIL import Image

        left, top, width, height = surroundings(levels.shape, column, row)
        data = io.BytesIO()
        Image.fromarray(quantise(levels[top : top + height, left : left + width])).save(data, "PNG")
        return self._write(f"{name}.png", data)

    def _write(self, name: str, data: io.BytesIO) -> str:
        make_folder((self.folder / name).parent)
        with replacing(self.folder / name) as temporary:
            temporary.write_bytes(data.getbuffer())
        return name


def tiled(excess: NDArray[np.floating[Any]], factor: int) -> NDArray[np.floating[Any]]:
    """The largest error of each channel in each factor x factor tile."""
    if factor <= 1:
        return excess
    height, width, channels = excess.shape
    padded = np.zeros((-(-height // factor) * factor, -(-width // factor) * factor, channels), excess.dtype)
    padded[:height, :width] = excess
    rows = padded.reshape(padded.shape[0] // factor, factor, padded.shape[1], channels).max(axis=1)
    return np.asarray(rows.reshape(rows.shape[0], rows.shape[1] // factor, factor, channels).max(axis=2))


def surroundings(shape: tuple[int, ...], column: int, row: int) -> tuple[int, int, int, int]:
    """Left, top, width and height of what is shown around a pixel of a picture of `shape`."""
    height, width = shape[:2]
    across, down = min(ZOOM, width), min(ZOOM, height)
    left = min(max(0, column - across // 2), width - across)
    top = min(max(0, row - down // 2), height - down)
    return left, top, across, down
