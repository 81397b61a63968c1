"""Pictures in memory and in files. The only quantisation is here.

In memory a picture is height x width x 3 in levels (0..255), linear, row 0 on top. A float file holds levels / 255.
"""

from __future__ import annotations

import errno
import io
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import DeviceError, InputError
from reference.files import replacing

JPEG = (".jpg", ".jpeg")
LARGEST_JPEG = 65500  # pixels a side
FORMATS = (*JPEG, ".png", ".exr")

Picture = NDArray[np.floating[Any]]


def quantise(levels: Picture) -> NDArray[np.uint8]:
    """Clamp once to 0..255 and truncate, as the document does; what is not a number becomes 0."""
    return np.nan_to_num(np.clip(levels, 0, 255)).astype(np.uint8)


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
    check_format(path)
    if Path(path).suffix.lower() == ".exr":
        pixels: NDArray[Any] = np.ascontiguousarray(levels, np.float32) / np.float32(255)
    else:
        pixels = quantise(levels)
    if max(pixels.shape) > LARGEST_JPEG and Path(path).suffix.lower() in JPEG:
        raise InputError(f"{path}: expected at most {LARGEST_JPEG} pixels a side for a JPEG; PNG and EXR can be larger")
    with replacing(path) as temporary:
        if Path(path).suffix.lower() in JPEG:
            temporary.write_bytes(_encode_jpeg(pixels))
        else:
            _write_pixels(temporary, pixels)


def _encode_jpeg(pixels: NDArray[np.uint8]) -> bytes:
    """As the document's pictures are saved. In memory: OpenImageIO's JPEG writer ends the process on a full disk."""
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "JPEG", quality=75, subsampling="4:2:0")
    return data.getvalue()


def _write_pixels(path: Path, pixels: NDArray[Any]) -> None:
    """Write an array as it is (8 bit or float32) and read it back, since encoders can miss a full disk."""
    import OpenImageIO as oiio

    height, width, channels = pixels.shape
    kind = oiio.FLOAT if pixels.dtype == np.float32 else oiio.UINT8
    output: Any = oiio.ImageOutput.create(str(path))
    done = output.open(str(path), oiio.ImageSpec(width, height, channels, kind)) and output.write_image(pixels)
    if not (output.close() and done and _reads_back(path)):
        reason = output.geterror() if os.statvfs(path.parent).f_bavail else os.strerror(errno.ENOSPC)
        raise OSError(reason.replace(str(path), "").strip() or "the file came out incomplete")


def _reads_back(path: Path) -> bool:
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()
        return False
    pixels = source.read_image()
    source.close()
    return pixels is not None and not source.has_error


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
