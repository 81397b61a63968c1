"""What Cycles' arithmetic cannot do better, and what is refused. The figures come from comparing pictures."""

from __future__ import annotations

import math

from reference.scene import EYE, SCREEN, SCREEN_DISTANCE, Plane, Sphere, holds_light
from translator.contract import Limits, Settings, Unsupported
from translator.likeness import find_alike

FAR = 2.0**29  # Cycles loses what is farther away by twice that
LIMITS = Limits(precision=2.0**-20, far=FAR)  # single precision, as it adds up in interval arithmetic
# What single precision carries, found by comparing pictures.
COARSE = "Cycles' single precision is too coarse"
FARTHEST = 1e6  # of a sphere
FARTHEST_PLANE = 1e8
LARGEST_RADIUS = 5000
MANY_BALLS = 20  # that mirror each other: each magnifies the error, and more ways lead between more of them
DEEPEST_BETWEEN_BALLS = 5  # bounces, where there are so many
APART = 1e-3  # between surfaces that look alike

# What Blender and Cycles allow.
FAINTEST = 1e-5  # CLOSURE_WEIGHT_CUTOFF: Cycles leaves out what has a smaller coefficient
SMALLEST_SIDE = 4  # pixels
NARROWEST = 200  # pixels that are so many times as wide as high, or as high as wide
MOST_THREADS = 1024
DEEPEST = 24  # bounces: some pixels of many mirrors are wrong after 50, and each bounce is drawn by itself


def refuse(
    spheres: dict[str, Sphere], planes: dict[str, Plane], light: list[float], bounces: int, settings: Settings
) -> None:
    """Raise Unsupported for what Cycles cannot carry; `light` is the ambient light, 3 linear channels."""
    _refuse_settings(settings, bounces)
    surfaces: dict[str, Sphere | Plane] = {**spheres, **planes}
    for name, surface in surfaces.items():
        _refuse_colours(name, surface, light, bounces)
    for name, sphere in spheres.items():
        _refuse_sphere(name, sphere, settings)
    for name, plane in planes.items():
        if abs(plane.distance_from(EYE)) > FARTHEST_PLANE:
            raise Unsupported(f"Cycles sees nothing beyond {FAR:g}, where rays along {name} would meet it")
    if pair := find_alike(spheres, planes, APART):
        raise Unsupported(f"{COARSE} to tell {pair[0]} from {pair[1]}")
    if bounces:
        _refuse_mirrors(spheres, planes, bounces)


def _refuse_settings(settings: Settings, bounces: int) -> None:
    width, height = settings.width, settings.height
    if bounces > DEEPEST:
        raise Unsupported(f"{COARSE} for {bounces} bounces (at most {DEEPEST})")
    if min(width, height) < SMALLEST_SIDE:
        raise Unsupported(f"Blender's pictures have at least {SMALLEST_SIDE}x{SMALLEST_SIDE} pixels")
    if max(width, height) > NARROWEST * min(width, height):
        raise Unsupported(f"Blender's pixels are at most {NARROWEST} times as wide as high, or as high as wide")


def _refuse_colours(name: str, surface: Sphere | Plane, light: list[float], bounces: int) -> None:
    shares = [(value * ambient, value * surface.diffuse) for value, ambient in zip(surface.colour, light, strict=True)]
    mirrors = surface.reflection if bounces else 0
    if mirrors < 0 or any(value < 0 for share in shares for value in share):
        raise Unsupported(f"Cycles takes negative light for none: {name} brings some")
    diffuse = sum(value for _, value in shares) / 3 / 255
    if 0 < mirrors < FAINTEST or 0 < diffuse < FAINTEST:
        raise Unsupported(f"Cycles leaves out what is fainter than {FAINTEST:g}: {name} has such a coefficient")


def _refuse_sphere(name: str, sphere: Sphere, settings: Settings) -> None:
    if max(map(abs, sphere.centre)) + sphere.radius > FARTHEST:
        raise Unsupported(f"{COARSE} beyond {FARTHEST:g}: {name} reaches farther")
    if sphere.radius > LARGEST_RADIUS:
        over = f"over {LARGEST_RADIUS}: {name} has {sphere.radius:g}"
        raise Unsupported(f"{COARSE} for a radius {over}")
    if holds_light(sphere):
        raise Unsupported(f"Cycles decides by rounding whether {name} hides the light, which lies on it")
    x, y, _ = sphere.centre
    start = (_nearest_pixel(x, settings.width), _nearest_pixel(y, settings.height), SCREEN_DISTANCE)
    if math.dist(start, sphere.centre) <= sphere.radius:
        raise Unsupported(f"Cycles' spheres have no inside: rays of the camera, from the screen, start in {name}")


def _refuse_mirrors(spheres: dict[str, Sphere], planes: dict[str, Plane], bounces: int) -> None:
    balls = sum(sphere.reflection != 0 for sphere in spheres.values())
    if bounces > DEEPEST_BETWEEN_BALLS and balls >= MANY_BALLS:
        most = f"(at most {DEEPEST_BETWEEN_BALLS})"
        raise Unsupported(f"{COARSE} for {bounces} bounces between {balls} mirroring spheres {most}")
    through_eye = [name for name, plane in planes.items() if not plane.distance_from(EYE)]
    if len(through_eye) > 1 and any(planes[name].reflection for name in through_eye):
        edge = " and ".join(through_eye[:2])
        raise Unsupported(f"Cycles decides by rounding what mirrors show on the line through the eye where {edge} meet")


def _nearest_pixel(place: float, pixels: int) -> float:
    """Where on the screen the nearest pixel is, along one axis."""
    pitch = 2 * SCREEN / pixels
    index = min(max(math.floor((place + SCREEN) / pitch), 0), pixels - 1)
    return (index + 0.5) * pitch - SCREEN
