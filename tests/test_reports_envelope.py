"""Harmless pictures are right, whatever their sampling and format; wrong ones are not, and it is told where."""

import io
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers import ROOT
from mistakes import MISTAKES, SIDE
from numpy.typing import NDArray
from PIL import Image

from reference import DOCUMENT, Scene, render
from reference.errors import InputError
from reference.image import quantise
from reference.model import pixel_direction
from reports.envelope import Envelope, envelope
from reports.resemblance import blank, unlike
from reports.submission import Facts, Submission, read_submission
from reports.verdict import judge

CORNER = replace(DOCUMENT, camera_direction=lambda column, row, *size: pixel_direction(column - 0.5, row + 0.5, *size))
EXAMPLES = [f"example{number}" for number in range(1, 5)]
SCENES = [*EXAMPLES, "diagnostic/facing_mirrors", "diagnostic/thin_gap", "diagnostic/plane_shadow"]
Pixels = NDArray[np.uint8]


@cache
def scene(name: str) -> Scene:
    return Scene.load(ROOT / "scenes" / f"{name}.txt")


@cache
def bounds(name: str, side: int = SIDE) -> Envelope:
    return envelope(scene(name), side, side)


def png(pixels: Pixels) -> Submission:
    return Submission(pixels.astype(np.float32), Facts("PNG", 8, "RGB"))


def jpeg(pixels: Pixels, quality: int, subsampling: int, folder: object) -> Submission:
    path = f"{folder}/picture.jpg"
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "JPEG", quality=quality, subsampling=subsampling)
    with open(path, "wb") as file:
        file.write(data.getvalue())
    return read_submission(path)


def pictures(name: str, side: int) -> dict[str, Pixels]:
    """Right ones: truncated, rounded, four times four samples, and one of these sixteen at random."""
    large = np.clip(render(scene(name), width=4 * side, height=4 * side), 0, 255)
    samples = large.reshape(side, 4, side, 4, 3)
    random = np.random.default_rng(3)
    at = random.integers(0, 4, (2, side, side))
    rows, columns = np.indices((side, side))
    centre = render(scene(name), width=side, height=side)
    return {
        "truncated": quantise(centre),
        "rounded": quantise(np.rint(centre)),
        "antialiased": quantise(samples.mean(axis=(1, 3))),
        "jittered": quantise(samples[rows, at[0], columns, at[1]]),
    }


@pytest.mark.parametrize("name", SCENES)
def test_harmless_pictures_are_right(name: str, tmp_path: object) -> None:
    for kind, pixels in pictures(name, SIDE).items():
        verdict = judge(bounds(name), png(pixels))
        assert verdict.right, (kind, verdict.reasons)
        assert verdict.rounding == (kind == "rounded" and verdict.exact)
        for quality, subsampling in ((60, 2), (75, 0), (75, 2), (95, 2)):
            verdict = judge(bounds(name), jpeg(pixels, quality, subsampling, tmp_path))
            assert verdict.right, (kind, quality, subsampling, verdict.reasons)


def test_harmless_pictures_of_the_usual_size_are_right(tmp_path: object) -> None:
    kinds = pictures("example1", 1000)
    assert judge(bounds("example1", 1000), png(kinds["jittered"])).right
    assert judge(bounds("example1", 1000), jpeg(kinds["antialiased"], 60, 2, tmp_path)).right


@pytest.mark.parametrize("name", ["eye_inside", "near_unit", "thin_gap"])
@pytest.mark.parametrize("seed", range(4))
def test_few_edges_sampled_at_random_through_jpeg(name: str, seed: int, tmp_path: object) -> None:
    """Where little tells how pixels are sampled, and chance may move what edges there are."""
    random = np.random.default_rng([seed, 107])
    known = bounds(f"diagnostic/{name}")
    low, high, mean = known.low, known.high, known.mean
    part = (mean - low).sum(axis=-1) / np.maximum((high - low).sum(axis=-1), 1e-9)
    jittered = np.where(random.random(part.shape)[..., None] < part[..., None], high, low)
    for quality, subsampling in ((50, 0), (75, 0), (75, 2), (90, 2)):
        verdict = judge(known, jpeg(quantise(jittered), quality, subsampling, tmp_path))
        assert verdict.right, (quality, subsampling, verdict.reasons)
        assert not verdict.exact


@pytest.mark.parametrize("name", EXAMPLES)
def test_mistakes_are_caught(name: str) -> None:
    for id_, mistake in MISTAKES.items():
        pixels = mistake.draw(scene(name))
        off = np.abs(pixels.astype(int) - quantise(bounds(name).centre)).max(axis=-1)
        verdict = judge(bounds(name), png(pixels))
        if np.mean(off > 8) > 5e-4:
            assert not verdict.right, id_
        if off.max() == 1 and np.mean(off > 0) > 5e-4:
            assert verdict.right, id_
            assert verdict.rounding, id_


def test_where_and_on_what() -> None:
    pixels = quantise(bounds("example1").centre)
    pixels[100:103, 110:114] += 60
    verdict = judge(bounds("example1"), png(pixels))
    (blob,) = verdict.blobs
    assert (blob.size, blob.box, verdict.reasons) == (12, (110, 100, 113, 102), ("blobs",))
    assert blob.objects[0] == bounds("example1").names[bounds("example1").objects[101, 111]]
    assert not verdict.right
    assert verdict.count == 12
    pixels = quantise(bounds("example1").centre)
    pixels[100:102, 110:112] += 60
    assert judge(bounds("example1"), png(pixels)).right


def test_a_small_offset_of_everything() -> None:
    brighter = quantise(bounds("example1").centre + np.float32(2.5))
    verdict = judge(bounds("example1"), png(brighter))
    assert "offset" in verdict.reasons
    assert verdict.offset > 1


def test_half_a_pixel_aside() -> None:
    """Samples in the lower left corners of pixels, where an envelope alone sees next to nothing wrong."""
    corner = render(scene("example1"), CORNER, width=SIDE, height=SIDE)
    found = judge(bounds("example1"), png(quantise(corner)))
    assert "displaced" in found.reasons
    assert abs(found.displacement.right - 0.5) < 0.25
    assert abs(found.displacement.down + 0.5) < 0.25


def test_another_size_is_refused() -> None:
    with pytest.raises(InputError, match="200x200 pixels, found 10x10"):
        judge(bounds("example1"), png(np.zeros((10, 10, 3), np.uint8)))


def test_what_is_no_picture_of_the_scene() -> None:
    flat = png(np.full((SIDE, SIDE, 3), 40, np.uint8))
    assert str(blank(bounds("example1"), flat)).startswith("The picture is blank, all of it is (40, 40, 40):")
    noise = np.random.default_rng(4).integers(0, 256, (SIDE, SIDE, 3), np.uint8)
    assert "nothing in common" in str(unlike(bounds("example1"), png(noise)))
    assert blank(bounds("example1"), png(noise)) is None
    right = quantise(bounds("example1").centre)
    for picture in (right, right[::-1], right[:, ::-1], right.transpose(1, 0, 2), 255 - right):
        assert unlike(bounds("example1"), png(picture)) is None
