"""Somebody's picture: read with what its format can have done to it, or refused in one sentence."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import InputError
from reference.image import read_image

if TYPE_CHECKING:
    from PIL.Image import Image

LARGEST_SIDE = 4096  # pixels; larger pictures are refused before they are decoded
FORMATS = ("PNG", "JPEG", "BMP", "GIF", "TIFF", "PPM", "WEBP")  # Pillow's names
PALETTE = 200  # colours: a picture that has fewer has lost none to a palette of 256
SUBSAMPLINGS = {0: "4:4:4", 1: "4:2:2", 2: "4:2:0"}  # Pillow's numbers
EXR = b"v/1\x01"
PNG = b"\x89PNG\r\n\x1a\n"
MARKS = (PNG, b"\xff\xd8", b"GIF8", b"RIFF", b"II*\0", b"MM\0*")  # of pictures, at the start
PNG_DEPTH = 24  # where a PNG says how many bits a sample has

Levels = NDArray[np.float32]


@dataclass(frozen=True)
class Facts:
    """What a file says of itself."""

    format: str
    bits: int  # of a sample; 32 for floats
    channels: str  # grey, grey and alpha, RGB, RGBA, palette, CMYK
    tables: tuple[tuple[int, ...], ...] = ()  # a JPEG's quantisation: 64 divisors each, luminance first
    subsampling: str | None = None  # of a JPEG's colours
    transparent: bool = False

    @property
    def lossy(self) -> bool:
        """Whether the format changes levels by more than it rounds them."""
        return bool(self.tables)


@dataclass(frozen=True)
class Submission:
    """A picture that was handed in: height x width x 3 in levels (0..255), row 0 on top, over black."""

    levels: Levels
    facts: Facts


def read_submission(path: str | Path) -> Submission:
    """Read a picture of any usual format, of 8 or 16 bit, in grey, colours or a palette, transparent or not.

    Raises InputError, in one sentence, for what is no whole picture, and before it is decoded for one of more than
    4096 pixels a side.
    """
    from PIL import Image, UnidentifiedImageError

    start = _read_start(Path(path))
    if start.startswith(EXR):
        return _read_floats(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what a damaged or enormous file says is said below
            Image.init()
            by_ending = ("TGA",) if Path(path).suffix.lower() == ".tga" else ()  # which nothing else tells
            with Image.open(path, formats=FORMATS + by_ending) as image:
                _check_size(path, *image.size)
                facts = _facts(image, start)
                image.load()
                _check_losses(path, image, start)
                deep = facts.format == "PNG" and facts.bits == 16
                levels = read_image(path).astype(np.float32) if deep else _levels(image)
    except Image.DecompressionBombError:
        raise InputError(f"{path}: expected at most {LARGEST_SIDE} pixels a side, found far more") from None
    except UnidentifiedImageError:
        raise InputError(f"{path}: expected a picture, found {_describe(start)}") from None
    except InputError:
        raise
    except Exception:  # whatever a decoder makes of damaged bytes
        raise InputError(f"{path}: expected a whole picture, found one that is damaged or breaks off") from None
    return Submission(levels, facts)


def _read_start(path: Path) -> bytes:
    """The first bytes of a file. Raises InputError where there are none."""
    if path.is_dir():
        raise InputError(f"{path}: expected a picture, found a directory")
    if not path.is_file():
        raise InputError(f"{path}: expected a picture, found no such file")
    try:
        with path.open("rb") as file:
            start = file.read(1024)
    except OSError as error:
        raise InputError(f"{path}: expected a picture, found that it cannot be read: {error.strerror}") from None
    if not start:
        raise InputError(f"{path}: expected a picture, found an empty file")
    return start


def _check_size(path: str | Path, width: int, height: int) -> None:
    if max(width, height) > LARGEST_SIDE:
        raise InputError(f"{path}: expected at most {LARGEST_SIDE} pixels a side, found {width}x{height}")


def _check_losses(path: str | Path, image: Image, start: bytes) -> None:
    """Refuse what a format has done to levels that nothing tells from a mistake."""
    if image.mode == "P" and len(image.getcolors() or ()) > PALETTE:
        raise InputError(f"{path}: expected all colours, found a palette of 256: save a PNG of 24 bit instead")
    if image.format == "WEBP" and b"VP8L" not in start:
        raise InputError(f"{path}: expected exact levels or a JPEG, found a lossy WebP: save a PNG instead")


def _describe(start: bytes) -> str:
    """What a file that is no picture looks like."""
    if start.startswith(MARKS):
        return "the start of one that is damaged or breaks off"
    for name, mark in (("a PDF", b"%PDF"), ("a ZIP archive", b"PK\3\4"), ("a web page", b"<!DOCTYPE html")):
        if start[: len(mark)].lower() == mark.lower():
            return name
    try:
        start[:-4].decode()  # a letter may be cut at the end
    except UnicodeDecodeError:
        return "something else"
    return "something else" if b"\0" in start else "a text file"


def _facts(image: Image, start: bytes) -> Facts:
    modes = {"1": "grey", "L": "grey", "LA": "grey and alpha", "P": "palette", "PA": "palette"}
    channels = "grey" if image.mode.startswith("I") else modes.get(image.mode, image.mode)
    name = "JPEG" if image.format == "MPO" else str(image.format)
    deep = start[PNG_DEPTH] == 16 if name == "PNG" else image.mode.startswith("I")
    transparent = "A" in image.mode or "transparency" in image.info
    if name != "JPEG":
        return Facts(name, 16 if deep else 8, channels, transparent=transparent)
    from PIL import JpegImagePlugin

    tables = tuple(tuple(map(int, table)) for _, table in sorted(getattr(image, "quantization", {}).items()))
    sampling = SUBSAMPLINGS.get(JpegImagePlugin.get_sampling(image)) if image.mode != "L" else None
    return Facts(name, 8, channels, tables, sampling)


def _levels(image: Image) -> Levels:
    """The decoded picture, over black where it is transparent."""
    if image.mode.startswith("I"):
        grey = np.asarray(image, np.float32) / np.float32(257)
        return np.repeat(grey[..., None], 3, axis=-1)
    if image.mode == "F":
        raise InputError(f"{image.format}: expected 8 or 16 bit, found floats")
    if not ("A" in image.mode or "transparency" in image.info):
        return np.asarray(image.convert("RGB"), np.float32)
    pixels = np.asarray(image.convert("RGBA"), np.float32)
    return np.asarray(pixels[..., :3] * (pixels[..., 3:] / 255), np.float32)


def _read_floats(path: str | Path) -> Submission:
    """An EXR: linear, levels / 255."""
    import OpenImageIO as oiio

    source: Any = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()
        raise InputError(f"{path}: expected a whole picture, found one that is damaged or breaks off")
    spec = source.spec()
    source.close()
    _check_size(path, spec.width, spec.height)
    levels = np.clip(np.nan_to_num(read_image(path)), 0, 255).astype(np.float32)
    return Submission(levels, Facts("EXR", 32, {1: "grey", 3: "RGB"}.get(spec.nchannels, "RGBA")))
