"""Blender Cycles: the scene as a Blender script, for Blender with its window or as a Python module."""

from __future__ import annotations

import math
from importlib import resources
from itertools import combinations

from reference.scene import (
    EYE,
    LIGHT,
    SCREEN,
    SCREEN_DISTANCE,
    Plane,
    Scene,
    Sphere,
    Triple,
    distinct_planes,
    distinct_spheres,
    holds_light,
)
from translator.contract import PYTHON, Export, Limits, Settings, Unsupported, number, single, source

TITLE = "Blender Cycles"
LICENCE = "GPL-3.0-or-later"
INSTALL = "pip install 'crossray[cycles]' (374 MB, for Python 3.11 only)"
VERSION = ((PYTHON, "-c", "import importlib.metadata as m; print('bpy', m.version('bpy'))"), r"bpy (\S+)")
TIMING = r"traced in ([0-9.e-]+) s"

FAR = 2.0**29  # Cycles loses what is farther away by twice that
LIMITS = Limits(precision=2.0**-20, far=FAR)  # single precision, as it adds up in interval arithmetic
# What single precision carries, found by comparing pictures.
COARSE = "Cycles' single precision is too coarse"
FARTHEST = 1e6  # of a sphere
FARTHEST_PLANE = 1e8
LARGEST_RADIUS = 5000
MANY_BALLS = 20  # that mirror each other: each magnifies the error, and more ways lead between more of them
DEEPEST_BETWEEN_BALLS = 3  # bounces, where there are so many
APART = 1e-3  # between surfaces that look alike

# What Blender and Cycles allow.
FAINTEST = 1e-5  # CLOSURE_WEIGHT_CUTOFF: Cycles leaves out what has a smaller coefficient
SMALLEST_SIDE = 4  # pixels
NARROWEST = 200  # pixels that are so many times as wide as high, or as high as wide
MOST_THREADS = 1024
DEEPEST = 50  # bounces: each is drawn by itself

HEADER = """\
# {title}
# Run: {command}
# or with Blender 5 itself:
#   blender --background --python scene.py -- scene.exr
#   blender --python scene.py    shows the scene; F12 draws it
# The picture is linear: 1.0 is level 255. The scene as the assignment writes it:
#
{source}
{program}

# The scene. Lengths are the assignment's; colours are over 255; what is emitted is the ambient light.

studio(width={width}, height={height}, bounces={bounces}, threads={threads})
"""
SPHERE = """
sphere(
    "{name}",
    centre={centre},
    radius={radius},
{look})
"""
PLANE = """
plane(
    "{name}",
    foot={foot},
    across={across},
    along={along},
{look})
"""
LOOK = """\
    emitted={emitted},
    diffuse={diffuse},
    reflection={reflection},
"""
NOTES = (
    "A view layer draws the light after each number of bounces, with one sample a pixel; the compositor adds them up.",
    "Planes are nested squares that end at a distance of 2^30. In Blender the assignment's y is z, and z is y.",
)


def export(scene: Scene, settings: Settings) -> Export:
    """One Blender script: fixed functions (`studio.py` here), then the scene, surface by surface."""
    spheres, planes = distinct_spheres(scene), distinct_planes(scene)
    surfaces: dict[str, Sphere | Plane] = {**spheres, **planes}
    bounces = settings.depth if any(surface.reflection for surface in surfaces.values()) else 0
    _refuse_settings(settings, bounces)
    light = [value * scene.ambient_coefficient / 256 for value in scene.ambient]
    for name, surface in surfaces.items():
        _refuse_colours(name, surface, light, bounces)
    for name, sphere in spheres.items():
        _refuse_sphere(name, sphere, settings)
    for name, plane in planes.items():
        if abs(plane.distance_from(EYE)) > FARTHEST_PLANE:
            raise Unsupported(f"Cycles sees nothing beyond {FAR:g}, where rays along {name} would meet it")
    _refuse_close_pairs(spheres, planes)
    if bounces:
        _refuse_mirrors(spheres, planes, bounces)
    command = (PYTHON, "scene.py", "scene.exr")
    header = HEADER.format(
        title="A scene of the recursive ray tracing assignment, for Blender 5.0 and its renderer Cycles",
        command=" ".join(command),
        source=source(scene, "#   "),
        program=resources.files(__name__).joinpath("studio.py").read_text(encoding="utf-8"),
        width=settings.width,
        height=settings.height,
        bounces=bounces,
        threads=min(settings.threads, MOST_THREADS),
    )
    parts = [header]
    parts += [_sphere(name, sphere, light) for name, sphere in spheres.items()]
    parts += [_plane(name, plane, light) for name, plane in planes.items()]
    return Export({"scene.py": "".join([*parts, "\nrender()\n"])}, command, "scene.exr", NOTES, limits=LIMITS)


def _refuse_settings(settings: Settings, bounces: int) -> None:
    width, height = settings.width, settings.height
    if bounces > DEEPEST:
        raise Unsupported(f"Cycles draws a layer for each bounce, and layers for {bounces} take too long")
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


def _refuse_close_pairs(spheres: dict[str, Sphere], planes: dict[str, Plane]) -> None:
    """Surfaces that single precision cannot tell apart."""
    for (name, one), (other_name, other) in combinations(spheres.items(), 2):
        if math.dist(one.centre, other.centre) + abs(one.radius - other.radius) < APART:
            raise Unsupported(f"{COARSE} to tell {name} from {other_name}")
    for (name, plane), (other_name, other_plane) in combinations(planes.items(), 2):
        cosine = sum(a * b for a, b in zip(plane.unit_normal, other_plane.unit_normal, strict=True))
        side = math.copysign(1, cosine)
        turned = math.dist(plane.unit_normal, [side * value for value in other_plane.unit_normal])
        if turned < APART / SCREEN and abs(plane.distance_from(EYE) - side * other_plane.distance_from(EYE)) < APART:
            raise Unsupported(f"{COARSE} to tell {name} from {other_name}")


def _nearest_pixel(place: float, pixels: int) -> float:
    """Where on the screen the nearest pixel is, along one axis."""
    pitch = 2 * SCREEN / pixels
    index = min(max(math.floor((place + SCREEN) / pitch), 0), pixels - 1)
    return (index + 0.5) * pitch - SCREEN


def _sphere(name: str, sphere: Sphere, light: list[float]) -> str:
    look = _look(sphere, light)
    return SPHERE.format(name=name, centre=_tuple(sphere.centre), radius=number(sphere.radius), look=look)


def _plane(name: str, plane: Plane, light: list[float]) -> str:
    """The foot of the perpendicular from the eye, and two directions along the plane."""
    normal, offset = plane.unit_normal, plane.distance_from(EYE)
    foot = (normal[0] * offset + 0.0, normal[1] * offset + 0.0, normal[2] * offset + 0.0)  # never -0.0
    across, along = plane.tangents
    is_screen = normal[0] == normal[1] == 0 and offset == SCREEN_DISTANCE * normal[2]
    look = _look(plane, light)
    if is_screen or not offset:
        look += "    seen=False,\n"
    if not plane.distance_from(LIGHT):
        look += "    shadow=False,\n"
    return PLANE.format(name=name, foot=_tuple(foot), across=_tuple(across), along=_tuple(along), look=look)


def _look(surface: Sphere | Plane, light: list[float]) -> str:
    red, green, blue = (value / 255 for value in surface.colour)
    emitted = (red * light[0], green * light[1], blue * light[2])
    diffuse = (red * surface.diffuse, green * surface.diffuse, blue * surface.diffuse)
    return LOOK.format(emitted=_colour(emitted), diffuse=_colour(diffuse), reflection=single(surface.reflection + 0.0))


def _tuple(values: Triple) -> str:
    return f"({', '.join(number(value + 0.0) for value in values)})"


def _colour(values: Triple) -> str:
    return f"({', '.join(single(value + 0.0) for value in values)}, 1)"
