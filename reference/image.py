"""Pictures in memory and in files. The only quantisation is here.

In memory a picture is height x width x 3 in levels (0..255), linear, row 0 on top. A float file holds levels / 255.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from reference.errors import InputError, OutputError
from reference.files import replacing

FORMATS = (".jpg", ".jpeg", ".png", ".exr")
JPEG = {"Compression": "jpeg:75", "jpeg:subsampling": "4:2:0"}  # what the document's pictures are saved with

Picture = NDArray[np.floating[Any]]


def quantise(levels: Picture) -> NDArray[np.uint8]:
    """Clamp once to 0..255 and truncate, as the document does; what is not a number becomes 0."""
    return np.nan_to_num(np.clip(levels, 0, 255)).astype(np.uint8)


def check_format(path: str | Path) -> None:
    """Raise InputError unless the name of the file tells a format that can be written."""
    if Path(path).suffix.lower() not in FORMATS:
        raise InputError(f"{path}: expected a picture name ending in {', '.join(FORMATS)}")


def write_image(path: str | Path, levels: Picture) -> None:
    """Write JPEG (quality 75, 4:2:0) or PNG in 8 bit, or EXR in linear float32, as the name says.

    Raises InputError for an unknown ending and OutputError where the file cannot be written.
    """
    check_format(path)
    if Path(path).suffix.lower() == ".exr":
        pixels: NDArray[Any] = np.ascontiguousarray(levels, np.float32) / np.float32(255)
    else:
        pixels = quantise(levels)
    with replacing(path) as temporary:
        write_pixels(temporary, pixels)


def write_pixels(path: Path, pixels: NDArray[Any]) -> None:
    """Write an array as it is (8 bit or float32) and read it back, since encoders can miss a full disk."""
    height, width, channels = pixels.shape
    kind = oiio.FLOAT if pixels.dtype == np.float32 else oiio.UINT8
    spec = oiio.ImageSpec(width, height, channels, kind)
    for name, value in (JPEG if path.suffix.lower() in (".jpg", ".jpeg") else {}).items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    done = output is not None and output.open(str(path), spec) and output.write_image(pixels)
    done = output is not None and output.close() and done
    if not done or not _reads_back(path):
        free = os.statvfs(path.parent).f_bavail
        reason = "no space left on device" if not free else (output.geterror() if output else oiio.geterror())
        raise OutputError(f"{path.name}: cannot be written: {reason.strip() or 'the file came out incomplete'}")


def _reads_back(path: Path) -> bool:
    source = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()
        return False
    pixels = source.read_image()
    source.close()
    return pixels is not None and not source.has_error


def read_image(path: str | Path) -> Picture:
    """Read any picture as float64 levels; grey becomes three channels, alpha is dropped. Raises InputError."""
    if not Path(path).is_file():
        raise InputError(
            f"{path}:1:1: expected a picture, found {'a directory' if Path(path).is_dir() else 'no such file'}"
        )
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
    """Show the picture in a Matplotlib window, pixel for pixel in colour."""
    import matplotlib.pyplot as plt

    plt.imshow(quantise(levels))
    plt.axis("off")
    plt.show()
