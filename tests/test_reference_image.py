"""Pictures in files: whole or band by band they are the same, in little memory, and nothing half-written is left."""

import io
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from helpers import EXAMPLE, ROOT
from PIL import Image

from reference import Scene, render
from reference.errors import InputError, OutputError
from reference.image import LARGEST_JPEG, Picture, quantise, read_image, write_bands, write_image
from reference.scene import LARGEST_SIDE

ENDINGS = [".jpg", ".png", ".exr"]
KNOWN = b"what was here before"
STREAMED = """\
import sys
from pathlib import Path
import numpy as np
import OpenImageIO
from reference.image import write_bands
def peak():
    (line,) = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")]
    return int(line.split()[1])
band = np.full((32, 8192, 3), 7.0)
write_bands(sys.argv[1], 8192, 32, [band])
before = peak()
write_bands(sys.argv[1], 8192, 2048, (band for _ in range(64)))
print(peak() - before)
"""


def noise(height: int, width: int) -> Picture:
    return np.random.default_rng(7).uniform(-40, 300, (height, width, 3))


def same(a: Path, b: Path) -> bool:
    """Byte for byte, but for the time that an EXR tells."""
    if a.suffix == ".exr":
        return a.stat().st_size == b.stat().st_size and np.array_equal(read_image(a), read_image(b))
    return a.read_bytes() == b.read_bytes()


def cut(picture: Picture, *places: int) -> Iterator[Picture]:
    yield from np.split(picture, places)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_quantisation(dtype: type) -> None:
    levels = [np.nan, np.inf, -np.inf, -0.0, -1, 0.999, 1, 254.999, 255, 256, 1e30]
    expected = [0, 255, 0, 0, 0, 0, 1, 254, 255, 255, 255]
    assert quantise(np.array(levels, dtype)).tolist() == expected
    tall: Picture = noise(100, 3).astype(dtype)
    assert np.array_equal(quantise(tall), np.clip(tall, 0, 255).astype(np.uint8))


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("places", [(1, 8, 30), (16, 32), range(1, 37)])
def test_bands_make_the_same_file_as_the_whole(ending: str, places: tuple[int, ...], tmp_path: Path) -> None:
    picture = noise(37, 50)
    whole, banded = (tmp_path / (name + ending) for name in ("whole", "banded"))
    write_image(whole, picture)
    write_bands(banded, 50, 37, cut(picture, *places))
    assert same(banded, whole)


def test_files_hold_the_levels(tmp_path: Path) -> None:
    picture = noise(37, 50)
    picture[3, 4] = (np.nan, np.inf, -np.inf)
    for ending in ENDINGS:
        write_image(tmp_path / f"a{ending}", picture)
    single = picture.astype(np.float32) / np.float32(255)
    assert np.array_equal(read_image(tmp_path / "a.exr"), single.astype(float) * 255, equal_nan=True)
    assert np.array_equal(read_image(tmp_path / "a.png"), quantise(picture))
    expected = io.BytesIO()
    Image.fromarray(quantise(picture)).save(expected, "JPEG", quality=75, subsampling="4:2:0")
    assert (tmp_path / "a.jpg").read_bytes() == expected.getvalue()


@pytest.mark.parametrize("ending", [".png", ".exr"])
@pytest.mark.parametrize(("width", "height"), [(LARGEST_SIDE, 1), (1, LARGEST_SIDE), (LARGEST_SIDE, 34)])
def test_the_largest_sides(width: int, height: int, ending: str, tmp_path: Path) -> None:
    picture = render(Scene.load(EXAMPLE), width=width, height=height)
    write_image(tmp_path / f"a{ending}", picture)
    expected = quantise(picture) if ending == ".png" else picture
    assert np.abs(read_image(tmp_path / f"a{ending}") - expected).max() < 1e-4


@pytest.mark.parametrize(("width", "height"), [(LARGEST_JPEG, 1), (2, LARGEST_JPEG)])
def test_the_largest_sides_of_a_jpeg(width: int, height: int, tmp_path: Path) -> None:
    write_image(tmp_path / "a.jpg", np.full((height, width, 3), 90.0))
    assert read_image(tmp_path / "a.jpg").shape == (height, width, 3)
    with pytest.raises(InputError, match=f"b.jpg: expected at most {LARGEST_JPEG} pixels a side for a JPEG"):
        write_bands(tmp_path / "b.jpg", width + 1, height + 1, broken(9))
    assert [path.name for path in tmp_path.iterdir()] == ["a.jpg"]


def broken(rows: int) -> Iterator[Picture]:
    """Some rows, then an error."""
    yield noise(rows, 50)
    raise ZeroDivisionError


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("rows", [0, 1, 20])
def test_an_error_half_way_leaves_no_file(ending: str, rows: int, tmp_path: Path) -> None:
    (tmp_path / f"old{ending}").write_bytes(KNOWN)
    for name in ("old", "new"):
        with pytest.raises(ZeroDivisionError):
            write_bands(tmp_path / f"{name}{ending}", 50, 37, broken(rows))
    assert [path.name for path in tmp_path.iterdir()] == [f"old{ending}"]
    assert (tmp_path / f"old{ending}").read_bytes() == KNOWN


@pytest.mark.parametrize("ending", [".png", ".exr"])
def test_bands_that_end_early_leave_no_file(ending: str, tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        write_bands(tmp_path / f"a{ending}", 50, 37, iter([noise(36, 50)]))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_same_picture_is_the_same_file_at_any_time(ending: str, tmp_path: Path) -> None:
    files = [tmp_path / (name + ending) for name in ("early", "late")]
    write_image(files[0], noise(5, 4))
    time.sleep(1.1)  # a date in the file would tell
    write_image(files[1], noise(5, 4))
    assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_disk_that_fills_at_any_byte(ending: str, tmp_path: Path) -> None:
    """Whatever limit a file may grow to, it is written whole or not at all: encoders can miss what their end lacks."""
    picture = np.full((64, 64, 3), 9.0)
    picture[::5, ::7] = noise(13, 10)
    old, new = (tmp_path / (name + ending) for name in ("old", "new"))
    write_image(old, picture)
    size = old.stat().st_size
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    written = []
    for limit in [*range(0, size, max(1, size // 50)), *range(size - 20, size + 2)]:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
        try:
            write_bands(new, 64, 64, cut(picture, 11, 40))
            written.append(limit)
        except OutputError:
            assert not new.exists()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        if new.exists():
            assert new.read_bytes() == old.read_bytes()
            new.unlink()
    assert written == [size, size + 1]
    assert [path.name for path in tmp_path.iterdir()] == [old.name]


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak of memory is read from Linux's /proc")
@pytest.mark.parametrize(("ending", "most"), [(".png", 25), (".exr", 50), (".jpg", 100)])
def test_memory_stays_small(ending: str, most: int, tmp_path: Path) -> None:
    """A picture of 17 million pixels, which is 400 MB in double precision and 50 MB in 8 bit."""
    command = [sys.executable, "-c", STREAMED, str(tmp_path / f"a{ending}")]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True)
    assert int(result.stdout) < most * 1000
