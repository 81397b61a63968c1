"""How the pictures of related scenes are related: no other renderer is asked, and no picture is known to be right."""

from collections.abc import Callable
from dataclasses import replace
from itertools import count, pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from reference.model import DOCUMENT, EXACT, Model
from reference.scene import Plane, Scene, Sphere, Triple, merge_coincident
from reference.tracer import render

Picture = NDArray[np.float64]

COUNTS = ((0, 2), (1, 1), (3, 1), (5, 3))  # spheres and planes; each pair is a kernel to compile
ROUNDING = 4e-15  # of the brightest level: some ulps, as no ray changes its way
AMPLIFIED = 1e-9  # of the brightest level: at each bounce a ball multiplies a ray's error by about distance / radius
FLIPPED = 2  # pixels of a picture whose ray may pass an edge so closely that rounding decides on which side

pytestmark = pytest.mark.parametrize("model", [DOCUMENT, EXACT], ids=lambda model: model.name)
relation = settings(deadline=None, derandomize=True, max_examples=40)


def decimals(low: int, high: int) -> st.SearchStrategy[float]:
    return st.integers(1000 * low, 1000 * high).map(lambda thousandths: thousandths / 1000)


def triples(low: int, high: int) -> st.SearchStrategy[Triple]:
    return st.tuples(decimals(low, high), decimals(low, high), decimals(low, high))


def balls(nearest: int) -> st.SearchStrategy[Sphere]:
    """Spheres of radius 10 to 90 with their centre from z = `nearest` on; the light is in none of them."""
    centres = st.tuples(decimals(-150, 150), decimals(-150, 150), decimals(nearest, 600))
    return st.builds(Sphere, colours, centres, decimals(10, 90), shares, shares)


shares = decimals(0, 1)
colours = triples(0, 255)
# Along an axis or skew: a horizon such as x + y = 0 passes through many pixel centres, where rounding decides.
normals = triples(-3, 3).filter(all) | st.sampled_from([(0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, -1.0)])
anywhere = balls(-50)
walls = st.builds(Plane, colours, triples(-300, 300), normals, shares, shares)


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    spheres, planes = draw(st.sampled_from(COUNTS))
    return draw(st.builds(Scene, colours, shares, st.tuples(*[anywhere] * spheres), st.tuples(*[walls] * planes)))


distinct = scenes().filter(lambda scene: merge_coincident(scene) == scene)


def changed(scene: Scene, **steps: Callable[[Any], Any]) -> Scene:
    """The scene with the named fields replaced, of its spheres, then of its planes, where they have them."""

    def change(surface: Any) -> Any:
        fields = {name: step(getattr(surface, name)) for name, step in steps.items() if hasattr(surface, name)}
        return replace(surface, **fields)

    return replace(scene, spheres=tuple(map(change, scene.spheres)), planes=tuple(map(change, scene.planes)))


def scaled(vector: Triple, factor: float) -> Triple:
    return (factor * vector[0], factor * vector[1], factor * vector[2])


def picture(scene: Scene, model: Model, depth: int = 3, width: int = 32, height: int = 32) -> Picture:
    return render(scene, model, width=width, height=height, depth=depth, dtype=float)


def error(found: Picture, expected: Picture) -> float:
    """The largest difference, of the brightest level."""
    return float(np.abs(found - expected).max() / (expected.max() or 1))


def flips(found: Picture, expected: Picture) -> int:
    """How many pixels differ by more than amplified rounding."""
    same = np.abs(found - expected) <= AMPLIFIED * expected.max()
    return int(np.count_nonzero(~same.all(-1)))


@relation
@given(distinct, st.data())
def test_the_order_of_objects_does_not_matter(model: Model, scene: Scene, data: st.DataObject) -> None:
    spheres = tuple(data.draw(st.permutations(scene.spheres)))
    shuffled = replace(scene, spheres=spheres, planes=tuple(data.draw(st.permutations(scene.planes))))
    assert np.array_equal(picture(shuffled, model), picture(scene, model))


@relation
@given(distinct, st.permutations([0, 1, 2]))
def test_colour_channels_are_independent(model: Model, scene: Scene, order: list[int]) -> None:
    def permuted(colour: Triple) -> Triple:
        return (colour[order[0]], colour[order[1]], colour[order[2]])

    other = replace(changed(scene, colour=permuted), ambient=permuted(scene.ambient))
    assert np.array_equal(picture(other, model), picture(scene, model)[..., order])


@relation
@given(distinct)
def test_a_grey_scene_is_grey(model: Model, scene: Scene) -> None:
    grey = picture(replace(changed(scene, colour=lambda colour: (colour[0],) * 3), ambient=(200, 200, 200)), model)
    assert np.array_equal(grey, np.repeat(grey[..., :1], 3, axis=-1))


@relation
@given(distinct)
def test_half_the_surface_colours_give_half_the_picture(model: Model, scene: Scene) -> None:
    half = changed(scene, colour=lambda colour: scaled(colour, 0.5))
    assert np.array_equal(picture(half, model), picture(scene, model) / 2)


@relation
@given(distinct)
def test_without_mirrors_one_hit_is_all(model: Model, scene: Scene) -> None:
    matt = changed(scene, reflection=lambda _: 0.0)
    assert np.array_equal(picture(matt, model), picture(scene, model, depth=0))


@relation
@given(distinct)
def test_the_length_of_a_normal_does_not_matter(model: Model, scene: Scene) -> None:
    long = changed(scene, normal=lambda normal: scaled(normal, 2))
    assert np.array_equal(picture(long, model), picture(scene, model))


@relation
@given(distinct, balls(200), st.tuples(*[st.floats(-0.25, 0.25)] * 3))
def test_what_is_hidden_in_a_sphere_does_not_matter(model: Model, scene: Scene, shell: Sphere, shift: Triple) -> None:
    """The shell has neither the light in it nor the screen before it, so that no ray starts or sees inside."""
    x, y, z = (middle + part * shell.radius for middle, part in zip(shell.centre, shift, strict=True))
    hidden = Sphere((255, 255, 255), (x, y, z), shell.radius / 2, 1, 1)
    plain = replace(scene, spheres=(*scene.spheres, shell))
    stuffed = replace(scene, spheres=(hidden, *scene.spheres, shell))
    assert np.array_equal(picture(stuffed, model), picture(plain, model))


@relation
@given(distinct)
def test_later_twins_do_not_matter(model: Model, scene: Scene) -> None:
    twins = changed(scene, colour=lambda _: (255, 0, 255), diffuse=lambda _: 1, normal=lambda n: scaled(n, -2))
    doubled = replace(scene, spheres=scene.spheres + twins.spheres, planes=scene.planes + twins.planes)
    assert np.array_equal(picture(doubled, model), picture(scene, model))


@relation
@given(distinct)
def test_more_bounces_add_light_only(model: Model, scene: Scene) -> None:
    for shallow, deep in pairwise(picture(scene, model, depth) for depth in range(6)):
        assert np.all(deep >= shallow)


@relation
@given(distinct, shares)
def test_the_picture_is_linear_in_surface_colours(model: Model, scene: Scene, share: float) -> None:
    dim = changed(scene, colour=lambda colour: scaled(colour, share))
    assert error(picture(dim, model), share * picture(scene, model)) <= ROUNDING


@relation
@given(distinct, shares)
def test_ambient_light_adds_up(model: Model, scene: Scene, more: float) -> None:
    level = scene.ambient_coefficient
    none, other, both = (picture(replace(scene, ambient_coefficient=ka), model) for ka in (0, more, level + more))
    assert error(both, picture(scene, model) + other - none) <= ROUNDING


@relation
@given(distinct, shares)
def test_the_picture_is_linear_in_diffuse_coefficients(model: Model, scene: Scene, share: float) -> None:
    full = picture(changed(scene, diffuse=lambda _: 1.0), model)
    mixed = picture(changed(scene, diffuse=lambda value: (1 - share) * value + share), model)
    assert error(mixed, (1 - share) * picture(scene, model) + share * full) <= ROUNDING


@relation
@given(distinct)
def test_diffuse_light_is_the_sum_over_objects(model: Model, scene: Scene) -> None:
    def alone(number: int) -> Scene:
        turn = count()
        return changed(dark, diffuse=lambda value: value if next(turn) == number else 0.0)

    dark = replace(scene, ambient_coefficient=0.0)
    parts = [picture(alone(number), model) for number in range(len(scene.spheres) + len(scene.planes))]
    assert error(np.sum(parts, axis=0), picture(dark, model)) <= ROUNDING


@relation
@given(distinct, decimals(0, 1).filter(bool))
def test_each_bounce_is_one_power_of_the_mirrors(model: Model, scene: Scene, share: float) -> None:
    up_to = [picture(scene, model, depth) for depth in range(4)]
    powers = [up_to[0], *(share**bounce * (up_to[bounce] - up_to[bounce - 1]) for bounce in (1, 2, 3))]
    weaker = changed(scene, reflection=lambda value: share * value)
    assert error(picture(weaker, model), np.sum(powers, axis=0)) <= ROUNDING


@relation
@given(distinct)
def test_swapping_x_and_y_mirrors_the_picture(model: Model, scene: Scene) -> None:
    """About the diagonal from the lower left; eye, screen and light stay."""

    def swapped(vector: Triple) -> Triple:
        return (vector[1], vector[0], vector[2])

    other = picture(changed(scene, centre=swapped, point=swapped, normal=swapped), model, width=16, height=32)
    assert flips(other[::-1, ::-1].swapaxes(0, 1), picture(scene, model, width=32, height=16)) <= FLIPPED


@relation
@given(distinct, triples(-50, 50))
def test_any_point_of_a_plane_will_do(model: Model, scene: Scene, way: Triple) -> None:
    def slid(plane: Plane) -> Plane:
        x, y, z = map(float, np.cross(plane.normal, way) + plane.point)
        return replace(plane, point=(x, y, z))

    moved = replace(scene, planes=tuple(map(slid, scene.planes)))
    assert flips(picture(moved, model), picture(scene, model)) <= FLIPPED
