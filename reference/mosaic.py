"""The picture of double precision at the price of single precision, tile by tile.

Tiles that see planes alone (`reference/beams.py`) are drawn by `reference/walls.py`. All others are drafted, pixel by
pixel (`reference/draft.py`), and what is in doubt is drawn in double precision.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot
from typing import Any

import drjit as dr

from reference.beams import plain
from reference.device import Types
from reference.draft import FAITHFUL, Draft
from reference.model import DOCUMENT, Mask, Number, Vector
from reference.scene import SCREEN, SCREEN_DISTANCE
from reference.tables import PIXELS, TILE, tile_corners, tile_places, tiles_across
from reference.walls import Walls, radiance
from reference.world import View, World

LEAST = 2.0**-14  # radians: many times what rounding may turn a ray
KEPT = 8  # kinds of pictures whose kernels can be launched again without tracing


@dataclass(frozen=True)
class Part:
    """Tiles by their corners, and numbers of pixels: 0 to 63 are those of the first tile."""

    corners: Number
    number: Number

    def places(self) -> tuple[Number, Number]:
        """Column and row of each pixel."""
        corner = dr.gather(type(self.corners), self.corners, self.number // PIXELS)
        return tile_places(corner, self.number % PIXELS)


class Mosaic:
    """A scene on the device in single precision, beside the `world` where it is in double."""

    def __init__(self, world: World, single: Types) -> None:
        self.world, self.draft = world, Draft(world, single)
        self.walls = Walls(world.scene, world.model, single)
        self.Index, self.Float, self.Vector = single.Index, single.Float, single.Vector3
        tables = (world, world.materials, self.draft.search, self.draft.search.ahead, self.draft.shades, self.walls)
        self.numbers = [number for table in tables for number in table.inputs]
        self.sort, self.paint, self.correct = (self.frozen(step) for step in (self._sort, self._paint, self._correct))

    def frozen(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """A function that is traced once; then its kernels are launched again with what the tables hold."""
        replayed: Callable[..., Any] = dr.freeze(
            function, state_fn=lambda *_: self.numbers, limit=KEPT, warn_after=1000
        )
        return replayed

    def draw(self, view: View, top: int, count: int) -> Number:
        """Red, green and blue of each pixel in turn, in `count` rows from `top` on."""
        start = dr.opaque(self.Index, top)
        corners, is_plain = self.sort(view, count, start)
        easy, hard = (self.part(corners, dr.compress(kind)) for kind in (is_plain, ~is_plain))
        picture, doubt = self.paint(view, count, start, easy, hard)
        if hard and len(again := dr.compress(doubt)):
            dr.scatter(picture, *self.correct(view, start, again, hard.corners))
        return picture

    def part(self, corners: Number, tiles: Number) -> Part | None:
        """Some tiles of those whose corners these are; None where there are none."""
        if not len(tiles):
            return None
        return Part(dr.gather(self.Index, corners, tiles), dr.arange(self.Index, PIXELS * len(tiles)))

    def tiles(self, view: View, count: int, top: Number) -> tuple[Number, Vector, Number]:
        """The corners of all tiles, the directions of their middles, and how far off those their pixels' may be."""
        tile = dr.arange(self.Index, tiles_across(view.width) * tiles_across(count))
        corners = tile_corners(self.walls, view.width, tile)
        column, row = tile_places(corners, self.Index(0))
        half = TILE / 2 - 0.5
        middle = self.directions(view, top, self.Float(column) + half, self.Float(row) + half)
        spread = LEAST + TILE * hypot(SCREEN / view.width, SCREEN / view.height) / SCREEN_DISTANCE
        return corners, middle, dr.opaque(self.Float, spread)

    def _sort(self, view: View, count: int, top: Number) -> tuple[Number, Mask]:
        """The corners of all tiles, and which see planes alone, as far as their colours are right."""
        corners, middle, spread = self.tiles(view, count, top)
        sure, error = plain(self.draft.search, self.walls, middle, spread, dr.opaque(self.Index, view.depth))
        return corners, sure & (error < FAITHFUL) & dr.full(self.walls.Mask, True, len(corners))  # be they all the same

    def directions(self, view: View, top: Number, column: Number, row: Number) -> Vector:
        """Directions of the camera's rays in single precision, in which they are turned by less than CAMERA_TURN."""
        size = (dr.opaque(self.Float, 2 * SCREEN / side) for side in (view.width, view.height))
        return self.Vector(*DOCUMENT.camera_direction(self.Float(column), self.Float(row) + self.Float(top), *size))

    def _paint(self, view: View, count: int, top: Number, easy: Part | None, hard: Part | None) -> tuple[Number, Mask]:
        """The picture, and which of the hard pixels are in doubt."""
        picture, doubt = dr.empty(self.Float, 3 * count * view.width), None
        if easy:
            column, row = easy.places()
            camera = self.directions(view, top, column, row)
            colour = radiance(self.walls, camera, dr.opaque(self.Index, view.depth))
            self.put(picture, view, count, column, row, colour)
        if hard:
            column, row = hard.places()
            colour, doubt = self.draft.colours(view, top, column, row)
            doubt &= self.put(picture, view, count, column, row, colour)
        return picture, doubt

    def put(self, picture: Number, view: View, count: int, column: Number, row: Number, colour: Vector) -> Mask:
        """Put colours in their places, if they have one in the picture."""
        width = dr.opaque(self.Index, view.width)
        inside = (column < width) & (row < dr.opaque(self.Index, count))
        dr.scatter(picture, colour, row * width + column, inside)
        return inside

    def _correct(self, view: View, top: Number, again: Number, corners: Number) -> tuple[Vector, Number]:
        """The colours of the pixels `again` of tiles in double precision, and their places."""
        column, row = Part(corners, again).places()
        colour = self.Vector(self.world.colours(view, top, column, row))
        return colour, row * dr.opaque(self.Index, view.width) + column
