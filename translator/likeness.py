"""Surfaces so nearly the same that a coarse renderer cannot tell them apart."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from reference.scene import EYE, SCREEN, Plane, Sphere, Triple

# Surfaces are sorted along a direction in which those of rows, lattices and nested spheres come one after the other.
SKEW = (math.sqrt(2) / 3, math.sqrt(3) / 3, math.sqrt(5) / 7, math.sqrt(7) / 5)  # of x, y, z and radius


def find_alike(spheres: Mapping[str, Sphere], planes: Mapping[str, Plane], apart: float) -> tuple[str, str] | None:
    """The names of two surfaces that are nearly the same, in the order given; None where there are no such two.

    Two spheres are if the distance of their centres and the difference of their radii add up to less than `apart`.
    Two planes are if their distances from the eye differ by less than `apart`, and their unit normals, whichever way
    they face, by less than `apart` over the screen's half width. Coordinates may go up to 1e12 times `apart`.
    """
    alike = (
        (spheres, _like_spheres(list(spheres.values()), apart)),
        (planes, _like_planes(list(planes.values()), apart)),
    )
    for surfaces, pairs in alike:
        for pair in pairs:
            names = list(surfaces)
            return names[min(pair)], names[max(pair)]
    return None


def _like_spheres(spheres: list[Sphere], apart: float) -> Iterator[tuple[int, int]]:
    keys = [_project(sphere.centre) + SKEW[3] * sphere.radius for sphere in spheres]
    for i, j in _neighbours(keys, apart):
        one, other = spheres[i], spheres[j]
        if math.dist(one.centre, other.centre) + abs(one.radius - other.radius) < apart:
            yield i, j


def _like_planes(planes: list[Plane], apart: float) -> Iterator[tuple[int, int]]:
    normals = [plane.unit_normal for plane in planes]
    offsets = [plane.distance_from(EYE) for plane in planes]
    keys = [abs(offset) + SCREEN * abs(_project(normal)) for offset, normal in zip(offsets, normals, strict=True)]
    for i, j in _neighbours(keys, 2 * apart):
        side = math.copysign(1, sum(a * b for a, b in zip(normals[i], normals[j], strict=True)))
        turned = math.dist(normals[i], [side * value for value in normals[j]])
        if turned < apart / SCREEN and abs(offsets[i] - side * offsets[j]) < apart:
            yield i, j


def _project(vector: Triple) -> float:
    """A coordinate along the skew axis: of two points it differs by less than they are apart."""
    return sum(a * b for a, b in zip(SKEW[:3], vector, strict=True))


def _neighbours(keys: list[float], reach: float) -> Iterator[tuple[int, int]]:
    """The places of all pairs of keys that differ by less than `reach`."""
    order = sorted(range(len(keys)), key=keys.__getitem__)
    for start, i in enumerate(order):
        for other in range(start + 1, len(order)):
            j = order[other]
            if keys[j] - keys[i] >= reach:
                break
            yield i, j
