"""Surfaces that a coarse renderer cannot tell apart, against all pairs compared one by one."""

import math
import time
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference import Plane, Sphere
from reference.scene import EYE, Triple
from translator.likeness import find_alike

APART = 1e-3


def ball(x: float, y: float, z: float, radius: float) -> Sphere:
    return Sphere((9, 9, 9), (x, y, z), radius, 1, 0)


def wall(point: Triple, normal: Triple) -> Plane:
    return Plane((9, 9, 9), point, normal, 1, 0)


def balls(*spheres: Sphere) -> dict[str, Sphere]:
    return {f"sphere {place}": sphere for place, sphere in enumerate(spheres, 1)}


def walls(*planes: Plane) -> dict[str, Plane]:
    return {f"plane {place}": plane for place, plane in enumerate(planes, 1)}


@pytest.mark.parametrize(
    ("other", "alike"),
    [
        (ball(70.0009, -40, 300, 10), True),
        (ball(69.9991, -40, 300, 10), True),
        (ball(70, -40, 300.0011, 10), False),
        (ball(70, -40, 300, 10.0009), True),
        (ball(70, -40, 300, 9.9989), False),
        (ball(70, -40.0006, 300, 10.0006), False),
        (ball(70.0005, -40.0005, 300.0005, 10), True),
    ],
)
def test_spheres(other: Sphere, alike: bool) -> None:
    spheres = balls(ball(70, -40, 300, 10), ball(5, 5, 300, 10), other)
    assert find_alike(spheres, {}, APART) == (("sphere 1", "sphere 3") if alike else None)


@pytest.mark.parametrize(
    ("other", "alike"),
    [
        (wall((30, -100.0009, 7), (0, 1, 0)), True),
        (wall((0, -99.9991, 0), (0, -9, 0)), True),
        (wall((0, -100.0011, 0), (0, 1, 0)), False),
        (wall((0, 100, 0), (0, 1, 0)), False),
        (wall((0, -100, 0), (1.9e-5, 1, 0)), True),
        (wall((0, -100, 0), (2.1e-5, 1, 0)), False),
    ],
)
def test_planes(other: Plane, alike: bool) -> None:
    planes = walls(wall((0, -100, 0), (0, 1, 0)), wall((0, -100, 0), (0, 1, 1)), other)
    assert find_alike({}, planes, APART) == (("plane 1", "plane 3") if alike else None)


def test_nothing_and_one_are_like_nothing() -> None:
    assert find_alike({}, {}, APART) is None
    assert find_alike(balls(ball(0, 0, 300, 1)), walls(wall((0, 0, 300), (0, 0, 1))), APART) is None


steps = st.integers(-4, 4).map(lambda step: step * 3e-4)
spheres_close_by = st.builds(ball, steps, steps, steps.map(lambda step: 300 + step), steps.map(lambda step: 10 + step))
turns = st.integers(-4, 4).map(lambda step: step * 6e-6)
planes_close_by = st.builds(
    lambda height, x, z, side: wall((0, height, 0), (x, side, z)),
    st.tuples(steps, st.sampled_from([-100, 0, 100])).map(sum),
    turns,
    turns,
    st.sampled_from([-1, 1]),
)


@given(spheres=st.lists(spheres_close_by, max_size=5))
def test_spheres_as_by_all_pairs(spheres: list[Sphere]) -> None:
    expected = {
        one
        for one in combinations(balls(*spheres).items(), 2)
        if math.dist(one[0][1].centre, one[1][1].centre) + abs(one[0][1].radius - one[1][1].radius) < APART
    }
    found = find_alike(balls(*spheres), {}, APART)
    assert found in {(one[0], other[0]) for one, other in expected} if expected else found is None


@given(planes=st.lists(planes_close_by, max_size=5))
def test_planes_as_by_all_pairs(planes: list[Plane]) -> None:
    def are_alike(one: Plane, other: Plane) -> bool:
        """Whichever way they face: as one faces, or as it faces turned about."""
        a, b = one.distance_from(EYE), other.distance_from(EYE)
        turned = [math.dist(one.unit_normal, [side * x for x in other.unit_normal]) < APART / 50 for side in (1, -1)]
        return (turned[0] and abs(a - b) < APART) or (turned[1] and abs(a + b) < APART)

    named = walls(*planes)
    expected = {(one, other) for one, other in combinations(named, 2) if are_alike(named[one], named[other])}
    found = find_alike({}, named, APART)
    assert found in expected if expected else found is None


@pytest.mark.parametrize("shape", ["along x", "a wall", "a lattice", "nested"])
def test_many_spheres_take_little_time(shape: str) -> None:
    side = {"along x": 20000, "a wall": 142, "a lattice": 28, "nested": 1}[shape]
    places = [(place % side, place // side % side, 200 + place // side**2) for place in range(20000)]
    if shape == "nested":
        spheres = balls(*(ball(0, 0, 300, 1 + place / 100) for place in range(20000)))
    elif shape == "a wall":
        spheres = balls(*(ball(0, x, y + z, 0.4) for x, y, z in places))
    else:
        spheres = balls(*(ball(x, y, z, 0.4) for x, y, z in places))
    start = time.process_time()
    assert find_alike(spheres, {}, APART) is None
    assert time.process_time() - start < 3  # all pairs take minutes
    spheres["sphere 0"] = ball(*spheres["sphere 20000"].centre, spheres["sphere 20000"].radius + 1e-4)
    assert find_alike(spheres, {}, APART) == ("sphere 20000", "sphere 0")


def test_many_planes_take_little_time() -> None:
    through_eye = (wall((0, 0, 0), (math.cos(turn / 700), math.sin(turn / 700), 1)) for turn in range(2000))
    stacked = (wall((0, -place, 0), (0, 1, 0)) for place in range(1, 2000))
    start = time.process_time()
    assert find_alike({}, walls(*through_eye, *stacked), APART) is None
    assert time.process_time() - start < 3
