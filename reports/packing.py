"""Float pictures small enough for a page: fixed point, as differences from the reference, deflated.

A value becomes the whole number of quanta nearest to it. The reference is stored as the difference of each value from
what its neighbours predict (left + above - above left), another picture as its difference from the reference; both
modulo 2**32, so that nothing is lost beyond the quantum. Differences are folded (0, -1, 1, -2, ... become 0, 1, 2, 3,
...), and their low bytes are stored before their next ones, as many bytes as the largest needs.
"""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reference.image import Picture

NAN, MINUS_INFINITY, LOWEST = -(2**31), -(2**31) + 1, -(2**31) + 2
INFINITY, HIGHEST = 2**31 - 1, 2**31 - 2
LEVEL = 7  # of zlib: 9 takes seven times as long and saves 10 %

Quanta = NDArray[np.int32]


@dataclass(frozen=True)
class Sample:
    """Which pixels of a picture are kept: one of each `step` x `step` block, or all where `step` is 1.

    `offset` tells for each block, row by row, which one: its row in the block times `step`, plus its column.
    """

    step: int
    offset: NDArray[np.uint8]

    def of(self, picture: Picture) -> Picture:
        """The kept pixels, rows x columns x channels."""
        if self.step == 1:
            return picture
        rows, columns = (np.arange(size)[:, None] for size in self.offset.shape)
        kept: Picture = picture[
            rows * self.step + self.offset // self.step, columns.T * self.step + self.offset % self.step
        ]
        return kept


def sample(error: NDArray[np.float64], step: int) -> Sample:
    """Keep of each block the pixel with the largest error, so that no wrong pixel is lost beside right ones."""
    height, width = (-(-size // step) for size in error.shape)
    blocks = np.full((height * step, width * step), -1.0)
    blocks[: error.shape[0], : error.shape[1]] = error
    blocks = blocks.reshape(height, step, width, step).swapaxes(1, 2).reshape(height, width, step * step)
    return Sample(step, blocks.argmax(axis=-1).astype(np.uint8))


def to_quanta(levels: Picture, quantum: float) -> Quanta:
    """Whole numbers of quanta; what is not a number, infinite or beyond the range gets the numbers kept for that."""
    with np.errstate(invalid="ignore", over="ignore"):
        scaled = np.rint(np.asarray(levels, np.float64) / quantum)
        inside: Quanta = np.clip(np.nan_to_num(scaled, nan=0), LOWEST, HIGHEST).astype(np.int32)
    inside[np.isnan(levels)] = NAN
    inside[np.isposinf(levels)] = INFINITY
    inside[np.isneginf(levels)] = MINUS_INFINITY
    return inside


def pack_reference(quanta: Quanta) -> str:
    """The text of a picture on its own; its channels are stored one after the other."""
    planes = _planes(quanta)
    residual = planes.copy()
    with np.errstate(over="ignore"):
        residual[:, :, 1:] -= planes[:, :, :-1]
        residual[:, 1:] -= residual[:, :-1].copy()
    return _deflated(residual)


def pack_other(quanta: Quanta, reference: Quanta) -> str:
    """The text of a picture beside a reference of the same shape."""
    with np.errstate(over="ignore"):
        return _deflated(_planes(quanta) - _planes(reference))


def pack_bytes(values: NDArray[np.uint8]) -> str:
    """The text of whole numbers 0..255, row by row."""
    return base64.b64encode(zlib.compress(values.tobytes(), LEVEL)).decode("ascii")


def _planes(quanta: Quanta) -> Quanta:
    return np.ascontiguousarray(np.moveaxis(quanta, -1, 0))


def _deflated(residual: Quanta) -> str:
    folded = ((residual << 1) ^ (residual >> 31)).view(np.uint32).ravel()
    largest = int(folded.max(initial=0))
    count = max(1, -(-largest.bit_length() // 8))
    low_first = [(folded >> np.uint32(8 * place)).astype(np.uint8) for place in range(count)]
    return base64.b64encode(zlib.compress(b"".join(plane.tobytes() for plane in low_first), LEVEL)).decode("ascii")
