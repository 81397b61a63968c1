"""Two pictures become numbers. Levels are 0..255, linear, clamped; metrics that want 0..1 get levels / 255."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.floating[Any]]
Place = tuple[int, int]  # column, row

TOLERANCE = 0.5  # levels, in every channel: what agrees
THRESHOLDS = (0.5, 1, 8)  # levels
SSIM_WINDOW = 11  # pixels: Gaussian weights of sigma 1.5, cut at 3.5 sigma

SETTINGS = {
    "ssim": "Wang et al. 2004: Gaussian weights, sigma 1.5, population covariance, data range 1, mean over RGB. "
    "Its mean hides single wrong pixels, and harmless resampling lowers it more than a missing highlight does.",
    "ssim_min": "The smallest value of the SSIM map, averaged over RGB: the worst 11 x 11 neighbourhood. "
    "It names a place, not a size: a faint edge in a dark corner can lower it more than a wrong light elsewhere.",
    "psnr": "20 log10(255 / RMSE), in decibels; empty where the pictures are equal. "
    "One number for the whole picture: ten wrong pixels of a million leave it high.",
    "rmse": "Root mean square error over all pixels and channels, in levels. Blind to where the error is, "
    "and to whether many pixels are a little wrong or a few very much.",
    "flip": "Mean LDR-FLIP at 67 pixels per degree, levels / 255 taken as sRGB. Its mean hides small bugs; its map "
    "shows what an eye would see at that distance, not what is wrong.",
    "max_error": "The largest error of any channel of any pixel, in levels. It tells neither how many "
    "pixels are wrong nor whether anybody is at fault: a knife edge can have a large one.",
}


@dataclass(frozen=True)
class Measurement:
    """All numbers about one pair of pictures. A metric is None where it is not defined (see SETTINGS)."""

    ssim: float | None
    ssim_min: float | None
    ssim_min_at: Place | None
    psnr: float | None
    rmse: float
    flip: float | None
    max_error: float
    max_error_at: Place
    total: int
    over: dict[str, int]  # pixels whose error exceeds that many levels
    maps: dict[str, NDArray[np.float64]] = field(
        default_factory=dict, compare=False
    )  # by metric: 1 - SSIM (0..2), FLIP (0..1)

    def metrics(self) -> dict[str, float | None]:
        """The six numbers by the names of the report."""
        return {name: getattr(self, name) for name in SETTINGS}

    def as_text(self) -> str:
        """One line a number, for a terminal."""
        rows = [f"{name:>10}  {'-' if value is None else f'{value:.6g}'}" for name, value in self.metrics().items()]
        column, row = self.max_error_at
        rows.append(f"{'worst at':>10}  column {column}, row {row}")
        rows += [f"{'over ' + level:>10}  {count} of {self.total} pixels" for level, count in self.over.items()]
        return "\n".join(rows)


def error_map(reference: Picture, picture: Picture) -> NDArray[np.float64]:
    """The largest channel's error of each pixel, in levels of the clamped pictures; not a number counts as 255."""
    difference = np.abs(np.clip(reference, 0, 255).astype(np.float64) - np.clip(picture, 0, 255)).max(axis=-1)
    return np.asarray(np.nan_to_num(difference, nan=255.0))


def measure(reference: Picture, picture: Picture) -> Measurement:
    """Compare `picture` with `reference`, both height x width x 3 in levels. Raises ValueError for unequal shapes."""
    if reference.shape != picture.shape:
        raise ValueError(f"pictures of unequal shape: {reference.shape} and {picture.shape}")
    a, b = (np.clip(levels, 0, 255).astype(np.float64) / 255 for levels in (reference, picture))
    unknown = np.isnan(a) | np.isnan(b)
    a, b = np.where(unknown, 0, a), np.where(unknown, 1, b)  # what is not a number is as wrong as can be
    error = error_map(reference, picture)
    rmse = float(np.sqrt(np.mean(np.square(a - b)))) * 255
    ssim, similarity = _ssim(a, b)
    flip, flip_map = _flip(a, b)
    found = {"ssim": None if similarity is None else 1 - similarity, "flip": flip_map}
    return Measurement(
        ssim=ssim,
        ssim_min=None if similarity is None else float(similarity.min()),
        ssim_min_at=None if similarity is None else _place(similarity, int(similarity.argmin())),
        psnr=20 * math.log10(255 / rmse) if rmse else None,
        rmse=rmse,
        flip=flip,
        max_error=float(error.max()),
        max_error_at=_place(error, int(error.argmax())),
        total=error.size,
        over={f"{level:g}": int(np.count_nonzero(error > level)) for level in THRESHOLDS},
        maps={name: values for name, values in found.items() if values is not None},
    )


def _ssim(a: Picture, b: Picture) -> tuple[float | None, NDArray[np.float64] | None]:
    """The mean, and the map averaged over RGB."""
    if min(a.shape[:2]) < SSIM_WINDOW:
        return None, None
    from skimage.metrics import structural_similarity

    mean, full = structural_similarity(
        a,
        b,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        data_range=1.0,
        channel_axis=-1,
        full=True,
    )
    return float(mean), full.mean(axis=-1)


def _flip(a: Picture, b: Picture) -> tuple[float | None, NDArray[np.float64] | None]:
    """The mean, and the map."""
    import flip_evaluator

    if min(a.shape[:2]) < SSIM_WINDOW:
        return None, None
    pictures = [np.ascontiguousarray(picture, np.float32) for picture in (a, b)]
    local, mean, _ = flip_evaluator.evaluate(*pictures, "LDR", applyMagma=False)
    return float(mean), local[..., 0].astype(np.float64)


def _place(array: NDArray[np.float64], index: int) -> Place:
    row, column = np.unravel_index(index, array.shape)
    return int(column), int(row)
