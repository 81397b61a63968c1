"""Whether a picture is one of another scene of the class, handed in under the wrong name."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.image import quantise
from reference.model import DOCUMENT
from reference.scene import Scene
from reference.tracer import render

SIDE = 100  # pixels at which scenes are drawn; pictures are compared at half of that
CLOSE = 4.0  # levels of mean error that another scene's picture may have
CLOSER = 3.0  # times as far off its own scene the picture must be


def other_scene(own: str, scenes: Mapping[str, Scene], depth: int, levels: NDArray[Any]) -> str | None:
    """The name of another of these scenes that the picture is closer to than to its own, by far."""
    small = _small(levels)
    errors = {name: float(np.abs(_small_right(scene, depth) - small).mean()) for name, scene in scenes.items()}
    best = min(errors, key=errors.__getitem__)
    return best if best != own and errors[best] < min(CLOSE, errors.get(own, np.inf) / CLOSER) else None


@lru_cache(16)
def _small_right(scene: Scene, depth: int) -> NDArray[np.float64]:
    return _small(np.asarray(render(scene, DOCUMENT, width=SIDE, height=SIDE, depth=depth)))


def _small(levels: NDArray[Any]) -> NDArray[np.float64]:
    from PIL import Image

    image = Image.fromarray(quantise(np.asarray(levels, float))).resize((SIDE // 2, SIDE // 2), Image.Resampling.BOX)
    return np.asarray(image, np.float64)
