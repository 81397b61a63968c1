"""Numbers of surfaces on the device, as kernels read them.

Surfaces are one numbered list, spheres before planes. Up to `UNROLLED` of them a kernel is straight code over uniform
values, one kernel for each pair of counts; beyond that it loops over the surfaces, one kernel for every scene.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain

import drjit as dr

from reference.device import Types
from reference.model import Mask, Number
from reference.scene import Plane, Scene, Sphere

UNROLLED = 16  # surfaces; beyond this, compile time outweighs what straight code gains
BAND = 1 << 22  # pixels a kernel launch, which bounds the memory of large pictures
MATERIAL = 8  # numbers in a row of materials
NOTHING = 0xFFFFFFFF  # the index of no surface

State = tuple[Number, ...]
Step = Callable[..., State]


class Rows:
    """Numbers of each surface, spheres before planes: `width` (a multiple of four) to a row."""

    def __init__(self, types: Types, spheres: int, rows: list[State], width: int, straight: bool = True) -> None:
        self.Float, self.Index, self.Mask = types.Float, types.Index, types.Mask
        self.Vector, self.Packet, self.Double = types.Vector3, types.Vector4, types.Double
        self.spheres, self.surfaces, self.width = spheres, len(rows), width
        # Of zeros where there is no row, so that there is something to gather. From a list: Dr.Jit borrows NumPy
        # arrays where they lie, and the kernel would depend on how they are aligned.
        self.numbers = self.Float(list(chain.from_iterable(rows or [(0.0,) * width])))
        self.straight = (
            [[self.uniform(value) for value in row] for row in rows] if straight and len(rows) <= UNROLLED else []
        )
        self.first_plane = dr.opaque(self.Index, spheres)

    def uniform(self, value: float) -> Number:
        """A number that is an input of the kernel, not a part of its code."""
        return dr.opaque(self.Float, value)

    def row(self, index: Number, active: Mask = True) -> list[Number]:
        """The numbers of a surface, fetched in packets of four, or one by one where there are few."""
        if self.straight:
            masks = [index == place for place in range(1, len(self.straight))]
            return [_pick(column, masks) for column in zip(*self.straight, strict=True)]
        packets = self.width // 4
        parts = (dr.gather(self.Packet, self.numbers, packets * index + part, active) for part in range(packets))
        return [number for packet in parts for number in packet]

    def fold(self, first: int, last: int, step: Step, state: State, going: Callable[..., Mask]) -> State:
        """Apply `state = step(index, row, *state)` to surfaces first..last-1, while rays are `going(*state)`."""
        if self.straight:
            for index in range(first, last):
                state = step(self.Index(index), self.straight[index], *state)
            return state

        def body(index: Number, *state: Number) -> State:
            return (index + 1, *step(index, self.row(index), *state))

        start, end = dr.opaque(self.Index, first), dr.opaque(self.Index, last)
        _, *folded = dr.while_loop((start, *state), lambda index, *state: (index < end) & going(*state), body)
        return tuple(folded)

    def through(self, meet_sphere: Step, meet_plane: Step, state: State, going: Callable[..., Mask]) -> State:
        """Fold all surfaces into the state."""
        state = self.fold(0, self.spheres, meet_sphere, state, going)
        return self.fold(self.spheres, self.surfaces, meet_plane, state, going)


def _pick(column: State, masks: list[Mask]) -> Number:
    first, *others = column
    for mask, number in zip(masks, others, strict=True):
        first = dr.select(mask, number, first)
    return first


def materials(scene: Scene) -> list[State]:
    """A row of eight for each surface: its colour, diffuse and reflection coefficient, and zeros."""
    surfaces: tuple[Sphere | Plane, ...] = (*scene.spheres, *scene.planes)
    return [(*s.colour, s.diffuse, s.reflection, 0, 0, 0) for s in surfaces]


def pixel_places(rows: Rows, width: int, top: int, pixel: Number) -> tuple[Number, Number]:
    """Column and row of pixels that are counted from the start of row `top`."""
    # Processors divide integers one by one; the middle of a pixel is too far from a whole row for rounding to matter.
    row = rows.Index((rows.Double(pixel) + 0.5) * dr.opaque(rows.Double, 1 / width))
    column = pixel - row * dr.opaque(rows.Index, width)
    return rows.Float(column), rows.Float(row + dr.opaque(rows.Index, top))
