"""Packed pictures hold every value, and pages stay small."""

import base64
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import ROOT
from numpy.typing import NDArray
from recorded import GREY, HEIGHT, NAME, WIDTH, altered, facts, record

import reports.embedding
from reference import EXACT, Scene, render
from reference.image import Picture, read_image, write_image
from reports.embedding import embed
from reports.packing import Quanta, pack_other, pack_reference, sample, to_quanta
from reports.results import judge


def differences(text: str, shape: tuple[int, int]) -> Quanta:
    """What a block's text says, as the page's script reads it: channels x rows x columns."""
    data = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).reshape(-1, 3, *shape).astype(np.uint32)
    folded = sum((plane << np.uint32(8 * place) for place, plane in enumerate(data)), np.zeros_like(data[0]))
    return (folded >> 1).astype(np.int32) ^ -(folded & 1).astype(np.int32)


def unpacked(text: str, reference: Quanta | None, shape: tuple[int, int]) -> Quanta:
    found = differences(text, shape)
    if reference is None:
        found = found.cumsum(axis=1, dtype=np.int32).cumsum(axis=2, dtype=np.int32)
    else:
        found = found + np.moveaxis(reference, -1, 0)
    return np.moveaxis(found, 0, -1)


def hostile(seed: int) -> NDArray[np.float64]:
    """Values of every size, infinite ones, and some that are no numbers."""
    random = np.random.default_rng(seed)
    picture = random.normal(0, 10.0 ** random.integers(-6, 12, (13, 17, 3)))
    picture.flat[random.choice(picture.size, 30, replace=False)] = [np.nan, np.inf, -np.inf] * 10
    return picture


@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_lost_beyond_the_quantum(seed: int) -> None:
    right, other = (to_quanta(hostile(number), 0.01) for number in (seed, seed + 100))
    assert (unpacked(pack_reference(right), None, (13, 17)) == right).all()
    assert (unpacked(pack_other(other, right), right, (13, 17)) == other).all()


def test_quanta_are_the_nearest() -> None:
    levels = np.array([[[0.004, 0.006, -0.006], [255, np.nan, np.inf], [-np.inf, 1e12, -1e12]]])
    assert to_quanta(levels, 0.01).tolist() == [
        [[0, 1, -1], [25500, -(2**31), 2**31 - 1], [-(2**31) + 1, 2**31 - 2, -(2**31) + 2]]
    ]


def test_equal_pictures_cost_next_to_nothing() -> None:
    right = to_quanta(np.random.default_rng(0).uniform(0, 255, (200, 300, 3)), 0.01)
    assert len(pack_other(right, right)) < 400
    assert len(pack_reference(right)) > 100_000


@pytest.mark.parametrize(("width", "height"), [(12, 8), (13, 9), (1, 1), (5, 16)])
@pytest.mark.parametrize("step", [2, 4])
def test_samples_keep_the_worst_pixel_of_each_block(width: int, height: int, step: int) -> None:
    error = np.random.default_rng(1).uniform(0, 1, (height, width))
    kept = sample(error, step).of(error[..., None])[..., 0]
    for row, column in np.ndindex(kept.shape):
        assert kept[row, column] == error[row * step :, column * step :][:step, :step].max()


SCENES: dict[str, list[tuple[dict[str, Any], Picture | None]]] = {
    "scenes/one.txt": [
        (facts("native"), GREY),
        (facts("povray"), altered((111, 61, 200))),
        (facts("tachyon", "not-installed", "not here"), None),
    ],
    f"scenes/{NAME}.txt": [(facts("native", "failed", "it failed"), None), (facts("mitsuba"), altered((1, 1, np.nan)))],
    "scenes/none.txt": [(facts("native", "failed", "it failed"), None)],
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    folder = record(tmp_path_factory.mktemp("run"), SCENES)
    scenes: list[dict[str, Any]] = judge(folder)["scenes"]
    return folder, scenes


def test_every_picture_has_a_block(run: tuple[Path, list[dict[str, Any]]]) -> None:
    folder, scenes = run
    embedded = embed(folder, scenes)
    assert (embedded.quantum, embedded.step, embedded.offsets) == (0.001, 1, {})
    images = [picture["image"] for scene in scenes for picture in [scene["reference"], *scene["comparisons"]]]
    drawn = [image for image in images if image]
    assert len(drawn) == 3
    maps = [name for scene in scenes for picture in scene["comparisons"] for name in picture["maps"].values()]
    assert set(embedded.names) == {*drawn, *maps}
    assert list(embedded.bases) == [scenes[0]["comparisons"][0]["image"]]
    right, other = (to_quanta(read_image(folder / f"{image}.exr"), 0.001) for image in drawn[:2])
    assert (unpacked(embedded.blocks[embedded.names[drawn[0]]], None, (HEIGHT, WIDTH)) == right).all()
    assert (unpacked(embedded.blocks[embedded.names[drawn[1]]], right, (HEIGHT, WIDTH)) == other).all()


def test_what_is_too_much_becomes_coarser(
    run: tuple[Path, list[dict[str, Any]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, _ = run
    noise = np.random.default_rng(0).uniform(0, 255, (HEIGHT, WIDTH, 3))
    noisy = record(folder.parent / "noisy", {"noise.txt": [(facts("native"), noise), (facts("povray"), noise[::-1])]})
    judged = judge(noisy)["scenes"]
    found = []
    for budget in (10**6, 190_000, 150_000, 40_000, 3_000, 10):
        monkeypatch.setattr(reports.embedding, "BUDGET", budget)
        embedded = embed(noisy, judged)
        found.append((embedded.quantum, embedded.step))
        assert embedded.size <= budget or embedded.step == 16
    assert found[0] == (0.001, 1)
    assert found == sorted(found)
    assert found[-1] == (0.1, 16)
    assert len(set(found)) >= 5


def test_large_runs_are_not_tried_in_full(
    run: tuple[Path, list[dict[str, Any]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, scenes = run
    monkeypatch.setattr(reports.embedding, "LADDER", ((0.001, 1, 1e3), (0.1, 2, 2e4)))
    embedded = embed(folder, scenes)
    assert (embedded.quantum, embedded.step) == (0.1, 2)
    assert set(embedded.offsets) == {scenes[0]["scene"], scenes[1]["scene"]}
    offsets = embedded.blocks[embedded.offsets["one"]]
    offset = np.frombuffer(zlib.decompress(base64.b64decode(offsets)), np.uint8).reshape(HEIGHT // 2, WIDTH // 2)
    assert offset[30, 55] == 3  # column 111, row 61
    assert np.count_nonzero(offset) == 1


def test_four_examples_in_six_renderers_stay_small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At 1000 x 1000, two renderers as noisy as POV-Ray and Mitsuba's own plugins are, three in single precision.

    Only the example that takes most room is packed, and has a quarter of it.
    """
    random = np.random.default_rng(0)
    truth = render(Scene.load(ROOT / "scenes" / "example3.txt"), EXACT, dtype=np.float64)
    noises = (0.0, 2e-3, 2.5e-3, 3e-5, 3e-5, 3e-5)
    images = [f"picture-{number}" for number in range(len(noises))]
    for image, noise in zip(images, noises, strict=True):
        write_image(tmp_path / f"{image}.exr", truth + random.uniform(-noise, noise, truth.shape))
    first, *others = [{"image": image, "maps": {}} for image in images]
    scene = {"scene": "example3", "width": 1000, "height": 1000, "reference": first, "comparisons": others}
    monkeypatch.setattr(reports.embedding, "LADDER", reports.embedding.LADDER[1:])  # as for four of them
    embedded = embed(tmp_path, [scene])
    assert (embedded.quantum, embedded.step) == (0.01, 1)
    assert 4 * embedded.size < reports.embedding.BUDGET < 7.5e6
