import math
from collections.abc import Callable

import numpy as np
import pytest
from skimage.metrics import structural_similarity

from reference.image import Picture
from reports.metrics import THRESHOLDS, error_map, measure


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(7)


def grey(height: int, width: int, level: float = 100.0) -> Picture:
    return np.full((height, width, 3), level)


def changed(picture: Picture, column: int, row: int, level: float, channel: int | slice = slice(None)) -> Picture:
    copy = picture.copy()
    copy[row, column, channel] = level
    return copy


def test_equal_pictures(random: np.random.Generator) -> None:
    picture = random.uniform(-20, 300, (16, 24, 3))
    measured = measure(picture, picture.copy())
    assert measured.metrics() == {"ssim": 1, "ssim_min": 1, "psnr": None, "rmse": 0, "flip": 0, "max_error": 0}
    assert measured.over == {"0.5": 0, "1": 0, "8": 0}
    assert measured.total == 16 * 24
    assert "psnr  -" in measured.as_text()


def test_ssim_is_wangs(random: np.random.Generator) -> None:
    a = random.uniform(0, 255, (40, 30, 3))
    b = np.clip(a + random.normal(0, 5, a.shape), 0, 255)
    b[25:31, 12:19] = 0
    mean, local = structural_similarity(
        a / 255,
        b / 255,
        data_range=1.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        channel_axis=-1,
        full=True,
    )
    worst = local.mean(axis=-1)
    row, column = np.unravel_index(worst.argmin(), worst.shape)
    measured = measure(a, b)
    assert measured.ssim == pytest.approx(float(mean), abs=1e-12)
    assert measured.ssim_min == pytest.approx(float(worst.min()), abs=1e-12)
    assert measured.ssim_min_at == (column, row)
    assert 12 <= column <= 18
    assert 25 <= row <= 30


def test_ssim_minimum_is_where_the_picture_is_wrong() -> None:
    a = grey(33, 47)
    measured = measure(a, changed(a, 31, 17, 255))
    assert measured.ssim is not None
    assert measured.ssim_min is not None
    assert measured.ssim_min < measured.ssim < 1
    assert measured.ssim_min_at == (31, 17)


def test_pictures_are_clamped_before_they_are_measured() -> None:
    measured = measure(grey(12, 12, 255), grey(12, 12, 4000))
    assert (measured.max_error, measured.rmse, measured.psnr, measured.ssim, measured.flip) == (0, 0, None, 1, 0)
    assert measure(grey(12, 12, 0), grey(12, 12, -4000)).max_error == 0


def test_errors_by_hand() -> None:
    a = np.array([[[0, 0, 0], [10, 20, 30]], [[255, 255, 255], [100, 100, 100]]], float)
    b = np.array([[[3, 0, 0], [10, 16, 30]], [[255, 255, 255], [100, 100, 112]]], float)
    measured = measure(a, b)
    assert measured.rmse == pytest.approx(math.sqrt((9 + 16 + 144) / 12))
    assert measured.psnr == pytest.approx(20 * math.log10(255 / math.sqrt(169 / 12)))
    assert (measured.max_error, measured.max_error_at) == (12, (1, 1))
    assert (measured.total, measured.over) == (4, {"0.5": 3, "1": 3, "8": 1})
    np.testing.assert_array_equal(error_map(a, b), [[3, 4], [0, 12]])


def test_place_is_column_then_row() -> None:
    a = grey(4, 9)
    measured = measure(a, changed(a, 7, 2, 103, channel=1))
    assert (measured.max_error, measured.max_error_at) == (3, (7, 2))
    assert "column 7, row 2" in measured.as_text()


def test_pixels_are_counted_strictly_over_a_threshold() -> None:
    assert THRESHOLDS == (0.5, 1, 8)
    a = grey(1, 6)
    b = a + np.array([0, 0.5, 0.5009765625, 1, 8, 8.5])[None, :, None]
    assert measure(a, b).over == {"0.5": 4, "1": 2, "8": 1}
    assert measure(a, a - (b - a)).over == {"0.5": 4, "1": 2, "8": 1}


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("channel", [0, 1, 2])
def test_what_is_no_number_counts_as_wrong(wrong: float, channel: int) -> None:
    a = grey(16, 16)
    measured = measure(a, changed(a, 5, 9, wrong, channel))
    assert measured.over == {"0.5": 1, "1": 1, "8": 1}
    assert measured.max_error_at == (5, 9)
    assert measured.max_error >= 100
    assert measured.psnr is not None
    assert all(math.isfinite(value) for value in measured.metrics().values() if value is not None)


@pytest.mark.parametrize("level", [0.0, 100.0, 255.0])
@pytest.mark.parametrize("swap", [False, True])
def test_all_metrics_see_what_is_no_number(level: float, swap: bool) -> None:
    a = grey(16, 16, level)
    b = changed(a, 5, 9, math.nan)
    measured = measure(b, a) if swap else measure(a, b)
    assert measured.max_error == 255
    assert measured.over["8"] == 1
    assert measured.rmse > 0
    assert measured.psnr is not None
    assert measured.ssim_min is not None
    assert measured.ssim_min < 0.9
    assert measured.flip


def test_no_number_in_both_pictures_is_wrong() -> None:
    a = changed(grey(16, 16), 5, 9, math.nan)
    measured = measure(a, a.copy())
    assert measured.over["0.5"] == 1
    assert measured.psnr is not None


@pytest.mark.parametrize(("height", "width"), [(10, 40), (40, 10), (1, 1)])
def test_pictures_smaller_than_the_window_have_no_ssim(height: int, width: int) -> None:
    measured = measure(grey(height, width), grey(height, width, 102))
    assert (measured.ssim, measured.ssim_min, measured.ssim_min_at, measured.flip) == (None, None, None, None)
    assert measured.rmse == pytest.approx(2)
    assert measured.max_error == 2


def test_smallest_picture_with_ssim() -> None:
    assert measure(grey(11, 11), grey(11, 11)).ssim == 1


def test_flip_is_positive_for_different_pictures(random: np.random.Generator) -> None:
    a = random.uniform(0, 255, (20, 20, 3))
    small, large = (measure(a, np.clip(a + step, 0, 255)).flip for step in (2, 60))
    assert small is not None
    assert large is not None
    assert 0 < small < large < 1


@pytest.mark.parametrize("reshape", [lambda a: a[:-1], lambda a: a[:, :-1], lambda a: a[..., :2]])
def test_unequal_shapes_are_refused(reshape: Callable[[Picture], Picture]) -> None:
    with pytest.raises(ValueError, match="unequal shape"):
        measure(grey(12, 12), reshape(grey(12, 12)))


def test_precision_of_the_arrays_does_not_matter(random: np.random.Generator) -> None:
    a = random.integers(0, 255, (16, 16, 3)).astype(np.float32)
    b = random.integers(0, 255, (16, 16, 3)).astype(np.float64)
    assert measure(a, b) == measure(a.astype(np.float64), b)
