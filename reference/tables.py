"""Numbers of surfaces on the device, as kernels read them.

Surfaces are one numbered list, spheres before planes. Up to `UNROLLED` of them a kernel is straight code over uniform
values, one kernel for each pair of counts; beyond that it walks through a tree of the spheres, one kernel for each
number of planes up to a few, and one for all scenes with more, over which it loops.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from reference.device import Types
from reference.model import Mask, Number, Vector
from reference.scene import Plane, Scene, Sphere

if TYPE_CHECKING:
    from reference.acceleration import Tree

UNROLLED = 16  # surfaces; beyond this, compile time outweighs what straight code gains
FEW_PLANES = 4  # that are straight code beside many spheres
BAND = 1 << 22  # pixels a kernel launch, which bounds the memory of large pictures
MATERIAL = 8  # numbers in a row of materials
TILE = 8  # pixels a side
PIXELS = TILE * TILE  # of a tile
FEW = 4096  # numbers that are quicker handed over one by one
NOTHING = 0xFFFFFFFF  # the index of no surface

State = tuple[Number, ...]
Step = Callable[..., State]


class Path(NamedTuple):
    """Where rays go, in single precision: what a tree needs to know to pass spheres over."""

    origin: Vector
    d: Vector
    margin: Number  # how far rays and spheres may be off
    reach: Callable[..., Number]  # of the state: the t beyond which nothing matters


class Rows:
    """Numbers of each surface, spheres before planes: `width` (a multiple of four) to a row.

    Where there is a `tree` of the spheres, they are in its order.
    """

    def __init__(self, types: Types, spheres: int, rows: ArrayLike, width: int, tree: Tree | None = None) -> None:
        self.Float, self.Index, self.Mask = types.Float, types.Index, types.Mask
        self.Vector, self.Packet, self.Double = types.Vector3, types.Vector4, types.Double
        self.tree = tree
        table = np.asarray(rows, np.float64 if self.Float is self.Double else np.float32).reshape(-1, width)
        self.numbers = upload(self.Float, table)
        self.inputs = [self.numbers]  # all that kernels may read of it
        self.spheres, self.surfaces, self.width = spheres, len(table), width
        first = 0 if len(table) <= UNROLLED else spheres if len(table) - spheres <= FEW_PLANES else len(table)
        self.straight = {index: list(map(self.uniform, table[index].tolist())) for index in range(first, len(table))}
        self.first_plane = dr.opaque(self.Index, spheres)
        self.inputs.append(self.first_plane)

    def uniform(self, value: float) -> Number:
        """A number that is an input of the kernel, not a part of its code."""
        self.inputs.append(dr.opaque(self.Float, value))
        return self.inputs[-1]

    def row(self, index: Number, active: Mask = True) -> list[Number]:
        """The numbers of a surface, fetched in packets of four, or one by one where there are few."""
        if 0 in self.straight:
            masks = [index == place for place in range(1, len(self.straight))]
            return [_pick(column, masks) for column in zip(*self.straight.values(), strict=True)]
        packets = self.width // 4
        parts = (dr.gather(self.Packet, self.numbers, packets * index + part, active) for part in range(packets))
        return [number for packet in parts for number in packet]

    def fold(self, first: int, last: int, step: Step, state: State, going: Callable[..., Mask]) -> State:
        """Apply `state = step(index, row, *state)` to surfaces first..last-1, while rays are `going(*state)`."""
        if first == last or first in self.straight:
            # Beside many spheres a plane's number is no part of the code, which would be another for each scene.
            start = self.Index(first) if 0 in self.straight else self.first_plane
            for index in range(first, last):
                state = step(start + (index - first), self.straight[index], *state)
            return state

        def body(index: Number, *state: Number) -> State:
            return (index + 1, *step(index, self.row(index), *state))

        start, end = dr.opaque(self.Index, first), dr.opaque(self.Index, last)
        _, *folded = dr.while_loop((start, *state), lambda index, *state: (index < end) & going(*state), body)
        return tuple(folded)

    def through(
        self, meet_sphere: Step, meet_plane: Step, state: State, going: Callable[..., Mask], path: Path | None = None
    ) -> State:
        """Fold all surfaces into the state; of the spheres, those that rays may meet on their path."""
        if self.tree and path:  # planes first: the tree is then walked no farther than they are
            state = self.fold(self.spheres, self.surfaces, meet_plane, state, going)
            step = lambda place, *state: meet_sphere(place, self.row(place), *state)  # noqa: E731
            return self.tree.fold(*path, step, state, going)
        state = self.fold(0, self.spheres, meet_sphere, state, going)
        return self.fold(self.spheres, self.surfaces, meet_plane, state, going)


def upload(kind: Any, numbers: NDArray[Any]) -> Any:
    """Numbers in a Dr.Jit array of a kind, with memory of its own; zeros where there is none, to gather from."""
    flat = numbers.ravel() if numbers.size else np.zeros(12, numbers.dtype)
    if len(flat) <= FEW:
        return kind(flat.tolist())
    # Dr.Jit borrows NumPy's memory, and its kernels depend on how that happens to be aligned.
    copy = kind(flat) + dr.opaque(kind, 0)
    dr.eval(copy)
    dr.sync_thread()  # before NumPy's memory goes
    return copy


def _pick(column: State, masks: list[Mask]) -> Number:
    first, *others = column
    for mask, number in zip(masks, others, strict=True):
        first = dr.select(mask, number, first)
    return first


def column(surfaces: Sequence[Sphere | Plane], name: str, width: int = 1) -> NDArray[np.float64]:
    """One property of all surfaces, of `width` numbers: surfaces x width."""
    values: Any = map(attrgetter(name), surfaces)
    flat = chain.from_iterable(values) if width > 1 else values
    return np.fromiter(flat, np.float64, len(surfaces) * width).reshape(-1, width)


def geometry(scene: Scene) -> NDArray[np.float64]:
    """Centre and radius of each sphere."""
    return np.hstack([column(scene.spheres, "centre", 3), column(scene.spheres, "radius")])


def shading(scene: Scene) -> NDArray[np.float64]:
    """A row of eight for each surface: its colour, diffuse and reflection coefficient, and zeros."""
    surfaces: tuple[Sphere | Plane, ...] = (*scene.spheres, *scene.planes)
    rows = np.zeros((len(surfaces), MATERIAL))
    rows[:, :3] = column(surfaces, "colour", 3)
    rows[:, 3:4], rows[:, 4:5] = column(surfaces, "diffuse"), column(surfaces, "reflection")
    return rows


def pixel_places(rows: Rows, width: int, pixel: Number) -> tuple[Number, Number]:
    """Column and row of pixels that are counted row by row."""
    row, column = _divided(rows, pixel, width)
    return column, row


def tile_corners(rows: Rows, width: int, tile: Number) -> Number:
    """Row and column of the first pixel of tiles, which are counted row by row: 16 bits each."""
    below, beside = _divided(rows, tile, tiles_across(width))
    return (below << 16 | beside) * TILE


def tile_places(corner: Number, inner: Number) -> tuple[Number, Number]:
    """Column and row of the pixels `inner` (0 to 63) of tiles with these corners.

    A quarter of a tile comes after the other, since rays that run together should follow each other. Beside the last
    column and below the last row tiles hold other pixels.
    """
    half, quarter = TILE // 2, PIXELS // 4
    column = (corner & 0xFFFF) + (inner // quarter % 2 * half + inner % half)
    row = (corner >> 16) + (inner // (2 * quarter) * half + inner % quarter // half)
    return column, row


def tiles_across(width: int) -> int:
    """How many tiles stand beside each other."""
    return -(-width // TILE)


def _divided(rows: Rows, numbers: Number, divisor: int) -> tuple[Number, Number]:
    """Quotient and remainder."""
    # Processors divide integers one by one; half a unit is more than rounding loses.
    quotient = rows.Index((rows.Double(numbers) + 0.5) * dr.opaque(rows.Double, 1 / divisor))
    return quotient, numbers - quotient * dr.opaque(rows.Index, divisor)
