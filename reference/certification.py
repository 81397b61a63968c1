"""The certified picture: every pixel is proven, or a knife edge with all the colours that it may have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reference.proof import PROVEN, Admissible, Prover
from reference.scene import Scene
from reference.sweep import sweep
from reference.tracer import check_request

UNDECIDED, KNIFE_EDGE, CERTAIN = 0, 128, 255  # in the mask


@dataclass(frozen=True)
class Certificate:
    """What is known of a picture by the `exact` convention.

    `picture`: height x width x 3, levels, not clamped, each channel within 1e-6 level of the truth (over 255: 1e-6 of
    255ths); at an exact tie the colour that the model's rule for ties gives. `mask`: height x width, CERTAIN where
    only that colour is right, KNIFE_EDGE where `edges` lists all that are, UNDECIDED where not all could be found.
    `edges`: what is admissible at (column, row) of every pixel that is not certain.
    """

    picture: NDArray[np.float64]
    mask: NDArray[np.uint8]
    edges: dict[tuple[int, int], Admissible]

    def count(self, kind: int) -> int:
        """How many pixels are of that kind in the mask."""
        return int((self.mask == kind).sum())


def certify(
    scene: Scene,
    *,
    width: int = 1000,
    height: int = 1000,
    depth: int = 3,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Certificate:
    """Prove every pixel: all at once in double precision, what that leaves open one by one at rising precision.

    `progress` is told how many of those are done, and of how many. Raises InputError for a size or depth out of range
    and DeviceError where Dr.Jit cannot compute.
    """
    check_request(width, height, depth)
    picture, radius = sweep(scene, width=width, height=height, depth=depth)
    proven = radius <= PROVEN
    mask = np.where(proven, CERTAIN, UNDECIDED).astype(np.uint8)
    prover = Prover(scene, width=width, height=height, depth=depth)
    edges = {}
    left = np.argwhere(~proven)
    for done, (row, column) in enumerate(left.tolist()):
        progress(done, len(left))
        found = prover.admissible(column, row)
        picture[row, column] = found.colours[0].value if found.colours else np.nan
        if found.proven:
            mask[row, column] = CERTAIN
        else:
            mask[row, column] = KNIFE_EDGE if found.complete else UNDECIDED
            edges[column, row] = found
    return Certificate(picture, mask, edges)
