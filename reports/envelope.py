"""What a pixel may show: the least and the most that any sampling of it sees.

A picture made elsewhere may sample its pixels at the centre, at random or many times over. Whatever it does, it sees
what lies in the pixel: the range of the reference over 4 x 4 samples, the corners and the centre of the pixel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from reference.device import array_types
from reference.model import DOCUMENT
from reference.scene import Scene, Triple
from reference.tracer import render
from reference.world import View, World

SAMPLES = 4  # across a pixel
CORNER = 0.499  # pixels from the centre: whatever line crosses the pixel, there is a corner on either side
UNLIT = replace(DOCUMENT, name="unlit", summary="surfaces shine in their own colour", ambient=lambda colour, *_: colour)

Levels = NDArray[np.float32]


@dataclass(frozen=True)
class Envelope:
    """The bounds of a picture of a scene: height x width x 3 in levels, clamped to 0..255, row 0 on top.

    `objects` says what the camera sees at each pixel's centre: an index into `names`, 0 for nothing.
    """

    scene: Scene
    depth: int
    centre: Levels
    mean: Levels  # of the 4 x 4 samples
    low: Levels
    high: Levels
    objects: NDArray[np.uint16]
    names: tuple[str, ...]

    @property
    def width(self) -> int:
        """In pixels."""
        return int(self.low.shape[1])

    @property
    def height(self) -> int:
        """In pixels."""
        return int(self.low.shape[0])


def envelope(scene: Scene, width: int, height: int, depth: int = 3) -> Envelope:
    """The bounds for a size in pixels and a depth limit: 22 pictures of the reference.

    Raises InputError and DeviceError as `reference.tracer.render` does.
    """
    centre = np.clip(render(scene, width=width, height=height, depth=depth), 0, 255)
    view, types = View(width, height, depth), array_types("double", "auto")
    world = World(scene, DOCUMENT, types, types)
    low = high = world.Vector(*(world.Float(np.ascontiguousarray(centre[..., c].ravel())) for c in range(3)))
    pixel = dr.arange(world.Index, width * height)
    across = dr.opaque(world.Index, width)
    column, row = world.Float(pixel % across), world.Float(pixel // across)
    mean, inside = world.Vector(0), (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    for weight, steps in ((1 / SAMPLES**2, inside), (0, (-CORNER, CORNER))):
        for down, right in product(steps, steps):
            shift = dr.opaque(world.Float, right), dr.opaque(world.Float, down)
            colour = world.colours(view, dr.opaque(world.Index, 0), column + shift[0], row + shift[1])
            colour = dr.clip(colour, 0, 255)
            low, high = dr.minimum(low, colour), dr.maximum(high, colour)
            mean = dr.fma(colour, dr.opaque(world.Float, weight), mean)
            dr.eval(low, high, mean)
    over = [side.numpy().T.reshape(height, width, 3).astype(np.float32) for side in (mean, low, high)]
    return Envelope(scene, depth, centre, over[0], over[1], over[2], *identify(scene, view))


def identify(scene: Scene, view: View) -> tuple[NDArray[np.uint16], tuple[str, ...]]:
    """What the camera sees at each pixel's centre (an index), and what the indices mean, 0 nothing.

    Drawn with the number of each surface as its colour.
    """
    names = [f"sphere {number}" for number in range(1, len(scene.spheres) + 1)]
    names += [f"plane {number}" for number in range(1, len(scene.planes) + 1)]

    def numbered(number: int) -> dict[str, Any]:
        colour: Triple = (float(number), 0.0, 0.0)
        return {"colour": colour, "diffuse": 0.0, "reflection": 0.0}

    first = len(scene.spheres) + 1
    spheres = tuple(replace(sphere, **numbered(number)) for number, sphere in enumerate(scene.spheres, 1))
    planes = tuple(replace(plane, **numbered(number)) for number, plane in enumerate(scene.planes, first))
    flat = replace(scene, spheres=spheres, planes=planes)
    seen = render(flat, UNLIT, width=view.width, height=view.height, depth=0)[..., 0]
    return np.rint(seen).astype(np.uint16), ("background", *names)
