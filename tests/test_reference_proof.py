"""Single pixels by Arb: against the transcription, and knife edges whose colours are computed by hand here."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction
from math import hypot
from pathlib import Path

import numpy as np
import pytest
import transcription
from helpers import ROOT
from random_scenes import random_scene

from reference import enclosure
from reference.proof import LARGEST_SET, PRECISIONS, PROVEN, Admissible, Prover
from reference.rules import DOCUMENT_RULES, EXACT_RULES, Rules
from reference.scene import Plane, Scene, Sphere, Triple
from reference.text import dump, parse

SCENES = sorted((ROOT / "scenes").rglob("*.txt"))
SIDE, PIXELS = 120, 50
GREY, HALF = (128.0, 128.0, 128.0), 0.5  # ambient light: half of a surface's colour, whatever else it gets
RED, GREEN, BLUE = (200.0, 40.0, 20.0), (30.0, 180.0, 60.0), (10.0, 90.0, 240.0)
BLACK = (0.0, 0.0, 0.0)

pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")


def scene(*surfaces: Sphere | Plane) -> Scene:
    spheres = tuple(surface for surface in surfaces if isinstance(surface, Sphere))
    return Scene(GREY, 1, spheres, tuple(surface for surface in surfaces if isinstance(surface, Plane)))


def prove(scene: Scene, column: int = 0, row: int = 0, width: int = 1, height: int = 1, depth: int = 3) -> Admissible:
    return Prover(scene, width=width, height=height, depth=depth).admissible(column, row)


def shaded(colour: Triple, light: float, share: float = 1) -> Triple:
    """`share` of a colour in ambient light and in diffuse light of that strength."""
    red, green, blue = (share * value * (HALF + light) for value in colour)
    return (red, green, blue)


def plus(one: Triple, other: Triple) -> Triple:
    red, green, blue = (a + b for a, b in zip(one, other, strict=True))
    return (red, green, blue)


def is_set(found: Admissible, *expected: Triple) -> bool:
    """Whether these are all colours, the first of them first."""
    values = [colour.value for colour in found.colours]
    assert found.complete, found
    assert np.allclose(values[0], expected[0], rtol=0, atol=1e-9), found
    assert np.allclose(sorted(values), sorted(expected), rtol=0, atol=1e-9), found
    return found.bits == PRECISIONS[-1] and not found.proven


# Against the transcription


def compared(text: str, convention: str, seed: object) -> int:
    """How many of some pixels are proven; they must be what the transcription draws."""
    rules = {"exact": EXACT_RULES, "document": DOCUMENT_RULES}[convention]
    drawn = transcription.picture(text, SIDE, SIDE, 3, convention)
    prover, pick, proven = Prover(parse(text), width=SIDE, height=SIDE), random.Random(str(seed)), 0
    for _ in range(PIXELS):
        column, row = pick.randrange(SIDE), pick.randrange(SIDE)
        found = prover.admissible(column, row, rules)
        if found.proven:
            proven += 1
            assert np.abs(found.colours[0].value - drawn[row, column]).max() < 1e-6, (seed, column, row, found)
    return proven


@pytest.mark.parametrize("convention", ["exact", "document"])
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_proofs_agree_with_the_transcription(path: Path, convention: str) -> None:
    if (path.stem, convention) == ("light_on_sphere", "document"):
        pytest.skip("the transcription rounds the root at the light")
    assert compared(path.read_text(), convention, path.stem) >= PIXELS - 5


@pytest.mark.parametrize("convention", ["exact", "document"])
def test_proofs_of_random_scenes_agree_with_the_transcription(convention: str) -> None:
    assert sum(compared(dump(random_scene(seed)), convention, seed) for seed in range(12)) >= 12 * PIXELS - 5


@pytest.mark.parametrize(
    "rules",
    [
        replace(DOCUMENT_RULES, shadow=0.3),
        replace(DOCUMENT_RULES, reflection=5.0),
        replace(DOCUMENT_RULES, grazing=0.2),
        replace(DOCUMENT_RULES, ahead=0.01),
        replace(DOCUMENT_RULES, short=0.95),
    ],
    ids=["shadow", "reflection", "grazing", "ahead", "short"],
)
def test_every_rule_matters(rules: Rules) -> None:
    """Larger than the document's they change pixels, so that agreement means something."""
    prover = Prover(Scene.load(ROOT / "scenes" / "diagnostic" / "touching_spheres.txt"), width=40, height=40)
    pixels = [(column, row) for column in range(40) for row in range(40)]
    assert any(prover.admissible(*pixel).colours != prover.admissible(*pixel, rules).colours for pixel in pixels)


@pytest.mark.parametrize(
    "blocker",
    [
        Sphere(BLUE, (450, 450, 490), 20, 1, 0),  # from .872 to .928 of the way
        Sphere(BLUE, (350, 350, 470), 145, 1, 0),  # to .903
        Plane(BLUE, (0, 0, 490), (0, 0, 1), 1, 0),  # at .9
    ],
)
def test_blockers_beyond_the_end_of_a_shadow_ray_do_not_count(blocker: Sphere | Plane) -> None:
    wall = Plane(RED, (0, 0, 400), (0, 0, 1), 0.5, 0)
    lit, dark = shaded(RED, 0.5 * 100 / hypot(500, 500, 100)), shaded(RED, 0)
    prover = Prover(scene(wall, blocker), width=1, height=1)
    begins = 0.9 if isinstance(blocker, Plane) else 0.872 if blocker.radius == 20 else 0.497
    for short, expected in ((0.0, dark), (1 - begins - 0.005, dark), (1 - begins + 0.005, lit)):
        (colour,) = prover.admissible(0, 0, Rules(short=short)).colours
        assert colour.value == pytest.approx(expected), short


# Two surfaces at one distance


def corner(t: int, y: Fraction) -> tuple[Plane, Plane]:
    """A wall, and a floor that the camera's rays through height `y` of the screen meet where the wall stands."""
    wall = Plane(RED, (0, 0, 100.0 * t), (0, 0, -1), 0.5, 0)
    return wall, Plane(BLUE, (0, float(t * y), 0), (0, 1, 0), 0.5, 0)


@pytest.mark.parametrize("turned", [False, True])
def test_an_edge_through_a_pixel_centre(turned: bool) -> None:
    """The first listed wins; either may be seen, and either may lie in the other's shadow."""
    wall, floor = corner(6, Fraction(-125, 6))
    length = hypot(475, 625, 100)  # from (25, -125, 600) to the light
    found = prove(scene(floor, wall) if turned else scene(wall, floor), 6, 8, 12, 12)
    colours = [shaded(RED, 0.5 * 100 / length), shaded(BLUE, 0.5 * 625 / length)]
    dark = [shaded(RED, 0), shaded(BLUE, 0)]
    assert is_set(found, *(reversed(colours) if turned else colours), *dark)


def test_the_whole_row_of_an_edge_is_a_knife_edge_and_no_other() -> None:
    prover = Prover(scene(*corner(6, Fraction(-125, 6))), width=12, height=12)
    edges = {(column, row) for column in range(12) for row in range(12) if not prover.admissible(column, row).proven}
    assert edges == {(column, 8) for column in range(12)}


def test_an_edge_that_needs_no_rounding_is_one_too() -> None:
    found = prove(scene(*corner(6, Fraction(-35))), 5, 8, 10, 10)
    length = hypot(470, 710, 100)
    lit = [shaded(RED, 0.5 * 100 / length), shaded(BLUE, 0.5 * 710 / length)]
    values = [colour.value for colour in found.colours]
    assert values[0] == pytest.approx(lit[0])
    assert all(any(value == pytest.approx(colour) for value in values) for colour in lit)
    assert not found.proven


def test_equal_colours_of_two_surfaces_are_no_knife_edge() -> None:
    wall, floor = (replace(plane, colour=RED, diffuse=0.0) for plane in corner(6, Fraction(-125, 6)))
    assert prove(scene(wall, floor), 6, 8, 12, 12).proven


DECIMAL_CORNER = (
    Plane(RED, (0, 0, 300), (0, 0, -1), 0, 0),
    Plane(BLUE, (0, -104.7, 299), (0, 0.1, 0.03), 0, 0),  # 0.1 * 0.3 = 0.03 * 1: through (0, -105, 300)
)


@pytest.mark.parametrize("read", ["as written", "through binary"])
def test_inputs_are_exact_decimals(read: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if read == "through binary":
        monkeypatch.setattr(enclosure, "exact", Fraction)
    found = prove(scene(*DECIMAL_CORNER), 5, 8, 10, 10)
    assert is_set(found, shaded(RED, 0), shaded(BLUE, 0)) if read == "as written" else found.proven


def test_twins_in_decimals_are_merged() -> None:
    twins = (Plane(RED, (0.1, -0.3, 300), (0.1, 0.2, 0.3), 0.5, 0.5), Plane(BLUE, (0.2, -0.35, 300), (1, 2, 3), 1, 1))
    ball = Sphere(GREEN, (0, 0, 250), 20, 0.5, 0.5)
    prover, alone = (Prover(scene(*surfaces), width=9, height=9) for surfaces in ((*twins, ball), (twins[0], ball)))
    for column in range(9):
        for row in range(9):
            found = prover.admissible(column, row)
            assert found.proven
            assert found == alone.admissible(column, row)


# Tangents. For each: the pixel, its size of picture, the sphere, and where its ray touches it.

TANGENTS = [
    ((5, 3, 10, 10), Sphere(GREEN, (-25, 25, 305), 45, 0.5, 0), (15.0, 45.0, 300.0)),
    ((6, 4, 12, 12), Sphere(GREEN, (0.5, -6.5, 306), 46, 0.5, 0), (12.5, 37.5, 300.0)),
    ((0, 0, 1, 1), Sphere(GREEN, (-50, 0, 300), 50, 0.5, 0), (0.0, 0.0, 300.0)),
]
BACK = Plane(RED, (0, 0, 600), (0, 0, -1), 0.5, 0)


def minus(one: Triple, other: Triple) -> Triple:
    x, y, z = (a - b for a, b in zip(one, other, strict=True))
    return (x, y, z)


def dot(one: Triple, other: Triple) -> float:
    return sum(a * b for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize(("pixel", "ball", "touched"), TANGENTS)
def test_a_ray_that_touches_a_sphere(pixel: tuple[int, int, int, int], ball: Sphere, touched: Triple) -> None:
    """A discriminant of 0 is a hit; the ray may also go on to the wall."""
    arm, to_light = minus(touched, ball.centre), minus((500, 500, 500), touched)
    assert (dot(arm, arm), dot(arm, touched)) == (ball.radius**2, 0)
    cosine = dot(arm, to_light) / (ball.radius * hypot(*to_light))
    beyond = minus((500, 500, 500), (2 * touched[0], 2 * touched[1], 600))
    hit, miss = shaded(GREEN, 0.5 * cosine), shaded(RED, 0.5 * 100 / hypot(*beyond))
    assert is_set(prove(scene(ball, BACK), *pixel), hit, miss)
    assert is_set(prove(scene(ball), *pixel), hit, BLACK)
    for radius in (ball.radius * (1 - 1e-15), ball.radius * (1 + 1e-15)):
        assert prove(scene(replace(ball, radius=radius), BACK), *pixel).proven


def test_of_two_spheres_that_a_ray_touches_the_nearer_is_first() -> None:
    far, near = Sphere(GREEN, (-40, 0, 400), 40, 0, 0), Sphere(BLUE, (-50, 0, 300), 50, 0, 0)
    colours = [shaded(BLUE, 0), shaded(GREEN, 0), shaded(RED, 0)]
    assert is_set(prove(scene(far, near, replace(BACK, diffuse=0.0))), *colours)


def test_a_reflected_ray_that_touches_a_sphere() -> None:
    """From the mirror at (0, 0, 300) straight back, past a ball between the screen and the eye."""
    mirror, ball = Plane(RED, (0, 0, 300), (0, 0, -1), 0, 0.5), Sphere(GREEN, (30, 0, 50), 30, 0, 0)
    found = prove(scene(mirror, ball))
    assert is_set(found, plus(shaded(RED, 0), shaded(GREEN, 0, 0.5)), shaded(RED, 0))
    assert prove(scene(mirror, ball), depth=0).proven


SHADOWS = [
    ((7, 7, 10, 10), Sphere(GREEN, (280, 210, 470), 30, 0.5, 0), (100.0, -100.0, 400.0)),
    ((6, 4, 12, 12), Sphere(GREEN, (195, 265, 550), 30, 0.5, 0), (25.0, 75.0, 600.0)),
]


@pytest.mark.parametrize(("pixel", "ball", "point"), SHADOWS)
def test_a_shadow_ray_that_touches_a_sphere(pixel: tuple[int, int, int, int], ball: Sphere, point: Triple) -> None:
    to_light, arm = minus((500, 500, 500), point), minus(ball.centre, point)
    assert dot(arm, to_light) ** 2 == dot(to_light, to_light) * (dot(arm, arm) - ball.radius**2)
    wall = Plane(RED, (0, 0, point[2]), (0, 0, to_light[2]), 0.5, 0)
    lit = shaded(RED, 0.5 * abs(to_light[2]) / hypot(*to_light))
    assert is_set(prove(scene(wall, ball), *pixel), shaded(RED, 0), lit)
    assert prove(scene(replace(wall, diffuse=0.0), ball), *pixel).proven


# Horizons: camera rays through the uppermost of three rows of pixels are along (0, 3, -1) . x = const.

FLOOR = Plane(BLUE, (0, -100, 0), (0, 3, -1), 0.5, 0)
MIRROR = replace(FLOOR, reflection=0.5)
BALL = Sphere(GREEN, (0, -50, 300), 30, 0.5, 0.5)


@pytest.mark.parametrize(
    "surfaces",
    [(FLOOR,), (MIRROR,), (FLOOR, BALL), (MIRROR, BALL), (MIRROR, Plane(RED, (0, 0, -300), (0, 0, 1), 1, 1))],
)
@pytest.mark.parametrize("column", range(3))
def test_a_horizon_through_pixel_centres(surfaces: tuple[Plane | Sphere, ...], column: int) -> None:
    """A miss by the rule; or the plane infinitely far away, where nothing is lit and nothing left to mirror."""
    assert is_set(prove(scene(*surfaces), column, 0, 3, 3), BLACK, shaded(BLUE, 0))
    assert prove(scene(*surfaces), column, 2, 3, 3).proven


@pytest.mark.parametrize("front", [Plane(RED, (0, 0, 200), (0, 0, -1), 0.5, 0), Sphere(RED, (0, 100, 300), 90, 0.5, 0)])
def test_a_horizon_behind_something_is_no_knife_edge(front: Plane | Sphere) -> None:
    assert prove(scene(MIRROR, front), 1, 0, 3, 3).proven


def test_two_planes_with_one_horizon() -> None:
    ceiling = Plane(RED, (0, 300, 0), (0, 3, -1), 0.5, 0)
    found = prove(scene(FLOOR, ceiling), 1, 0, 3, 3)
    assert is_set(found, BLACK, shaded(BLUE, 0), shaded(RED, 0))


LEVEL = Plane(BLUE, (0, -100, 0), (0, 1, 0), 0.5, 0)


@pytest.mark.parametrize("reflection", [0.0, 0.5])
def test_a_horizon_where_nothing_is_rounded(reflection: float) -> None:
    found = prove(scene(replace(LEVEL, reflection=reflection)), 1, 1, 3, 3)
    assert is_set(found, BLACK, shaded(BLUE, 0))


def test_a_horizon_where_nothing_is_rounded_behind_something() -> None:
    assert prove(scene(LEVEL, BACK), 1, 1, 3, 3).proven


def test_a_reflected_ray_along_a_plane() -> None:
    mirror = Plane(RED, (0, 0, 300), (0, 0, -1), 0, 0.5)
    assert is_set(prove(scene(LEVEL, mirror)), shaded(RED, 0), plus(shaded(RED, 0), shaded(BLUE, 0, 0.5)))


# t = 1, exactly


def test_the_screen_is_invisible() -> None:
    """But it is a surface: it stands between the light and a ball before it, which a mirror shows."""
    screen, mirror = Plane(RED, (7, 8, 100), (0, 0, -3), 0, 0), Plane(BLUE, (0, 0, 300), (0, 0, -1), 0, 0.5)
    pixels = [(column, row) for column in range(7) for row in range(7)]
    for column, row in pixels:
        assert prove(scene(screen, BACK), column, row, 7, 7) == prove(scene(BACK), column, row, 7, 7)
        found = prove(scene(screen, mirror), column, row, 7, 7)
        assert found.proven
        assert found.colours[0].value == pytest.approx(plus(shaded(BLUE, 0), shaded(RED, 0, 0.5)))


@pytest.mark.parametrize("height", [125, 1000, 10, 20])
def test_a_plane_that_cuts_the_screen_in_a_row_of_pixel_centres(height: int) -> None:
    """Where t is 1 the model's rule sees nothing; rounded, t may be more."""
    tilted = Plane(RED, (0, 50 - 50 / height, 100), (0, 1, -1), 0, 0)
    assert is_set(prove(scene(tilted), 0, 0, 1, height), BLACK, shaded(RED, 0))


@pytest.mark.parametrize("normal", [(1, 0, -1), (0.1, -0.3, 0.2), (2, -1, -1)])
def test_a_plane_that_holds_the_light_shades_nothing(normal: Triple) -> None:
    through = Plane(RED, (500, 500, 500), normal, 0.5, 0)
    ball = Sphere(GREEN, (20, -30, 300), 60, 1, 0)
    for column, row in [(11, 9), (13, 10), (14, 12)]:
        found, alone = (
            prove(scene(*surfaces), column, row, 20, 20, depth=0) for surfaces in ((ball, through), (ball,))
        )
        assert found.proven
        assert found.colours[0].value == pytest.approx(alone.colours[0].value)
        assert found.colours[0].value > shaded(GREEN, 0)


@pytest.mark.parametrize(
    ("centre", "radius"),
    [((480, 470, 440), 70), ((500, 0.5, 500), 499.5), ((200, 1100, 1100), 900), ((200, -100, -100), 900)],
)
def test_a_sphere_that_holds_the_light_is_decided(centre: Triple, radius: float) -> None:
    through = Sphere(GREEN, centre, radius, 1, 0)
    assert sum((Fraction(repr(c)) - 500) ** 2 for c in centre) == Fraction(repr(radius)) ** 2
    text = dump(scene(through, BALL, Plane(RED, (0, -100, 0), (0, 1, 0), 0.5, 0.5), BACK))
    drawn = transcription.picture(text, 14, 14, 3, "exact")
    for column in range(14):
        for row in range(14):
            found = prove(parse(text), column, row, 14, 14)
            assert found.proven
            assert np.abs(found.colours[0].value - drawn[row, column]).max() < 1e-6


@pytest.mark.parametrize("normal", [(0, 1, 0), (0.1, 0.2, -0.3)])
def test_a_plane_through_the_eye_is_unseen(normal: Triple) -> None:
    through = Plane(RED, (0.3, 0.3, 0.3) if normal[0] else (5, 0, 7), normal, 0, 0)
    for column in range(7):
        for row in range(7):
            found = prove(scene(through, replace(BACK, diffuse=0)), column, row, 7, 7)
            assert found.proven
            assert found.colours[0].value == pytest.approx(shaded(RED, 0))


# What cannot be decided


@pytest.mark.parametrize("reflection", [(0.5, 0.5), (0.5, 0.0)])
def test_parallel_mirrors_at_their_horizon_are_undecided(reflection: tuple[float, float]) -> None:
    """A ray mirrored infinitely far away may meet the other plane anywhere."""
    planes = [Plane(BLUE, (0, y, 0), (0, 3, -1), 0, share) for y, share in zip((-100, 300), reflection, strict=True)]
    found = prove(scene(*planes), 1, 0, 3, 3)
    assert not found.complete
    assert not found.proven
    assert found.colours[0].value == BLACK


def test_a_ray_that_starts_in_a_plane_and_runs_along_it_is_undecided() -> None:
    """Rounded, it may meet the plane anywhere."""
    through_eye, mirror = Plane(BLUE, (0, 0, 0), (0, 1, 0), 0.5, 0), Plane(RED, (0, 0, 300), (0, 0, -1), 0, 0.5)
    assert not prove(scene(through_eye, mirror)).complete


def test_a_ray_that_starts_in_a_plane_and_runs_along_it_rounded_is_undecided() -> None:
    through_eye, mirror = Plane(BLUE, (0, 0, 0), (0, 3, -1), 0.5, 0), Plane(RED, (0, 0, 300), (0, 1, 3), 0, 0.5)
    assert not prove(scene(through_eye, mirror), height=3).complete


def test_a_way_that_may_have_any_colour_is_undecided() -> None:
    """Balls that are as wide as this leeway makes them hold everything after some bounces."""
    example = Scene.load(ROOT / "scenes" / "example1.txt")
    found = Prover(example, width=60, height=60).admissible(15, 48, Rules(precision=1e-6))
    assert found.colours or not found.complete


def test_more_colours_than_can_be_followed_are_undecided() -> None:
    """Planes of all colours through one edge."""
    planes = [Plane((number, 0, 0), (0, -125, 600), (0, number, 1), 0, 0) for number in range(2, LARGEST_SET + 3)]
    found = prove(scene(*planes), 6, 8, 12, 12)
    assert (found.complete, found.proven) == (False, False)
    assert found.colours[0].value == pytest.approx((1, 0, 0))
    fewer = prove(scene(*planes[1:]), 6, 8, 12, 12)
    assert fewer.complete
    assert len(fewer.colours) == LARGEST_SET


def test_proven_colours_are_sharp() -> None:
    for seed in range(6):
        prover = Prover(random_scene(seed), width=9, height=9, depth=8)
        for colour in (colour for column in range(9) for colour in prover.admissible(column, 4).colours):
            for value, radius in zip(colour.value, colour.radius, strict=True):
                assert radius <= PROVEN * max(1, abs(value) / 255)


def many_spheres(*others: Sphere) -> Scene:
    pick = random.Random(5)

    def decimal(low: float, high: float) -> float:
        return round(pick.uniform(low, high), 1)

    places = [(decimal(-150, 150), decimal(-150, 150), decimal(150, 600)) for _ in range(enclosure.FEW + 10)]
    return scene(*(Sphere(GREEN, place, decimal(3, 40), 0.5, 0.5) for place in places), BALL, *others)


@pytest.mark.parametrize("rules", [EXACT_RULES, DOCUMENT_RULES, Rules(precision=1e-9, gap=1.0)], ids=str)
def test_spheres_are_passed_over_only_where_they_are_missed(rules: Rules, monkeypatch: pytest.MonkeyPatch) -> None:
    balls = many_spheres(*(ball for _, ball, _ in (*TANGENTS, *SHADOWS)))
    results = []
    for few in (0, 1000):
        monkeypatch.setattr(enclosure, "FEW", few)
        prover = Prover(replace(balls, planes=(BACK,)), width=12, height=12)
        results.append([prover.admissible(column, row, rules) for column in range(12) for row in range(12)])
    assert results[0] == results[1]


def test_many_spheres_and_one_far_away() -> None:
    assert prove(many_spheres(Sphere(RED, (0, 0, 3e200), 2e200, 0, 0)), 6, 6, 12, 12).proven


def test_a_ray_that_starts_off_its_surface_never_meets_it_by_rounding() -> None:
    """Two round mirrors magnify the error until the last start is less sure than it is off its surface."""
    prover = Prover(Scene.load(ROOT / "scenes" / "example3.txt"), width=32, height=32)
    (usual,) = prover.admissible(25, 26).colours
    (colour,) = prover.admissible(25, 26, Rules(precision=2.0**-24, ahead=2.0**-13, origin=(0, -100, 250))).colours
    assert colour.value == pytest.approx(usual.value, abs=0.01)
    assert max(colour.radius) < 0.01


def test_a_ray_that_starts_off_its_sphere_meets_it_from_inside() -> None:
    ball = Sphere((0, 0, 0), (0, 0, 0), 200, 0, 1)
    prover = Prover(Scene((255, 255, 255), 1, (ball,)), width=1, height=1, depth=2)
    rays = prover.admissible(0, 0, Rules(ahead=2.0**-13)).rays
    assert [ray.hit.place for ray in rays if ray.hit] == [0, 0, 0]
