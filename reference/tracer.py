"""The tracer: a scene and a model become a picture."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from reference.device import array_types
from reference.draft import is_draftable
from reference.errors import InputError
from reference.model import DOCUMENT, Model
from reference.mosaic import Mosaic
from reference.scene import LARGEST_DEPTH, LARGEST_SIDE, Scene
from reference.tables import BAND, TILE
from reference.world import View, World


def render(
    scene: Scene,
    model: Model = DOCUMENT,
    *,
    width: int = 1000,
    height: int = 1000,
    depth: int = 3,
    precision: str = "auto",
    device: str = "auto",
    dtype: DTypeLike = np.float32,
) -> NDArray[Any]:
    """The picture: height x width x 3, linear, in levels (0..255) that are not clamped, of type `dtype`.

    `depth` counts the bounces after the primary hit; `precision` is that of the computation: double, single, or auto,
    which gives the picture of double precision, within 0.01 level (the same for a `dtype` of double precision).
    Raises InputError for a size or depth out of range and DeviceError where Dr.Jit cannot compute.
    """
    if precision == "auto" and np.dtype(dtype) == np.float64:
        precision = "double"
    asked: dict[str, Any] = {"width": width, "height": height, "depth": depth, "precision": precision, "device": device}
    bands = render_bands(scene, model, **asked)
    first = next(bands).astype(dtype, copy=False)
    if len(first) == height:
        return first
    picture = np.empty((height, width, 3), dtype)
    top = 0
    for band in chain([first], bands):
        picture[top : top + len(band)] = band
        top += len(band)
    return picture


def render_bands(
    scene: Scene,
    model: Model = DOCUMENT,
    *,
    width: int = 1000,
    height: int = 1000,
    depth: int = 3,
    precision: str = "auto",
    device: str = "auto",
) -> Iterator[NDArray[Any]]:
    """The picture of `render` from top to bottom, some rows at a time: rows x width x 3."""
    check_request(width, height, depth)
    view = View(width, height, depth)
    artist = prepare(scene, model, precision=precision, device=device)
    rows = max(TILE, BAND // width // TILE * TILE)  # whole tiles, so that bands make no difference
    for top in range(0, height, rows):
        count = min(rows, height - top)
        yield artist.draw(view, top, count).numpy().reshape(count, width, 3)


def prepare(scene: Scene, model: Model = DOCUMENT, *, precision: str = "auto", device: str = "auto") -> World | Mosaic:
    """The scene on the device, ready to `draw` rows of any view in the precision asked for.

    Raises InputError and DeviceError as `render` does.
    """
    types, single = array_types(precision, device), array_types("single", device)
    world = World(scene, model, types, single)
    drafted = precision == "auto" and world.tree is None and is_draftable(world.scene, model)
    return Mosaic(world, single) if drafted else world


def check_request(width: int, height: int, depth: int) -> None:
    """Raise InputError for a size or depth out of range."""
    if not (0 < width <= LARGEST_SIDE and 0 < height <= LARGEST_SIDE):
        raise InputError(f"expected a size of 1 to {LARGEST_SIDE} pixels a side, found {width}x{height}")
    if not 0 <= depth <= LARGEST_DEPTH:
        raise InputError(f"expected a depth of 0 to {LARGEST_DEPTH}, found {depth}")
