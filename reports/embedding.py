"""Everything of a run's pictures that a page carries: their values, maps and thumbnails, within a budget of bytes."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.image import read_image
from reports.metrics import error_map
from reports.packing import Quanta, Sample, pack_bytes, pack_other, pack_reference, sample, to_quanta

BUDGET = 7_000_000  # bytes of text for all pictures, so that a page stays below 8 MB
# Quantum in levels, the side of the blocks of which one pixel is kept, and from how many kept pixels on not to try it
LADDER = ((0.001, 1, 8e6), (0.01, 1, 1e8), (0.1, 1, 2e8), *((0.1, step, 2e8) for step in (2, 4, 8, 16)))
THUMBNAIL = 144  # pixels


@dataclass
class Embedded:
    """Blocks of text by their name, and the name of each picture's block; `base` is that of its scene's reference."""

    quantum: float
    step: int
    blocks: dict[str, str] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)  # by the name of the picture in the run's folder
    bases: dict[str, str] = field(default_factory=dict)
    offsets: dict[str, str] = field(default_factory=dict)  # by scene, where only a sample of its pixels is kept

    @property
    def size(self) -> int:
        """Bytes of text."""
        return sum(map(len, self.blocks.values()))

    def add(self, text: str) -> str:
        """A new block's name."""
        name = f"block-{len(self.blocks)}"
        self.blocks[name] = text
        return name


def embed(folder: Path, scenes: list[dict[str, Any]]) -> Embedded:
    """All pictures of the judged scenes, as exactly as the budget allows; some are left out where nothing helps."""
    pixels = sum(scene["width"] * scene["height"] * len(list(_images(scene))) for scene in scenes)
    for quantum, step, most in LADDER:
        if pixels / step**2 > most and (quantum, step, most) != LADDER[-1]:
            continue
        embedded = Embedded(quantum, step)
        for scene in scenes:
            _embed_scene(folder, scene, embedded)
            if embedded.size > BUDGET:
                break
        else:
            return embedded
    return embedded


def _embed_scene(folder: Path, scene: dict[str, Any], embedded: Embedded) -> None:
    if not any(_images(scene)):
        return
    kept = _sample(folder, scene, embedded.step)
    if embedded.step > 1:
        embedded.offsets[scene["scene"]] = embedded.add(pack_bytes(kept.offset))
    base: tuple[str, Quanta] | None = None
    for image in _images(scene):
        quanta = to_quanta(kept.of(read_image(folder / f"{image}.exr")), embedded.quantum)
        if base is None:
            base = embedded.add(pack_reference(quanta)), quanta
            embedded.names[image] = base[0]
        else:
            embedded.names[image] = embedded.add(pack_other(quanta, base[1]))
            embedded.bases[image] = base[0]
    for comparison in scene["comparisons"]:
        for name in comparison["maps"].values():
            values = np.rint(kept.of(read_image(folder / f"{name}.png"))[..., 0]).astype(np.uint8)
            embedded.names[name] = embedded.add(pack_bytes(values))


def _images(scene: dict[str, Any]) -> Iterator[str]:
    """The pictures of a scene, the reference first."""
    yield from (picture["image"] for picture in [scene["reference"], *scene["comparisons"]] if picture["image"])


def _sample(folder: Path, scene: dict[str, Any], step: int) -> Sample:
    """Which pixels to keep: where the pictures of the scene differ most from the first."""
    if step == 1:
        return Sample(1, np.zeros((0, 0), np.uint8))
    first, *others = _images(scene)
    truth = read_image(folder / f"{first}.exr")
    error: NDArray[np.float64] = np.zeros(truth.shape[:2])
    for image in others:
        np.maximum(error, error_map(truth, read_image(folder / f"{image}.exr")), out=error)
    return sample(error, step)


def thumbnail(folder: Path, image: str, side: int = THUMBNAIL) -> str:
    """A JPEG of a picture, at most `side` pixels wide and high, as an address that holds its data."""
    from PIL import Image

    data = io.BytesIO()
    with Image.open(folder / f"{image}.png") as picture:
        small = picture.convert("RGB")
        small.thumbnail((side, side), Image.Resampling.LANCZOS)
        small.save(data, "JPEG", quality=80)
    return "data:image/jpeg;base64," + base64.b64encode(data.getvalue()).decode("ascii")
