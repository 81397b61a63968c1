"""Pictures of every usual format are read; whatever is none is refused in one sentence."""

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from reference.errors import InputError
from reports.submission import read_submission

SIDE = 24
PIXELS = np.random.default_rng(2).integers(0, 256, (SIDE, SIDE, 3), np.uint8)


@pytest.mark.parametrize("name", ["a.png", "a.bmp", "a.ppm", "a.tif", "a.tga", "a.webp"])
def test_exact_formats(tmp_path: Path, name: str) -> None:
    options: dict[str, Any] = {"lossless": True} if name == "a.webp" else {}
    Image.fromarray(PIXELS).save(tmp_path / name, **options)
    read = read_submission(tmp_path / name)
    assert read.levels.dtype == np.float32
    assert (read.levels == PIXELS).all()
    assert (read.facts.bits, read.facts.channels, read.facts.lossy) == (8, "RGB", False)


@pytest.mark.parametrize(("subsampling", "name"), [(0, "4:4:4"), (1, "4:2:2"), (2, "4:2:0")])
def test_a_jpeg_tells_its_tables(tmp_path: Path, subsampling: int, name: str) -> None:
    path = tmp_path / "a.jpg"
    Image.fromarray(PIXELS).save(path, quality=60, subsampling=subsampling)
    facts = read_submission(path).facts
    assert (facts.format, facts.subsampling, len(facts.tables), facts.tables[0][0]) == ("JPEG", name, 2, 13)


def test_what_loses_levels_without_telling_how_is_refused(tmp_path: Path) -> None:
    Image.fromarray(PIXELS).save(tmp_path / "a.webp", quality=80)
    refuse(tmp_path / "a.webp", "found a lossy WebP: save a PNG")
    Image.fromarray(PIXELS).save(tmp_path / "a.gif")
    refuse(tmp_path / "a.gif", "found a palette of 256: save a PNG")
    Image.fromarray(PIXELS).quantize(256).save(tmp_path / "a.png")
    refuse(tmp_path / "a.png", "found a palette of 256: save a PNG")


def test_a_palette_that_suffices_is_exact(tmp_path: Path) -> None:
    few = PIXELS // 64 * 64
    Image.fromarray(few).quantize(64).save(tmp_path / "a.png")
    read = read_submission(tmp_path / "a.png")
    assert (read.facts.channels, read.facts.lossy) == ("palette", False)
    assert (read.levels == few).all()


def test_grey_and_sixteen_bit(tmp_path: Path) -> None:
    Image.fromarray(PIXELS[..., 0]).save(tmp_path / "grey.png")
    Image.fromarray(PIXELS[..., 0].astype(np.uint16) * 257).save(tmp_path / "deep.png")
    for name, bits in (("grey.png", 8), ("deep.png", 16)):
        read = read_submission(tmp_path / name)
        assert (read.facts.channels, read.facts.bits) == ("grey", bits)
        assert np.abs(read.levels - PIXELS[..., :1]).max() < 1e-3


def test_transparency_lies_over_black(tmp_path: Path) -> None:
    alpha = np.full((SIDE, SIDE, 1), 255, np.uint8)
    alpha[0] = 0
    Image.fromarray(np.concatenate([PIXELS, alpha], axis=-1)).save(tmp_path / "a.png")
    read = read_submission(tmp_path / "a.png")
    assert read.facts.transparent
    assert not read.levels[0].any()
    assert (read.levels[1:] == PIXELS[1:]).all()


def refuse(path: Path, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_submission(path)


def test_what_is_no_picture(tmp_path: Path) -> None:
    refuse(tmp_path / "none.png", "no such file")
    refuse(tmp_path, "a directory")
    for content, reason in ((b"", "an empty file"), (b"255 255\n", "a text file"), (b"\0\1\2\3", "something else")):
        (tmp_path / "a.png").write_bytes(content)
        refuse(tmp_path / "a.png", reason)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.bmp", "a.ppm", "a.tif", "a.tga", "a.webp", "a.gif"])
@pytest.mark.parametrize("part", [0.5, 0.9])
def test_truncated(tmp_path: Path, name: str, part: float) -> None:
    options: dict[str, Any] = {"lossless": True} if name == "a.webp" else {}
    Image.fromarray(PIXELS).save(tmp_path / name, **options)
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: int(len(data) * part)])
    refuse(tmp_path / name, "breaks off")


@pytest.mark.parametrize(("width", "reason"), [(60000, "far more"), (5000, "5000x60000|far more")])
def test_enormous_sizes_are_refused_by_the_header(tmp_path: Path, width: int, reason: str) -> None:
    Image.fromarray(PIXELS).save(tmp_path / "a.png")
    data = bytearray((tmp_path / "a.png").read_bytes())
    data[16:24] = struct.pack(">II", width, 60000)
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    (tmp_path / "a.png").write_bytes(data)
    refuse(tmp_path / "a.png", reason)
