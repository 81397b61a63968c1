"""How far a picture as a whole is displaced against the reference, in pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reports.envelope import Envelope

TILE = 32  # pixels: what is independent of what
LEAST = 0.3  # pixels that count
SURE = 6.0  # standard errors
TILES = 12  # that must hold edges


@dataclass(frozen=True)
class Displacement:
    """Pixels to the right and down, at the centre; and how many more of each at the right and lower border."""

    right: float
    down: float
    wider: float
    taller: float
    significant: bool


def displacement(envelope: Envelope, found: NDArray[np.float32]) -> Displacement:
    """Least squares of the difference on the reference's gradient, with errors from tile to tile.

    A step that moves by a part of a pixel changes that part of the pixels along it, so that the gradient of point
    samples tells it without bias; samples at random places, or many, do not move it.
    """
    centre = envelope.centre.sum(axis=-1)
    height, width = centre.shape
    if min(height, width) < 3:
        return Displacement(0, 0, 0, 0, False)
    difference = found.sum(axis=-1) - centre
    down, right = np.gradient(centre)
    edges = (envelope.high - envelope.low).max(axis=-1) > 4
    rows, columns = np.nonzero(edges)
    if rows.size == 0:
        return Displacement(0, 0, 0, 0, False)
    across, along = (columns + 0.5) / width * 2 - 1, (rows + 0.5) / height * 2 - 1
    gx, gy = right[rows, columns].astype(float), down[rows, columns].astype(float)
    design = -np.column_stack([gx, gy, gx * across, gy * along])
    target = difference[rows, columns].astype(float)
    normal = design.T @ design
    normal += 1e-9 * np.trace(normal) * np.eye(4) + 1e-12 * np.eye(4)
    inverse = np.linalg.inv(normal)
    fitted = inverse @ (design.T @ target)
    scores = design * (target - design @ fitted)[:, None]
    tiles = rows // TILE * (width // TILE + 1) + columns // TILE
    sums = np.column_stack([np.bincount(tiles, weights=scores[:, k]) for k in range(4)])
    used = len(np.unique(tiles))
    error = np.sqrt(np.diag(inverse @ (sums.T @ sums) @ inverse) * used / max(used - 1, 1))
    sure = (np.abs(fitted) > LEAST) & (np.abs(fitted) > SURE * error)
    return Displacement(*map(float, fitted), bool(sure.any()) and used >= TILES)
