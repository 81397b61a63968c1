"""Certified pictures: sound, complete, and what the command line says of them."""

from __future__ import annotations

import json
import random
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import transcription
from flint import arb, ctx, fmpq
from helpers import EXAMPLE, ROOT, crossray
from random_scenes import random_scene

from reference import balls, certification, sweep, tables
from reference.balls import Arrow, Ball
from reference.certification import CERTAIN, KNIFE_EDGE, UNDECIDED, certify
from reference.device import array_types
from reference.errors import InputError
from reference.image import read_image
from reference.model import EXACT
from reference.proof import PROVEN, Admissible, Prover
from reference.scene import Plane, Scene, Sphere, Triple, exact
from reference.text import dump
from reference.tracer import render
from reports.certificate import as_data, as_text

EXAMPLES = [Scene.load(path) for path in sorted((ROOT / "scenes").glob("example?.txt"))]
DIAGNOSTIC = sorted((ROOT / "scenes" / "diagnostic").glob("*.txt"))
WALL = Plane((200, 40, 20), (0, 0, 600), (0, 0, -1), 0.5, 0)
# The edge with the wall runs through row 8 of 12, the horizon of the other floor through row 0 of 3.
CORNER = Scene((128, 128, 128), 1, (), (WALL, Plane((10, 90, 240), (0, -125, 0), (0, 1, 0), 0.5, 0)))
HORIZON = Scene((128, 128, 128), 1, (), (Plane((10, 90, 240), (0, -100, 0), (0, 3, -1), 0.5, 0.5),))
PARALLEL = replace(HORIZON, planes=(*HORIZON.planes, Plane((200, 40, 20), (0, 300, 0), (0, 3, -1), 0, 0)))
# The ray of column 6, row 4 of 12 x 12 touches the first ball; that from where it meets the wall, the second.
TANGENT = Scene((128, 128, 128), 1, (Sphere((30, 180, 60), (0.5, -6.5, 306), 46, 0.5, 0),), (WALL,))
SHADOW = Scene((128, 128, 128), 1, (Sphere((30, 180, 60), (195, 265, 550), 30, 0.5, 0),), (WALL,))
# A ball that the light lies on, with the eye and all that is seen inside; and a plane where the screen is.
BALL = Sphere((250, 200, 0), (20, -30, 300), 60, 1, 0.25)
DOME = Scene((128, 128, 128), 1, (Sphere((30, 180, 60), (200, -100, -100), 900, 0.5, 0), BALL))
SCREEN = Scene((128, 128, 128), 1, (BALL,), (WALL, Plane((9, 9, 9), (3, 4, 100), (0, 0, 7), 1, 1)))
MIRRORS = Scene.load(ROOT / "scenes" / "diagnostic" / "facing_mirrors.txt")

OPEN = 1e300  # a radius that says nothing
CHUNK = 25

pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")


@pytest.fixture
def looped(monkeypatch: pytest.MonkeyPatch) -> None:
    """One kernel for scenes of any size."""
    monkeypatch.setattr(tables, "UNROLLED", 0)


@cache
def proofs(scene: Scene, width: int, height: int) -> dict[tuple[int, int], Admissible]:
    prover = Prover(scene, width=width, height=height)
    return {(column, row): prover.admissible(column, row) for row in range(height) for column in range(width)}


def outside(scene: Scene, width: int, height: int) -> tuple[int, int]:
    """How many pixels may be farther from the sweep's colour than its radius, and how many it leaves open."""
    picture, radius = sweep.sweep(scene, width=width, height=height, depth=3)
    wrong = 0
    for (column, row), found in proofs(scene, width, height).items():
        if radius[row, column] < OPEN:
            off = [np.abs(picture[row, column] - c.value) - c.radius for c in found.colours]
            wrong += not (found.complete and np.max(off) <= radius[row, column])
    return wrong, int((radius > PROVEN).sum())


# Whether the sweep is sound


@pytest.mark.parametrize("scene", EXAMPLES, ids=lambda scene: f"example{EXAMPLES.index(scene) + 1}")
def test_the_sweep_of_examples_is_sound(scene: Scene) -> None:
    wrong, left = outside(scene, 40, 40)
    assert wrong == 0
    assert left <= 0.05 * 40 * 40


@pytest.mark.parametrize("seed", range(6))
def test_the_sweep_of_random_scenes_is_sound(seed: int, looped: None) -> None:
    wrong, left = outside(random_scene(seed), 30, 30)
    assert wrong == 0
    assert left <= 0.05 * 30 * 30


@pytest.mark.parametrize(
    ("scene", "size", "edges"),
    [(CORNER, 12, 12), (HORIZON, 3, 3), (TANGENT, 12, 1), (SHADOW, 12, 1), (DOME, 12, 0), (SCREEN, 12, 0)],
)
def test_the_sweep_leaves_knife_edges_open_and_nothing_else(scene: Scene, size: int, edges: int, looped: None) -> None:
    assert outside(scene, size, size) == (0, edges)


@pytest.mark.parametrize("path", DIAGNOSTIC, ids=lambda path: path.stem)
def test_the_sweep_of_diagnostic_scenes_is_sound(path: Path, looped: None) -> None:
    wrong, left = outside(Scene.load(path), 24, 24)
    assert wrong == 0
    assert left <= 0.05 * 24 * 24


def without_radius(method: Any) -> Any:
    def changed(*words: Any) -> Any:
        result = method(*words)
        result.radius = result.radius * 0
        return result

    return changed


SABOTAGE: dict[str, list[tuple[object, str, Any]]] = {
    "no rounding": [(module, "UNIT", 0.0) for module in (balls, sweep)],
    "too little rounding": [(module, "UNIT", 2.0**-59) for module in (balls, sweep)],
    "dot": [(Arrow, "dot", without_radius(Arrow.dot))],
    "square": [(Arrow, "square", without_radius(Arrow.square))],
    "quotient": [(Ball, "__truediv__", without_radius(Ball.__truediv__))],
    "root": [(Ball, "root", without_radius(Ball.root))],
    "sure to be more": [(Ball, "beyond", lambda ball, least: ball.value > least)],
    "sure to be less": [(Ball, "below", lambda ball, most: ball.value < most)],
}


@pytest.mark.parametrize("name", SABOTAGE)
def test_an_unsound_sweep_is_noticed(name: str, looped: None, monkeypatch: pytest.MonkeyPatch) -> None:
    for place, attribute, value in SABOTAGE[name]:
        monkeypatch.setattr(place, attribute, value)
    tried = [(random_scene(4), 30), (random_scene(5), 30), (HORIZON, 3), (TANGENT, 12)]
    assert sum(outside(scene, size, size)[0] for scene, size in tried) > 0


def test_what_is_open_has_an_infinite_radius() -> None:
    _, radius = sweep.sweep(CORNER, width=12, height=12, depth=3)
    assert np.isinf(radius).sum() == 12


def decimals(pick: random.Random, low: float, high: float) -> Triple:
    x, y, z = (round(pick.uniform(low, high), 1) for _ in range(3))
    return (x, y, z)


def norm(vector: Iterable[Fraction]) -> float:
    return sqrt(sum(value * value for value in vector))


def off_by(number: float, true: Fraction | arb) -> float:
    return float(abs(Fraction(number) - true)) if isinstance(true, Fraction) else float(abs(arb(number) - true).upper())


def geometry(scene: Scene) -> list[list[float]]:
    rows: list[list[float]] = sweep.BallWorld(scene, array_types()).numbers.numpy().reshape(-1, sweep.WIDTH).tolist()
    return rows


def some_spheres() -> tuple[Sphere, ...]:
    pick = random.Random(8)
    return tuple(Sphere((1, 1, 1), decimals(pick, -300, 300), round(pick.uniform(1, 300), 2), 1, 1) for _ in range(300))


def test_numbers_of_spheres_are_off_by_half_of_what_is_allowed_for() -> None:
    scene = Scene((1, 1, 1), 1, some_spheres())
    for sphere, row in zip(scene.spheres, geometry(scene), strict=True):
        centre, radius = list(map(exact, sphere.centre)), exact(sphere.radius)
        assert norm(Fraction(a) - b for a, b in zip(row[:3], centre, strict=True)) <= row[3] / 2
        assert off_by(row[5], radius) <= row[5] * balls.UNIT
        assert off_by(row[6], sum((a * a for a in centre), -radius * radius)) <= row[7] / 2


def test_squared_radii_are_off_by_half_of_what_is_allowed_for() -> None:
    scene = Scene((1, 1, 1), 1, some_spheres())
    for sphere, row in zip(scene.spheres, geometry(scene), strict=True):
        assert off_by(row[4], exact(sphere.radius) ** 2) <= row[4] * balls.UNIT / 2


def test_numbers_of_planes_are_off_by_half_of_what_is_allowed_for(monkeypatch: pytest.MonkeyPatch) -> None:
    pick = random.Random(9)
    planes = [Plane((1, 1, 1), decimals(pick, -300, 300), decimals(pick, -3, 3), 1, 1) for _ in range(300)]
    scene = Scene((1, 1, 1), 1, (), tuple(planes))
    rows = geometry(scene)
    monkeypatch.setattr(ctx, "prec", 300)
    for plane, row in zip(planes, rows, strict=True):
        normal, point = list(map(exact, plane.normal)), list(map(exact, plane.point))
        length = rational(sum((n * n for n in normal), Fraction())).sqrt()
        errors = [off_by(value, rational(n) / length) for value, n in zip(row[:3], normal, strict=True)]
        assert sum(error**2 for error in errors) ** 0.5 <= row[3] / 2
        for place, origin in ((4, 0), (6, 500)):
            distance = sum((n * (a - origin) for n, a in zip(normal, point, strict=True)), Fraction())
            assert off_by(row[place], rational(distance) / length) <= row[place + 1] / 2


def rational(value: Fraction) -> arb:
    return arb(fmpq(value.numerator, value.denominator))


WEDGES = [
    Plane((100, 50, 20), (0, 0, -20), (0.05, 0, 1), 0.5, 1e-29),
    Plane((20, 50, 100), (1000, 0, -20), (-0.05, 0, 1), 0.5, 1e29),
    Plane((50, 100, 50), (0, 0, 110), (0, 0, 1), 0.5, 1),
]


def test_weights_that_underflow_on_the_way() -> None:
    """Dozens of bounces at 1e-29, then as many at 1e29: what is seen after them counts."""
    scene = Scene((255, 255, 255), 0.5, (), tuple(WEDGES))
    found = Prover(scene, width=16, height=16, depth=60).admissible(0, 8)
    assert found.proven
    assert found.colours[0].value[0] > 1e117
    picture, radius = sweep.sweep(scene, width=16, height=16, depth=60)
    assert radius[8, 0] > OPEN or picture[8, 0] == pytest.approx(found.colours[0].value)


def test_the_loop_certifies_what_straight_code_does(monkeypatch: pytest.MonkeyPatch) -> None:
    results = []
    for unrolled, band in ((1000, 1 << 22), (0, 1 << 22), (0, 500)):
        monkeypatch.setattr(tables, "UNROLLED", unrolled)
        monkeypatch.setattr(sweep, "BAND", band)
        results.append(sweep.sweep(EXAMPLES[2], width=70, height=50, depth=3))
    (picture, radius), (other, other_radius), (banded, banded_radius) = results
    assert np.array_equal(other, banded)
    assert np.array_equal(other_radius, banded_radius)
    assert np.array_equal(radius < OPEN, other_radius < OPEN)
    assert np.all(np.abs(picture - other).max(axis=-1) <= radius)


# Certificates


def check_kinds(scene: Scene, width: int, height: int, depth: int = 3) -> certification.Certificate:
    """Certify, and check what holds for every certificate."""
    certificate = certify(scene, width=width, height=height, depth=depth)
    assert certificate.picture.shape == (height, width, 3)
    assert certificate.picture.dtype == np.float64
    assert certificate.mask.shape == (height, width)
    assert sum(map(certificate.count, (CERTAIN, KNIFE_EDGE, UNDECIDED))) == width * height
    open_ = {(column, row) for row, column in np.argwhere(certificate.mask != CERTAIN).tolist()}
    assert set(certificate.edges) == open_
    for (column, row), found in certificate.edges.items():
        assert not found.proven
        assert found.complete == (certificate.mask[row, column] == KNIFE_EDGE)
        assert np.array_equal(certificate.picture[row, column], found.colours[0].value)
    return certificate


def test_knife_edges_have_the_colour_by_the_rule_for_ties() -> None:
    certificate = check_kinds(CORNER, 12, 12)
    assert list(certificate.edges) == [(column, 8) for column in range(12)]
    for (column, _), found in certificate.edges.items():
        x = 6 * (-50 + (column + 0.5) * 100 / 12)
        cosine = 100 / np.sqrt((500 - x) ** 2 + 625**2 + 100**2)
        assert certificate.picture[8, column] == pytest.approx(np.array(WALL.colour) * (0.5 + 0.5 * cosine))
        assert len(found.colours) == 4
    assert (certificate.picture[:8] != certificate.picture[9]).any()


@pytest.mark.parametrize("scene", [TANGENT, SHADOW], ids=["of the camera", "of a shadow ray"])
def test_tangents_are_knife_edges(scene: Scene) -> None:
    certificate = check_kinds(scene, 12, 12)
    assert list(certificate.edges) == [(6, 4)]
    assert len(certificate.edges[6, 4].colours) == 2


def test_undecided_pixels_are_counted() -> None:
    certificate = check_kinds(PARALLEL, 3, 3)
    assert [certificate.count(kind) for kind in (CERTAIN, KNIFE_EDGE, UNDECIDED)] == [6, 0, 3]
    assert not certificate.mask[0].any()


@pytest.mark.parametrize("size", [(1, 8), (2, 2), (9, 4), (4, 41), (64, 48)])
def test_any_resolution(size: tuple[int, int], looped: None) -> None:
    certificate = check_kinds(EXAMPLES[0], *size)
    expected = transcription.picture(dump(EXAMPLES[0]), *size, 3, "exact")
    proven = certificate.mask == CERTAIN
    assert proven.mean() > 0.7
    assert np.abs(certificate.picture - expected)[proven].max() < 1e-6


@pytest.mark.parametrize("scene", EXAMPLES, ids=lambda scene: f"example{EXAMPLES.index(scene) + 1}")
def test_the_middle_row_and_column_are_decided(scene: Scene, looped: None) -> None:
    """There camera rays are along floors and walls, exactly; along both, mirrored ones may go anywhere."""
    assert check_kinds(scene, 15, 15).count(UNDECIDED) <= 1


@pytest.mark.parametrize("depth", [0, 1, 20, 100])
def test_any_depth(depth: int, looped: None) -> None:
    certificate = check_kinds(MIRRORS, 16, 16, depth)
    assert certificate.count(CERTAIN) == 256
    expected = transcription.picture(dump(MIRRORS), 16, 16, depth, "exact")
    assert np.abs(certificate.picture - expected).max() < 1e-6


def test_nothing_to_see() -> None:
    certificate = check_kinds(Scene((255, 255, 255), 1), 6, 4)
    assert certificate.count(CERTAIN) == 24
    assert not certificate.picture.any()


HUGE = Sphere((10, 200, 100), (0, 0, 3e31), 2e31, 1, 0.5)
EXTREME = {
    "far and large": Scene((255, 255, 255), 0.5, (HUGE, BALL)),
    "farther than doubles reach": Scene(
        (255, 255, 255), 0.5, (), (Plane((9, 8, 7), (0, -1e308, 0), (0, 1e-300, 1), 1, 0),)
    ),
    "bright": Scene((255, 255, 255), 0.5, (replace(BALL, colour=(1e31, 1, 0)),), (WALL,)),
    "dim": Scene((255, 255, 255), 1e-31, (replace(BALL, diffuse=1e-40, reflection=1e-50),), (WALL,)),
    "near and small": Scene((255, 255, 255), 0.5, (Sphere((9, 8, 7), (0, 0, 1e-31), 1e-32, 1, 1), BALL), (WALL,)),
    "the smallest number": Scene((255, 255, 255), 0.5, (replace(BALL, centre=(5e-324, 0, 300)),), (WALL,)),
}


@pytest.mark.parametrize("name", EXTREME)
def test_extreme_numbers_are_proven_one_by_one(name: str) -> None:
    scene = EXTREME[name]
    _, radius = sweep.sweep(scene, width=8, height=8, depth=3)
    assert np.isinf(radius).all()
    certificate = check_kinds(scene, 8, 8)
    assert certificate.count(CERTAIN) == 64
    if name == "farther than doubles reach":  # n is (0, 0, 1) there, and the plane holds the eye but for 1e8
        return
    expected = transcription.picture(dump(scene), 8, 8, 3, "exact")
    assert certificate.picture == pytest.approx(expected, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("options", [{"width": 0}, {"height": 1 << 20}, {"depth": -1}, {"depth": 1 << 30}])
def test_requests_out_of_range(options: dict[str, int]) -> None:
    with pytest.raises(InputError, match="expected"):
        certify(CORNER, **options)  # type: ignore[arg-type]


def test_what_is_too_much_work_stays_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = check_kinds(EXTREME["far and large"], 8, 8)
    monkeypatch.setattr(certification, "WORK", 10 * 2 * 4 + 1)  # two surfaces, four rays
    certificate = certify(EXTREME["far and large"], width=8, height=8)
    assert [certificate.count(kind) for kind in (CERTAIN, KNIFE_EDGE, UNDECIDED)] == [10, 0, 54]
    assert np.array_equal(certificate.mask == CERTAIN, np.arange(64).reshape(8, 8) < 10)
    assert np.array_equal(certificate.picture.reshape(-1, 3)[:10], whole.picture.reshape(-1, 3)[:10])
    assert np.isfinite(certificate.picture).all()
    assert not certificate.edges
    assert list(as_text(certificate)) == ["64 pixels: 10 proven to 1e-06 level, 0 knife edges, 54 undecided"]


def test_progress_is_told_in_at_most_a_hundred_steps() -> None:
    told: list[str] = []
    certify(EXTREME["far and large"], width=19, height=17, progress=told.append)
    assert 50 < len(told) <= 100
    assert told[0] == "proving pixel 0 of 323"


def drawn_otherwise(scene: Scene, side: int) -> tuple[float, int, list[str]]:
    """The largest error of a proven pixel, how many are undecided, and pixels drawn in no colour they may have."""
    certificate = check_kinds(scene, side, side)
    drawn = np.clip(render(scene, EXACT, width=side, height=side, dtype=float), 0, 255)
    error = np.abs(drawn - np.clip(certificate.picture, 0, 255)).max(axis=-1)
    wrong = []
    for row, column in np.argwhere(~(error <= 0.5)).tolist():
        found = certificate.edges.get((column, row))
        colours = [np.clip(colour.value, 0, 255) for colour in found.colours] if found else []
        if not any(np.abs(drawn[row, column] - colour).max() <= 0.5 for colour in colours):
            colour = certificate.picture[row, column]
            wrong.append(f"column {column}, row {row}: {drawn[row, column]} is not {colour} or what {found} says")
    return error[certificate.mask == CERTAIN].max(initial=0), certificate.count(UNDECIDED), wrong


@pytest.mark.parametrize("first", range(0, 200, CHUNK))
def test_random_scenes_are_drawn_as_certified(first: int, looped: None) -> None:
    found = {seed: drawn_otherwise(random_scene(seed), 48) for seed in range(first, first + CHUNK)}
    largest, seed = max((error, seed) for seed, (error, _, _) in found.items())
    print(f"random scenes {first} to {first + CHUNK - 1}: at most {largest:.2g} level off, in scene {seed}")
    assert not {seed: (undecided, wrong) for seed, (_, undecided, wrong) in found.items() if undecided or wrong}


def scene_of_ties(seed: int) -> Scene:
    """Planes and spheres on a grid, so that many rays meet two at once or touch one."""
    pick = random.Random(seed)

    def place(*depths: float) -> Triple:
        return (pick.choice((-100.0, -50.0, 50.0, 100.0)), pick.choice((-100.0, -50.0, 50.0)), pick.choice(depths))

    def look() -> tuple[float, float]:
        return pick.choice((0.0, 0.5, 1.0)), pick.choice((0.0, 0.5))

    def colour() -> Triple:
        return (float(pick.randrange(256)), float(pick.randrange(256)), float(pick.randrange(256)))

    normals = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, -1.0), (1.0, 0.0, 1.0), (0.0, 2.0, 1.0))
    planes = [Plane(colour(), place(100, 200, 400), pick.choice(normals), *look()) for _ in range(pick.randint(1, 4))]
    balls = [
        Sphere(colour(), place(0, 100, 300, 400), pick.choice((30.0, 50.0, 100.0, 200.0)), *look())
        for _ in range(pick.randint(0, 3))
    ]
    return Scene((128, 128, 128), 1, tuple(balls), tuple(planes))


def test_ties_are_drawn_as_certified(looped: None) -> None:
    found = {(seed, side): drawn_otherwise(scene_of_ties(seed), side)[2] for seed in range(30) for side in (8, 9, 10)}
    assert not {key: wrong for key, wrong in found.items() if wrong}


# What is said of certificates


def test_text_lists_the_first_pixels_and_colours() -> None:
    count, *pixels, more = as_text(certify(CORNER, width=12, height=12))
    assert count == "144 pixels: 132 proven to 1e-06 level, 12 knife edges, 0 undecided"
    assert (len(pixels), more) == (10, "and 2 more")
    assert pixels[0].startswith("column 0, row 8: (")
    assert pixels[0].count(") or (") == 3
    undecided = list(as_text(certify(PARALLEL, width=3, height=3)))
    assert undecided[0] == "9 pixels: 6 proven to 1e-06 level, 0 knife edges, 3 undecided"
    assert undecided[2].startswith("column 1, row 0: (0, 0, 0) or ")
    assert undecided[2].endswith(" or colours that could not be found")
    assert len(list(as_text(certify(EXAMPLES[2], width=8, height=8)))) == 1


def test_data_of_colours_beyond_any_number() -> None:
    certificate = certify(replace(HORIZON, ambient=(1e308, 1, 1), ambient_coefficient=1e300), width=3, height=3)
    assert json.dumps(as_data(certificate), allow_nan=False)


def test_data_is_whole() -> None:
    data = as_data(certify(PARALLEL, width=3, height=3))
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert list(data) == ["width", "height", "pixels", "edges"]
    assert (data["width"], data["height"]) == (3, 3)
    assert data["pixels"] == {"proven": 6, "knife-edge": 0, "undecided": 3}
    assert [list(edge) for edge in data["edges"]] == [["column", "row", "complete", "colours"]] * 3
    assert [(edge["column"], edge["row"], edge["complete"]) for edge in data["edges"]] == [
        (i, 0, False) for i in range(3)
    ]
    assert data["edges"][0]["colours"][0] == [0, 0, 0]


@pytest.fixture
def corner(tmp_path: Path) -> Path:
    path = tmp_path / "corner.txt"
    path.write_text(dump(CORNER), encoding="utf-8")
    return path


def test_the_command_writes_picture_and_mask(corner: Path, tmp_path: Path) -> None:
    words = ("--size", "5x12", "-o", "truth.exr", "--mask", "mask.png", "--depth", "2")
    result = crossray("certify", "corner.txt", *words, cwd=tmp_path)
    certificate = certify(CORNER, width=5, height=12, depth=2)
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines() == list(as_text(certificate))
    assert result.stdout.startswith("60 pixels: 55 proven to 1e-06 level, 5 knife edges, 0 undecided\n")
    assert result.stderr.startswith("certified in ")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["corner.txt", "mask.png", "truth.exr"]
    truth, mask = read_image(tmp_path / "truth.exr"), read_image(tmp_path / "mask.png")
    drawn = render(CORNER, EXACT, width=5, height=12, dtype=float)
    assert np.abs(truth - certificate.picture).max() < 1e-3
    assert np.abs(truth - drawn)[certificate.mask == CERTAIN].max() < 1e-3
    assert np.array_equal(mask, certificate.mask[..., None].repeat(3, axis=-1))


def test_the_command_gives_data_of_standard_input() -> None:
    result = crossray("certify", "-", "--size", "5x12", "--json", "--quiet", stdin=dump(CORNER))
    assert (result.returncode, result.stderr) == (0, "")
    expected = as_data(certify(CORNER, width=5, height=12))
    assert json.loads(result.stdout) == {"version": 1, "scene": "-", **expected}
    assert expected["pixels"] == {"proven": 55, "knife-edge": 5, "undecided": 0}


BAD_INPUT: dict[str, tuple[tuple[str | Path, ...], str]] = {
    "no such scene": (("missing.txt", "--mask", "mask.png"), "missing.txt:1:1: expected a readable scene file"),
    "a wrong scene": (("-", "-o", "a.exr"), "<stdin>:2:1: expected a number in the ambient coefficient"),
    "a wrong size": ((EXAMPLE, "--size", "8x0"), "size"),
    "a wrong depth": ((EXAMPLE, "--depth", "-1"), "depth"),
    "a wrong picture": ((EXAMPLE, "-o", "truth.txt", "--mask", "mask.png"), "truth.txt: expected a picture name"),
    "a wrong mask": ((EXAMPLE, "-o", "truth.exr", "--mask", "mask"), "mask: expected a picture name"),
}


@pytest.mark.parametrize("name", BAD_INPUT)
def test_the_command_refuses_bad_input(name: str, tmp_path: Path) -> None:
    words, message = BAD_INPUT[name]
    result = crossray("certify", *words, cwd=tmp_path, stdin="1 2 3\nx\n")
    assert (result.returncode, result.stdout) == (2, ""), result.stderr
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert not list(tmp_path.iterdir())


def test_the_command_leaves_nothing_behind_where_it_cannot_write(corner: Path, tmp_path: Path) -> None:
    result = crossray("certify", corner, "--size", "4x4", "-o", "no/truth.exr", "--mask", "mask.png", cwd=tmp_path)
    assert (result.returncode, result.stdout) == (3, "")
    assert "no/truth.exr: cannot be written: no such file or directory" in result.stderr
    assert list(tmp_path.iterdir()) == [corner]
