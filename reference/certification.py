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

UNDECIDED, KNIFE_EDGE, CERTAIN = 0, 128, 255
WORK = 800_000_000  # pixels times surfaces times rays that are proven one by one; what is left then stays undecided
STEPS = 100  # of the progress


@dataclass(frozen=True)
class Certificate:
    """What is known of a picture by the `exact` convention.

    `picture`: height x width x 3, levels, not clamped; where proven, each channel is within 1e-6 level of the truth
    (over 255 levels: 1e-6 of 255ths of it). `mask`: height x width, 255 where that is proven; 128 for a knife edge,
    where the picture has the colour by the model's rule for ties and `edges` lists every admissible one at
    (column, row); 0 where not all could be found, and the picture's is one of those in `edges`, if any, or a guess.
    """

    picture: NDArray[np.float64]
    mask: NDArray[np.uint8]
    edges: dict[tuple[int, int], Admissible]

    def count(self, kind: int) -> int:
        """How many pixels of the mask are of that kind."""
        return int((self.mask == kind).sum())


def certify(
    scene: Scene,
    *,
    width: int = 1000,
    height: int = 1000,
    depth: int = 3,
    progress: Callable[[str], None] = lambda text: None,
) -> Certificate:
    """Prove every pixel: all at once in double precision, what that leaves open one by one at rising precision.

    `progress` is told in at most a hundred steps how far that is. Raises InputError for a size or depth out of range
    and DeviceError where Dr.Jit cannot compute.
    """
    check_request(width, height, depth)
    picture, radius = sweep(scene, width=width, height=height, depth=depth)
    proven = radius <= PROVEN
    mask = np.where(proven, CERTAIN, UNDECIDED).astype(np.uint8)
    prover = Prover(scene, width=width, height=height, depth=depth)
    edges = {}
    left = np.argwhere(~proven)
    step = -(-len(left) // STEPS) or 1
    for done, (row, column) in enumerate(left[: WORK // (max(1, prover.surfaces) * (depth + 1))].tolist()):
        if done % step == 0:
            progress(f"proving pixel {done} of {len(left)}")
        found = prover.admissible(column, row)
        if found.colours:
            picture[row, column] = found.colours[0].value
        if found.proven:
            mask[row, column] = CERTAIN
        else:
            mask[row, column] = KNIFE_EDGE if found.complete else UNDECIDED
            edges[column, row] = found
    return Certificate(picture, mask, edges)
