"""Whether somebody's picture is right: every pixel within what the pixel may show, but for what its format did to it.

A picture is wrong where a blob of pixels lies outside the envelope, where a whole area is off by a level or more, where
single pixels are wrong by the dozen, or where all of it is displaced.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from reference.errors import InputError
from reference.image import quantise
from reports.envelope import Envelope
from reports.registration import Displacement, displacement
from reports.submission import Facts, Submission

OUTSIDE = 4.0  # levels out of the envelope that count
BLOB = 4  # pixels that may be so, connected
BLOCK = 64  # or so many, where a JPEG is known but for what its encoder rounds otherwise: all of a block
ROUNDING = 1.0  # levels by which any 8-bit picture may differ
SPECKS = 5e-4  # of all pixels that may be outside one by one
MEAN = 1.05  # levels by which the mean of an area may differ beyond truncating and rounding
AREA = 5e-3  # of all pixels, which such an area must have
FLAT = 2.0  # levels: a pixel whose samples differ by no more is no edge
SAME_PIXELS, SAME_BLOCKS = 0.85, 0.5  # of those that tell whether pixels are sampled at their centres
TELLING = 8  # pixels or blocks that must tell it
RIGHT = 5  # of the guesses at a right picture are right
CONNECTED = np.ones((3, 3), bool)
LISTED = 50  # blobs at most

Levels = NDArray[np.float32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Blob:
    """Connected pixels that are outside. Columns and rows count from 0; row 0 is on top."""

    size: int  # pixels
    box: tuple[int, int, int, int]  # first column, first row, last column, last row
    worst: tuple[int, int]  # column, row
    excess: float  # levels out of the envelope, at the worst pixel
    objects: tuple[str, ...]  # seen there by the camera, the most seen first


@dataclass(frozen=True)
class Verdict:
    """What was found. `outside` is how far each channel is out of what the picture may show: H x W x 3, in levels."""

    right: bool
    rounding: bool  # right, but more pixels than a few are a level off
    reasons: tuple[str, ...]  # of blobs, specks, offset, displaced
    blobs: tuple[Blob, ...]  # the largest first, at most 50
    blob_count: int
    outside: Levels
    offset: float  # the mean difference of the area that is off most, in levels; 0 where none is
    offset_area: Mask  # where the mean is off
    displacement: Displacement
    exact: bool  # whether the picture samples pixels at their centres

    @cached_property
    def count(self) -> int:
        """How many pixels are outside by more than counts."""
        return int((worst_channel(self.outside) > OUTSIDE).sum())


def judge(envelope: Envelope, submission: Submission) -> Verdict:
    """Compare a picture with the envelope of its own size. Raises InputError for any other size."""
    found, facts = submission.levels, submission.facts
    if found.shape != envelope.low.shape:
        asked, given = (f"{shape[1]}x{shape[0]}" for shape in (envelope.low.shape, found.shape))
        raise InputError(f"expected a picture of {asked} pixels, found {given}")
    right = quantise(envelope.centre)
    guesses = _guesses(envelope)
    stored = [store(guess, facts) for guess in guesses]
    exact = _is_exact(found, stored, facts)
    low, high = _bounds(envelope, facts, guesses, stored, exact)
    outside = np.maximum(np.maximum(low - found, found - high), 0)
    wrong = worst_channel(outside) > OUTSIDE
    labels, sizes = _label(wrong)
    large = np.flatnonzero(sizes > (BLOCK if facts.lossy and exact else BLOB))
    offset, area = _offset(envelope, found, stored, facts)
    moved = displacement(envelope, found, (stored[2], stored[0]) if facts.lossy else None)
    reasons = {
        "blobs": large.size > 0,
        "specks": int(wrong.sum()) > max(16, SPECKS * wrong.size) * (4 if facts.lossy else 1),
        "offset": bool(area.any()),
        "displaced": moved.significant and not exact,
    }
    named = tuple(name for name, holds in reasons.items() if holds)
    order = large[np.argsort(-sizes[large], kind="stable")]
    blobs = _describe(envelope, outside, labels, [int(n) + 1 for n in order[:LISTED]])
    off = not facts.lossy and np.mean(worst_channel(np.abs(found - right)) >= 0.75) > SPECKS
    return Verdict(
        not named, bool(not named and exact and off), named, blobs, int(large.size), outside, offset, area, moved, exact
    )


def store(levels: Levels, facts: Facts) -> Levels:
    """What a file with these facts makes of a picture (8 bit): a JPEG is written and read again."""
    if not facts.lossy:
        return levels
    from PIL import Image

    pixels = levels.astype(np.uint8)
    grey = facts.channels == "grey"
    image, data = Image.fromarray(pixels[..., 0] if grey else pixels), io.BytesIO()
    tables = [list(table) for table in facts.tables]
    image.save(data, "JPEG", qtables=tables, **({} if grey else {"subsampling": facts.subsampling or "4:4:4"}))
    return np.asarray(Image.open(data).convert("RGB"), np.float32)


def worst_channel(levels: NDArray[Any]) -> NDArray[Any]:
    """The largest of the three channels at each pixel, six times as fast as NumPy's `max` along so short an axis."""
    return np.asarray(np.maximum(np.maximum(levels[..., 0], levels[..., 1]), levels[..., 2]))


def _guesses(envelope: Envelope) -> list[Levels]:
    """Pictures in 8 bit that are right: truncated, rounded, antialiased and two sampled at random places.

    And two that are nearly so: a level too dark, and a level too bright.
    """
    centre, part = envelope.centre, np.random.default_rng(0).random(envelope.centre.shape[:2], np.float32)[..., None]
    random = envelope.low + (envelope.high - envelope.low) * part
    either = np.where(part < 0.5, envelope.low, envelope.high)
    pictures = [centre, np.rint(centre), np.rint(envelope.mean), random, either, centre - 1, centre + 1]
    return [quantise(picture).astype(np.float32) for picture in pictures]


def _is_exact(found: Levels, stored: list[Levels], facts: Facts) -> bool:
    """Whether pixels are sampled at their centres.

    Where an antialiased picture would be different most of it is as it is for samples at the centres; block by block
    for a JPEG.
    """
    side, least = (_block(facts), SAME_BLOCKS) if facts.lossy else (1, SAME_PIXELS)
    telling = _blocks(worst_channel(np.abs(stored[2] - stored[1])), side) > 2 * OUTSIDE
    off = [_blocks(worst_channel(np.abs(found - picture)), side) for picture in stored[:2]]
    same = np.min(off, axis=0) <= 2 * ROUNDING
    number = int(telling.sum())
    return bool(same[telling].sum() >= max(least * number, TELLING) if number >= TELLING else same.all())


def _bounds(
    envelope: Envelope, facts: Facts, guesses: list[Levels], stored: list[Levels], exact: bool
) -> tuple[Levels, Levels]:
    """The least and the most of each channel that the file may hold."""
    if exact:
        about = ROUNDING + (2 if facts.lossy else 0)
        centres = [*stored[:2], *stored[RIGHT:]] if facts.lossy else stored[:1]
        return reduce(np.minimum, centres) - about, reduce(np.maximum, centres) + about
    low, high = envelope.low - ROUNDING, envelope.high + ROUNDING
    if not facts.lossy:
        return low, high
    kept = zip(stored[:RIGHT], guesses[:RIGHT], strict=True)
    error = reduce(np.maximum, [np.abs(after - before) for after, before in kept])
    slack = (1.25 * _over_blocks(error, _block(facts)) + 2).astype(np.float32)
    return low - slack, high + slack


def _block(facts: Facts) -> int:
    """The side of what a JPEG compresses at once, in pixels."""
    return 8 if facts.subsampling in (None, "4:4:4") else 16


def _over_blocks(error: NDArray[Any], side: int) -> NDArray[Any]:
    """The largest of each block and of what borders on it, pixel by pixel."""
    height, width, _ = error.shape
    largest = _blocks(error, side)
    spread = np.repeat(np.repeat(largest, side, axis=0), side, axis=1)[:height, :width]
    return np.asarray(ndimage.maximum_filter(spread, size=(5, 5, 1)))


def _blocks(values: NDArray[Any], side: int) -> NDArray[Any]:
    """The largest of each block."""
    if side == 1:
        return values
    height, width, *channels = values.shape
    padded = np.pad(values, [(0, -height % side), (0, -width % side), *[(0, 0)] * len(channels)])
    rows, columns = padded.shape[0] // side, padded.shape[1] // side
    rows_only = padded.reshape(rows, side, columns * side, *channels).max(axis=1)  # first, which is fast
    return np.asarray(rows_only.reshape(rows, columns, side, *channels).max(axis=2))


def _label(wrong: Mask) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Numbers the connected pixels from 1, and the size of each."""
    labels, count = ndimage.label(wrong, CONNECTED)
    return labels, np.bincount(labels.ravel(), minlength=count + 1)[1:]


def _describe(envelope: Envelope, outside: Levels, labels: NDArray[np.int32], numbers: list[int]) -> tuple[Blob, ...]:
    excess, places, blobs = worst_channel(outside), ndimage.find_objects(labels), []
    for number in numbers:
        rows, columns = places[number - 1]
        inside = labels[rows, columns] == number
        row, column = np.unravel_index(np.where(inside, excess[rows, columns], -1).argmax(), inside.shape)
        worst = (columns.start + int(column), rows.start + int(row))
        seen = np.bincount(envelope.objects[rows, columns][inside])
        objects = tuple(envelope.names[place] for place in np.argsort(-seen, kind="stable") if seen[place])
        box = (columns.start, rows.start, columns.stop - 1, rows.stop - 1)
        blobs.append(Blob(int(inside.sum()), box, worst, float(excess[worst[1], worst[0]]), objects))
    return tuple(blobs)


def _offset(envelope: Envelope, found: Levels, stored: list[Levels], facts: Facts) -> tuple[float, Mask]:
    """The mean difference of smooth areas, tile by tile: the largest, and the tiles where it is too large.

    A right picture is between the right one truncated and the right one rounded, as its file keeps them; what the mean
    of a tile of any of these is, the mean of the picture may be too.
    """
    height, width, _ = found.shape
    side = max(16, min(height, width) // 16)
    edges = worst_channel(envelope.high - envelope.low)[..., None] > FLAT
    if facts.lossy:  # an edge disturbs its whole block
        edges = _over_blocks(np.repeat(edges, 3, axis=-1), _block(facts))
    smooth = ~edges.any(axis=-1)
    brightest = worst_channel(envelope.centre)
    smooth &= (brightest < 254) & (brightest > 1)
    count = _sums(smooth[..., None].astype(np.float32), side)
    enough = count[..., 0] >= side * side // 3
    if not enough.any():
        return 0.0, np.zeros((height, width), bool)
    means = [
        _sums((picture - envelope.centre) * smooth[..., None], side) / np.maximum(count, 1)
        for picture in stored[:RIGHT]
    ]
    mean = _sums((found - envelope.centre) * smooth[..., None], side) / np.maximum(count, 1)
    steps = [table[0] for table in facts.tables[:1] + facts.tables[-1:]]  # of a block's mean, times 8
    most = MEAN + sum(steps) / 16 + (0.5 if facts.lossy else 0)
    over = np.maximum(np.min(means, axis=0) - most - mean, mean - np.max(means, axis=0) - most)
    over = np.where(enough[..., None], over, -1).max(axis=-1)
    tiles = over > 0
    area = np.repeat(np.repeat(tiles, side, axis=0), side, axis=1)[:height, :width] & smooth
    if area.sum() < max(500, AREA * area.size):
        return 0.0, np.zeros_like(area)
    worst = mean.reshape(-1, 3)[over.argmax()]
    return float(worst[np.abs(worst).argmax()]), area


def _sums(values: Levels, side: int) -> NDArray[np.float32]:
    height, width, channels = values.shape
    padded = np.pad(values, ((0, -height % side), (0, -width % side), (0, 0)))
    rows, columns = padded.shape[0] // side, padded.shape[1] // side
    rows_only = padded.reshape(rows, side, columns * side, channels).sum(axis=1)
    return np.asarray(rows_only.reshape(rows, columns, side, channels).sum(axis=2))
