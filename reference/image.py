"""Pictures in memory and in files. The only quantisation is here.

In memory a picture is height x width x 3 in levels (0..255), linear, row 0 on top. A float file holds levels / 255.
"""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import DeviceError, InputError
from reference.files import replacing

JPEG = (".jpg", ".jpeg")
LARGEST_JPEG = 65500  # pixels a side
FORMATS = (*JPEG, ".png", ".exr")
PNG_END = b"\0\0\0\0IEND\xaeB`\x82"
PNG_FILTER = 16  # libpng's PNG_FILTER_SUB, the difference from the pixel on the left, for every row
BAND = 1 << 22  # pixels that are encoded at a time
CACHED = 16  # rows that are quantised at a time

Picture = NDArray[np.floating[Any]]


def quantise(levels: Picture) -> NDArray[np.uint8]:
    """Clamp once to 0..255 and truncate, as the document does; what is not a number becomes 0."""
    pixels, room = np.empty(levels.shape, np.uint8), np.empty_like(levels[:CACHED])
    for top in range(0, len(levels), CACHED):
        rows = levels[top : top + CACHED]
        clamped = np.fmax(rows, 0, out=room[: len(rows)])
        pixels[top : top + CACHED] = np.fmin(clamped, 255, out=clamped)
    return pixels


def check_format(path: str | Path) -> None:
    """Raise InputError unless the name of the file tells a format that can be written."""
    if Path(path).suffix.lower() not in FORMATS:
        raise InputError(f"{path}: expected a picture name ending in {', '.join(FORMATS)}")
    _check_name(path)


def _check_name(path: str | Path) -> None:
    """OpenImageIO takes no other names; the folder's counts too."""
    try:
        os.path.realpath(path).encode()
    except UnicodeEncodeError as error:
        raise InputError(f"{path}: expected a path in UTF-8 for a picture") from error


def write_image(path: str | Path, levels: Picture) -> None:
    """Write JPEG (quality 75, 4:2:0) or PNG in 8 bit, or EXR in linear float32, as the name says.

    Raises InputError for an unknown ending and OutputError where the file cannot be written.
    """
    height, width, _ = levels.shape
    rows = max(1, BAND // width)
    write_bands(path, width, height, (levels[top : top + rows] for top in range(0, height, rows)))


def write_bands(path: str | Path, width: int, height: int, bands: Iterable[Picture]) -> None:
    """Write a picture as `write_image` does, given from top to bottom: rows x width x 3, some rows at a time.

    PNG and EXR are never whole in memory; a JPEG is, at 4 bytes a pixel. What `bands` raises leaves no file behind.
    """
    check_format(path)
    jpeg = Path(path).suffix.lower() in JPEG
    if jpeg and max(width, height) > LARGEST_JPEG:
        raise InputError(f"{path}: expected at most {LARGEST_JPEG} pixels a side for a JPEG; PNG and EXR can be larger")
    with replacing(path) as temporary:
        if jpeg:
            temporary.write_bytes(_encode_jpeg(width, height, bands))
        else:
            _write_rows(temporary, width, height, bands)


def _encode_jpeg(width: int, height: int, bands: Iterable[Picture]) -> memoryview:
    """As the document's pictures are saved. In memory: OpenImageIO's JPEG writer ends the process on a full disk."""
    from PIL import Image

    picture, top = Image.new("RGB", (width, height)), 0
    for band in bands:
        picture.paste(Image.fromarray(quantise(band)), (0, top))
        top += len(band)
    data = io.BytesIO()
    picture.save(data, "JPEG", quality=75, subsampling="4:2:0")
    return data.getbuffer()


def _write_rows(path: Path, width: int, height: int, bands: Iterable[Picture]) -> None:
    """Write band after band and look whether the end has come out, since encoders can miss a full disk."""
    import OpenImageIO as oiio

    exact = path.suffix.lower() == ".exr"
    spec = oiio.ImageSpec(width, height, 3, oiio.FLOAT if exact else oiio.UINT8)
    if exact:
        spec.attribute("compression", "zip:1")  # a fifth to a third faster than the usual 4, and 5 % larger
        spec.attribute("DateTime", "")  # none: the same picture is the same file at any time
    else:
        spec.attribute("png:compressionLevel", 1)  # with its filter, four times as fast as usual and twice as large
        spec.attribute("png:filter", PNG_FILTER)
    output: Any = oiio.ImageOutput.create(str(path))
    done, top = output.open(str(path), spec), 0
    try:
        for band in bands if done else ():
            rows = np.divide(band, 255, dtype=np.float32, casting="same_kind", order="C") if exact else quantise(band)
            if not (done := output.write_scanlines(top, top + len(band), 0, rows)):
                break
            top += len(band)
    finally:
        closed = output.close()
    if not (closed and done and _is_whole(path)):
        reason = output.geterror() if os.statvfs(path.parent).f_bavail else os.strerror(errno.ENOSPC)
        raise OSError(reason.replace(str(path), "").strip() or "the file came out incomplete")


def _is_whole(path: Path) -> bool:
    """Whether the end is there, which is written last: the final chunk of a PNG, the last row of an EXR."""
    if path.suffix.lower() == ".png":
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - len(PNG_END)))
            return file.read() == PNG_END
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()
        return False
    row = source.read_scanline(source.spec().height - 1, 0, oiio.UNKNOWN)
    source.close()
    return row is not None and not source.has_error


def read_image(path: str | Path) -> Picture:
    """Read any picture as float64 levels; grey becomes three channels, alpha is dropped. Raises InputError."""
    import OpenImageIO as oiio

    if not Path(path).is_file():
        raise InputError(
            f"{path}:1:1: expected a picture, found {'a directory' if Path(path).is_dir() else 'no such file'}"
        )
    _check_name(path)
    source = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()
        raise InputError(f"{path}:1:1: expected a picture, found something else")
    spec = source.spec()
    pixels = source.read_image(spec.format)
    message = source.geterror()
    source.close()
    if pixels is None or message:
        raise InputError(f"{path}:1:1: expected a whole picture, found one that breaks off")
    pixels = pixels.reshape(spec.height, spec.width, spec.nchannels)
    scale = 255 / np.iinfo(pixels.dtype).max if np.issubdtype(pixels.dtype, np.integer) else 255
    colour = pixels[..., :3] if spec.nchannels >= 3 else np.repeat(pixels[..., :1], 3, axis=-1)
    return np.asarray(colour.astype(np.float64) * scale)


def show_window(levels: Picture) -> None:
    """Show the picture in a Matplotlib window. Raises DeviceError where there is no display."""
    import matplotlib.pyplot as plt

    if plt.get_backend().lower() == "agg":
        raise DeviceError("the picture cannot be shown: there is no display")
    plt.imshow(quantise(levels))
    plt.axis("off")
    plt.show()
