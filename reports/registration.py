"""How far a picture as a whole is displaced against the reference, in pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.envelope import Envelope

TILE = 32  # pixels: what is independent of what
LEAST = 0.3  # pixels that count
EXPLAINED = 0.15  # of the difference's variance at edges, at least
DIFFERENT = 0.5  # of the variance that samples at the centres have: what has less is antialiased
SURE = 4.5  # standard errors
TILES = 6  # that must hold edges


@dataclass(frozen=True)
class Displacement:
    """Pixels to the right and down, at the centre; and how many more of each at the right and lower border."""

    right: float
    down: float
    wider: float
    taller: float
    explained: float  # of the difference's variance at edges
    significant: bool


def displacement(
    envelope: Envelope,
    found: NDArray[np.float32],
    stored: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None,
) -> Displacement:
    """Least squares of the difference on the gradient of the mean over pixels; errors by chance, and from tile to tile.

    A step that moves by a part of a pixel changes that part of the pixels along it, so that the gradient tells it
    without bias; samples at random places in the pixel, or many, do not move it. `stored` is what the picture's file
    would make of the mean and of samples at the centres: a JPEG moves edges, too.
    """
    mean = envelope.mean.sum(axis=-1)
    height, width = mean.shape
    if min(height, width) < 3:
        return Displacement(0, 0, 0, 0, 0, False)
    flat, centres = (side.sum(axis=-1) for side in stored or (envelope.mean, envelope.centre))
    difference = found.sum(axis=-1) - flat
    vertical, horizontal = np.gradient(mean)
    edges = (envelope.high - envelope.low).max(axis=-1) > 4
    rows, columns = np.nonzero(edges)
    if rows.size == 0:
        return Displacement(0, 0, 0, 0, 0, False)
    across, along = (columns + 0.5) / width * 2 - 1, (rows + 0.5) / height * 2 - 1
    gx, gy = horizontal[rows, columns].astype(float), vertical[rows, columns].astype(float)
    design = -np.column_stack([gx, gy, gx * across, gy * along])
    target = difference[rows, columns].astype(float)
    normal = design.T @ design
    normal += 1e-9 * np.trace(normal) * np.eye(4) + 1e-12 * np.eye(4)
    inverse = np.linalg.inv(normal)
    fitted = inverse @ (design.T @ target)
    left = target - design @ fitted
    explained = 1 - float(left @ left) / max(float(target @ target), 1e-9)
    tiles = rows // TILE * (width // TILE + 1) + columns // TILE
    used = len(np.unique(tiles))
    sums = np.column_stack([np.bincount(tiles, weights=score) for score in (design * left[:, None]).T])
    alike = _variance(inverse, sums) * used / max(used - 1, 1)  # pixels of a tile may be off together
    error = np.sqrt(np.maximum(alike, _variance(inverse, design * _by_chance(envelope, edges)[:, None])))
    usual = (centres - flat)[rows, columns].astype(float)
    different = float(target @ target) > DIFFERENT * float(usual @ usual)
    sure = (np.abs(fitted) > LEAST) & (np.abs(fitted) > SURE * error)
    significant = bool(sure.any()) and different and used >= TILES and explained > EXPLAINED
    right, down, wider, taller = map(float, fitted)
    return Displacement(right, down, wider, taller, explained, significant)


def _variance(inverse: NDArray[Any], scores: NDArray[Any]) -> NDArray[Any]:
    """Of each number that is fitted, from independent scores: N x 4."""
    return np.asarray(np.diag(inverse @ (scores.T @ scores) @ inverse))


def _by_chance(envelope: Envelope, edges: NDArray[np.bool_]) -> NDArray[Any]:
    """The standard deviation, summed over channels, of pixels at edges that are sampled once, anywhere in the pixel.

    Each shows the least or the most there is, as often as gives the mean.
    """
    low, high, mean = (side[edges].sum(axis=-1) for side in (envelope.low, envelope.high, envelope.mean))
    return np.asarray(np.sqrt(np.maximum((high - mean) * (mean - low), 0)))
