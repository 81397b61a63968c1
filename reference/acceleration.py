"""Which spheres a ray may meet: a bounding volume hierarchy, built in NumPy and walked inside a Dr.Jit kernel.

The tree is binary and complete. Node i has the children 2i and 2i+1, the root is 1, and the leaves are the last level,
so that nothing but boxes is stored. Each node is split at the median of its spheres' centres along its longest side.

A ray walks to the nearer child whose box it meets and leaves the other for later. It needs no stack: `pending` has a
bit for each level, which says whether the sibling there is still to be visited. Its lowest bit set, k levels up, leads
to node (i >> k) ^ 1. (Barringer and Akenine-Moeller, Dynamic Stackless Binary Tree Traversal, JCGT 2(1), 2013.)

What takes longest is fetching nodes. So their boxes are on a grid across the scene, 10 bits a coordinate, where that
does not make them much larger, and else float32. They are rounded outward and met with a margin: no sphere that a ray
may meet is passed over.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from reference.device import Types
from reference.tables import State, upload

Number = Any  # a Dr.Jit array

LEAF = 3  # spheres in a leaf, at most
SINGLE = 1 << 16  # spheres up to which each has a leaf of its own; beyond, building takes longer than that saves
BITS, STEPS = 10, 1 << 10  # of the grid
COARSE = 2  # how many times larger the faces of leaves may be on the grid, on average
SAMPLE = 64  # spheres that tell a node's longest side
SMALLEST = 1e-30  # of a length
FLATTEST = 1e-18  # component of a direction, so that its reciprocal and products with that stay finite
ROUNDING = 2.0**-20  # of a coordinate, several times what the test of a box can lose


class Tree:
    """Spheres sorted into a tree: `order` lists their numbers as the tree holds them, leaf by leaf.

    `types` are those of single precision. `centres` (n x 3) and `radii` (n, above 0) are float64, of a size that
    float32 can hold. Places in `order` are what `fold` speaks of; tables that follow it are read where rays are.
    """

    def __init__(self, types: Types, centres: NDArray[np.float64], radii: NDArray[np.float64]) -> None:
        self.types = types
        leaves, counts = sort(centres)
        self.order: NDArray[np.intp] = leaves[counts]
        self.ends = upload(types.Index, np.append(0, np.cumsum(counts.sum(axis=1))).astype(np.uint32))
        inside, reach = np.take(centres, leaves, axis=0), np.take(radii, leaves)[..., None]
        low, high = inside - reach, inside + reach
        low, high = (least(low, 1), most(high, 1)) if len(centres) else (np.zeros((1, 3)), np.zeros((1, 3)))
        first, last = low.min(axis=0), high.max(axis=0)
        step = np.maximum(last - first, SMALLEST) / (STEPS - 2)
        on_grid = np.floor((low - first) / step), np.ceil((high - first) / step)
        larger = faces((on_grid[1] - on_grid[0]) * step) / np.maximum(faces(high - low), SMALLEST)
        self.is_coarse = float(larger.mean()) < COARSE
        words = upload(types.Index, packed(*on_grid) if self.is_coarse else single(low, high))
        self.nodes = dr.reinterpret_array(types.Float, words)  # packets are of floats
        dr.eval(self.nodes)
        self.leaves = dr.opaque(types.Index, len(leaves))
        start, step = (first, step) if self.is_coarse else (0 * first, 0 * step + 1)
        self.start, self.step = ([dr.opaque(types.Float, value) for value in part.tolist()] for part in (start, step))
        self.extent = dr.opaque(types.Float, float(np.abs([first, last]).max()) * (1 + ROUNDING))

    def fold(
        self,
        origin: Number,
        direction: Number,
        margin: Number,
        reach: Callable[..., Number],
        step: Callable[..., State],
        state: State,
        going: Callable[..., Number],
    ) -> State:
        """Apply `state = step(place, *state)` to the spheres that a ray may meet, roughly from near to far.

        The ray is float32: `origin` and `direction` (of any length, not 0), and `margin`, how far its points and the
        spheres may be off. Nothing beyond t = `reach(*state)` is sought, and nothing when not `going(*state)`.
        `place` is the sphere's in `order`. A sphere is visited once or never.
        """
        number, index = self.types.Float, self.types.Index
        inverse = [dr.rcp(dr.select(dr.abs(d) < FLATTEST, dr.copysign(number(FLATTEST), d), d)) for d in direction]
        farthest = _larger(_larger(dr.abs(origin[0]), dr.abs(origin[1])), dr.abs(origin[2]))
        slack = margin + ROUNDING * (farthest + self.extent)
        # (start + step * corner - (origin +- slack)) / d: the box grows by the slack on every side.
        lows = [(s - o - slack) * inv for s, o, inv in zip(self.start, origin, inverse, strict=True)]
        highs = [(s - o + slack) * inv for s, o, inv in zip(self.start, origin, inverse, strict=True)]
        steps = [step * inv for step, inv in zip(self.step, inverse, strict=True)]

        def meet(low: list[Number], high: list[Number], end: Number) -> tuple[Number, Number]:
            """Where the ray enters a box, and whether it does before `end`."""
            enter, leave = number(0), end
            for axis in range(3):
                one = dr.fma(low[axis], steps[axis], lows[axis])
                other = dr.fma(high[axis], steps[axis], highs[axis])
                enter, leave = _larger(enter, _smaller(one, other)), _smaller(leave, _larger(one, other))
            return enter, enter <= leave

        def climb(node: Number, pending: Number) -> State:
            """The nearest sibling that is pending; 0 where none is."""
            levels = dr.tzcnt(pending)
            none = pending == 0
            return dr.select(none, 0, (node >> levels) ^ 1), dr.select(none, 0, (pending >> levels) ^ 1)

        def descend(node: Number, pending: Number, end: Number) -> State:
            inner = node < self.leaves
            n = self.corners(node, inner)
            left, meets_left = meet(n[0:3], n[3:6], end)
            right, meets_right = meet(n[6:9], n[9:12], end)
            both = meets_left & meets_right
            second = dr.select(both, right < left, meets_right)
            up, rest = climb(node, pending)
            some = meets_left | meets_right
            down = 2 * node + dr.select(second, index(1), index(0))
            later = 2 * pending + dr.select(both, index(1), index(0))
            return (
                dr.select(inner, dr.select(some, down, up), node),
                dr.select(inner, dr.select(some, later, rest), pending),
            )

        def visit(node: Number, pending: Number, *state: Number) -> State:
            """All spheres of a leaf."""
            leaf = node - self.leaves
            place, end = dr.gather(index, self.ends, leaf), dr.gather(index, self.ends, leaf + 1)

            def meet_sphere(place: Number, *state: Number) -> State:
                return (place + 1, *step(place, *state))

            _, *state = dr.while_loop((place, *state), lambda place, *_: place < end, meet_sphere)
            node, pending = climb(node, pending)
            return (dr.select(going(*state), node, 0), pending, *state)

        def advance(node: Number, pending: Number, *state: Number) -> State:
            node, pending = descend(node, pending, reach(*state))
            visited: State = dr.if_stmt((node, pending, *state), node >= self.leaves, visit, lambda *same: same)
            return visited

        start = dr.select(going(*state), index(1), index(0))
        _, _, *found = dr.while_loop((start, index(0), *state), lambda node, *_: node != 0, advance)
        return tuple(found)

    def corners(self, node: Number, active: Number) -> list[Number]:
        """The boxes of a node's children: left low, left high, right low, right high, three numbers each."""
        number, index, packet = self.types.Float, self.types.Index, self.types.Vector4
        packets = 1 if self.is_coarse else 3
        parts = (dr.gather(packet, self.nodes, packets * node + part, active) for part in range(packets))
        found = [value for part in parts for value in part]
        if not self.is_coarse:
            return found
        words = (dr.reinterpret_array(index, value) for value in found)
        return [number(word >> BITS * axis & STEPS - 1) for word in words for axis in range(3)]


def _smaller(a: Number, b: Number) -> Number:
    """The minimum of numbers that are never NaN, which is one instruction where dr.minimum is several."""
    return dr.select(a < b, a, b)


def _larger(a: Number, b: Number) -> Number:
    return dr.select(a > b, a, b)


def sort(centres: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """The numbers of the spheres in each leaf, leaves x spheres in a leaf, and which of them count.

    All leaves have as many, so some spheres, evenly chosen, are there twice and count once.
    """
    count, levels = len(centres), 0
    full = 1 if count <= SINGLE else LEAF
    while count > full << levels:
        levels += 1
    leaves = 1 << levels
    size = -(-count // leaves)
    slots = np.arange(leaves * size)
    twice = slots >= count
    sphere = np.where(twice, (slots - count) * count // max(1, leaves * size - count), slots)
    points = (centres - centres.min(axis=0, initial=np.inf)).astype(np.float32).T[:, sphere]
    for level in range(levels):
        nodes = points.reshape(3, 1 << level, -1)
        some = nodes[:, :, :: max(1, nodes.shape[2] // SAMPLE)]
        longest = (most(some, 2) - least(some, 2)).argmax(axis=0)
        # Not negative, coordinates are in the order of their bits; the place is carried along below them.
        keys = nodes[longest, np.arange(1 << level)].view(np.uint32).astype(np.uint64) << np.uint64(32)
        keys |= np.arange(leaves * size, dtype=np.uint64).reshape(keys.shape)
        keys.partition(keys.shape[1] // 2, axis=1)
        places = (keys.ravel() & np.uint64(0xFFFFFFFF)).astype(np.intp)
        slots, points = slots[places], np.take(points, places, axis=1)
    return sphere[slots].reshape(leaves, size), ~twice[slots].reshape(leaves, size)


def faces(sides: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the area of the faces of each box, given their sides (n x 3)."""
    x, y, z = sides.T
    area: NDArray[np.float64] = x * y + y * z + z * x
    return area


def packed(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.uint32]:
    """The boxes of all nodes' children, given each leaf's in steps of the grid: a row of 4 words."""
    x, y, z = np.moveaxis(boxes(low.astype(np.uint32), high.astype(np.uint32)), -1, 0)
    words: NDArray[np.uint32] = x | y << np.uint32(BITS) | z << np.uint32(2 * BITS)
    return words.reshape(len(low), 4)


def single(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.uint32]:
    """The boxes of all nodes' children, given each leaf's: a row of 12 words, float32 in truth."""
    below = np.nextafter(low.astype(np.float32), np.float32(-np.inf))
    above = np.nextafter(high.astype(np.float32), np.float32(np.inf))
    return boxes(below, above).reshape(len(low), 12).view(np.uint32)


def boxes(low: NDArray[Any], high: NDArray[Any]) -> NDArray[Any]:
    """The boxes of all nodes' children, given each leaf's (leaves x 3): nodes x 2 children x 2 corners x 3."""
    leaves = len(low)
    nodes = np.zeros((leaves, 2, 2, 3), low.dtype)
    while (row := len(low) // 2) > 0:
        low, high = low.reshape(row, 2, 3), high.reshape(row, 2, 3)
        nodes[row : 2 * row, :, 0], nodes[row : 2 * row, :, 1] = low, high
        low, high = least(low, 1), most(high, 1)
    return nodes


def least(numbers: NDArray[Any], axis: int) -> NDArray[Any]:
    """The minimum along an axis that is short: several times as fast as `min`."""
    return reduce(np.minimum, np.moveaxis(numbers, axis, 0))


def most(numbers: NDArray[Any], axis: int) -> NDArray[Any]:
    """The maximum along an axis that is short."""
    return reduce(np.maximum, np.moveaxis(numbers, axis, 0))
