"""Tachyon: the scene in its own scene file, which a program of ours hands to Tachyon's library with all its digits."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from importlib import resources
from itertools import combinations, permutations

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
    exact,
)
from translator.contract import PYTHON, Export, Limits, Settings, Unsupported, number, single, source

TITLE = "Tachyon"
LICENCE = "BSD-3-Clause"
INSTALL = "apt-get install tachyon-bin-nox"
VERSION = (("tachyon", "no.dat"), r"Version (\d[\w.]*)")  # `tachyon -version` ends with 255
TIMING = r"Ray Tracing Time: +([0-9.]+) seconds"

UNIT = 2.0**-10  # what a length of 1 becomes: Tachyon's tolerance is absolute and suits this scale
TOLERANCE = 1e-9 / UNIT  # a mirrored ray starts so far ahead, and no ray sees what is nearer to its start
FAINTEST = 0.001959  # coefficients up to this count as 0
DIMMED = 2.0**-20  # the light's colour, while its strength is the inverse: so no cosine is too faint
UNTINTED = 2.0**-30  # stands for 0 in the tint, which the light's colour undoes
FAR = 2.0**21  # where a slanting mirror ends: farther away it would by rounding see itself, instead of nothing
ENDLESS = 2.0**30  # where a triangle ends that stands for a plane
LIMITS = Limits(precision=2.0**-30, gap=2 * TOLERANCE, far=ENDLESS)
SHADOWLESS = 0.999  # opacity of what looks opaque but casts no shadow

# What Tachyon carries, found by comparing pictures.
DEEPEST = 4096  # bounces: each takes up stack
FARTHEST = 1e7  # of a sphere
FARTHEST_PLANE = 1e8
LIGHT_GAP = 1e-5  # between a surface and the light
PARALLEL = 0.01  # radians between a slanting mirror and any other plane

HEADER = """\
# {title}
# Run: {command}
# Tachyon's own program draws nearly the same, with fewer digits and from 0 to 1 only:
#   tachyon scene.dat -format PPM48 -o scene.ppm
# The colours are linear: 1 is level 255. The scene as the assignment writes it:
#
{source}
BEGIN_SCENE
RESOLUTION {width} {height}
SHADER_MODE FULL SHADOW_FILTER_OFF END_SHADER_MODE

# The primary ray and {depth} bounces. The frustum is half a pixel off, since Tachyon counts pixels from 1.
CAMERA
  PROJECTION PERSPECTIVE
  ZOOM 1
  ASPECTRATIO 1
  ANTIALIASING 0
  RAYDEPTH {levels}
  CENTER {eye}
  VIEWDIR 0 0 1
  UPDIR 0 1 0
  FRUSTUM {frustum}
END_CAMERA

BACKGROUND 0 0 0

# Bright by its attenuation and as much too dark by its colour: Tachyon leaves out light below 1/512.
# AMBIENT is one number, so that the ambient colour is part of each surface's, and the light's undoes it.
LIGHT CENTER {light} RAD 0
  ATTENUATION CONSTANT {dimmed} LINEAR 0 QUADRATIC 0 COLOR {light_colour}

# Of surfaces at the same distance Tachyon takes the one listed last: they come in reverse order.
"""
NOTES = (
    "Tachyon's program reads single precision and writes 16 bits, its library keeps all: draw.py uses the library.",
    "Where the light is inside a sphere or behind a plane, nothing there is lit: DIFFUSE is 0.",
)


def export(scene: Scene, settings: Settings) -> Export:
    """A scene file, drawn in one pass, and the Python program that draws it."""
    spheres, planes = distinct_spheres(scene), distinct_planes(scene)
    _refuse(spheres, planes, settings)
    options = ("--unit", number(UNIT), "--threads", str(settings.threads))
    command = (PYTHON, "draw.py", "scene.dat", "scene.exr", *options)
    paint = _paint(scene)
    parts = [_header(scene, settings, " ".join(command), paint)]
    parts += [_sphere(name, sphere, paint) for name, sphere in reversed(spheres.items())]
    parting = _parting(spheres, planes)
    far = max([FAR, *(16 * _reach(sphere) for sphere in spheres.values())])
    for name, plane in reversed(planes.items()):
        behind = parting == [name] and _is_lit(plane)
        ends = _slants(plane) and (behind or (settings.depth > 0 and plane.reflection != 0))
        parts.append(_plane(name, plane, paint, behind, far if ends else ENDLESS))
    program = resources.files(__name__).joinpath("draw.py").read_text(encoding="utf-8")
    files = {"scene.dat": "\n".join([*parts, "END_SCENE\n"]), "draw.py": program}
    return Export(files, command, "scene.exr", NOTES, limits=LIMITS)


def _refuse(spheres: dict[str, Sphere], planes: dict[str, Plane], settings: Settings) -> None:
    if settings.depth > DEEPEST:
        raise Unsupported(f"Tachyon follows at most {DEEPEST} bounces, not {settings.depth}")
    for name, sphere in spheres.items():
        _refuse_place(name, _reach(sphere), FARTHEST, _comes_before_screen(sphere))
        _refuse_light_gap(name, math.dist(sphere.centre, LIGHT) - sphere.radius)
    for name, plane in planes.items():
        _refuse_place(name, abs(plane.distance_from(EYE)), FARTHEST_PLANE, _passes_before_screen(plane))
        if gap := plane.distance_from(LIGHT):
            _refuse_light_gap(name, gap)
    parting = _parting(spheres, planes)
    around = spheres.get(parting[0]) if len(parting) == 1 else None
    if around and around.diffuse and _holds(around, EYE):
        raise Unsupported(f"Tachyon darkens spheres seen from within: {parting[0]} holds the eye and not the light")
    if settings.depth > 0:
        _refuse_mirrors(spheres, planes, settings)


def _refuse_mirrors(spheres: dict[str, Sphere], planes: dict[str, Plane], settings: Settings) -> None:
    surfaces: dict[str, Sphere | Plane] = {**spheres, **planes}
    if not any(surface.reflection for surface in surfaces.values()):
        return
    for name, surface in surfaces.items():
        if surface.reflection and surface.reflection <= FAINTEST:
            raise Unsupported(f"Tachyon leaves out reflections under 1/512: {name} has {surface.reflection:g}")
    for one, two in _edges_on_rays(spheres, settings):
        raise Unsupported(f"Tachyon darkens spheres seen from within: rays get in at the edge of {one} and {two}")
    for name, plane in planes.items():
        if _is_lit(plane) and not plane.distance_from(EYE):
            raise Unsupported(f"Tachyon darkens planes seen from their back: mirrors may show both sides of {name}")
    for (one, plane), (two, other) in permutations(planes.items(), 2):
        turned = math.hypot(*_cross(plane.unit_normal, other.unit_normal))
        if plane.reflection and _slants(plane) and turned < PARALLEL:
            raise Unsupported(f"Tachyon's slanting mirrors end far away: {one} shows {two} even there")


def _refuse_place(name: str, farthest: float, most: float, before_screen: bool) -> None:
    if farthest > most:
        raise Unsupported(f"Tachyon's rays stray beyond {most:g}: {name} reaches farther")
    if before_screen:
        raise Unsupported(f"Tachyon's camera sees what is before the screen: {name} comes into its view there")


def _refuse_light_gap(name: str, gap: float) -> None:
    if abs(gap) < LIGHT_GAP:
        raise Unsupported(f"Tachyon decides by rounding whether {name} hides the light, which is {abs(gap):g} from it")


def _comes_before_screen(sphere: Sphere) -> bool:
    """Whether the sphere meets the pyramid of the eye and the screen, which may also be inside it as a whole."""
    slope = SCREEN / SCREEN_DISTANCE
    x, y, z = abs(sphere.centre[0]), abs(sphere.centre[1]), sphere.centre[2]

    def distance(depth: float) -> float:
        """From the centre to the pyramid's part at that z."""
        return math.hypot(max(x - slope * depth, 0), max(y - slope * depth, 0), z - depth)

    # The square of the distance is a convex chain of parabolas in z: its least value is at the bottom of one of them.
    sides: tuple[tuple[float, ...], ...] = ((), (x,), (y,), (x, y))
    bottoms = [(z + slope * sum(active)) / (1 + slope * slope * len(active)) for active in sides]
    nearest = min(distance(min(max(depth, 0), SCREEN_DISTANCE)) for depth in bottoms)
    corners = [(a, b, SCREEN_DISTANCE) for a in (-SCREEN, SCREEN) for b in (-SCREEN, SCREEN)]
    return nearest < sphere.radius and not all(_holds(sphere, point) for point in (EYE, *corners))


def _passes_before_screen(plane: Plane) -> bool:
    """Whether rays of the camera meet the plane on the screen or before it."""
    normal, offset = plane.unit_normal, plane.distance_from(EYE)
    middle = SCREEN_DISTANCE * normal[2]  # n.d over the screen is middle -+ spread; the plane is met at offset / n.d
    spread = SCREEN * (abs(normal[0]) + abs(normal[1]))
    return offset != 0 and (middle + spread >= offset if offset > 0 else middle - spread <= offset)


def _parting(spheres: dict[str, Sphere], planes: dict[str, Plane]) -> list[str]:
    """The surfaces between eye and light, which no ray crosses: several leave all unlit, one all but itself."""
    parting = [name for name, sphere in spheres.items() if _holds(sphere, EYE) != _holds(sphere, LIGHT)]
    for name, plane in planes.items():
        eye, light = plane.distance_from(EYE), plane.distance_from(LIGHT)
        if min(eye, light) < 0 < max(eye, light):
            parting.append(name)
    return parting


def _holds(sphere: Sphere, point: Triple) -> bool:
    return math.dist(sphere.centre, point) < sphere.radius


def _reach(sphere: Sphere) -> float:
    return math.hypot(*sphere.centre) + sphere.radius


def _is_lit(plane: Plane) -> bool:
    """Whether the light is on the side that the normal points to, and has an effect there."""
    return plane.diffuse != 0 and plane.distance_from(LIGHT) < 0


def _slants(plane: Plane) -> bool:
    """Whether points far away on the plane are off it by rounding."""
    return sum(map(bool, plane.normal)) > 1


def _edges_on_rays(spheres: dict[str, Sphere], settings: Settings) -> Iterator[tuple[str, str]]:
    """The mirrors that cut each other in a circle which pixel rays meet exactly, since its plane holds the eye."""
    powers = defaultdict(list)
    for name, sphere in spheres.items():
        powers[sum(exact(value) ** 2 for value in sphere.centre) - exact(sphere.radius) ** 2].append(name)
    for name, other in (pair for names in powers.values() for pair in combinations(names, 2)):
        one, two = spheres[name], spheres[other]
        cut = abs(one.radius - two.radius) < math.dist(one.centre, two.centre) < one.radius + two.radius
        if cut and (one.reflection or two.reflection):
            x, y, z = (exact(b) - exact(a) for a, b in zip(one.centre, two.centre, strict=True))
            if _meets_pixel(x, y, z * exact(SCREEN_DISTANCE) / exact(SCREEN), settings):
                yield name, other


def _meets_pixel(x: Fraction, y: Fraction, z: Fraction, settings: Settings) -> bool:
    """Whether x column + y row + z = 0 for a pixel, its column and row from -1 to 1."""
    columns, rows = ({Fraction(2 * i + 1 - n, n) for i in range(n)} for n in (settings.width, settings.height))
    if not y:
        return -z / x in columns if x else not z
    return any(-(x * column + z) / y in rows for column in columns)


@dataclass(frozen=True)
class _Paint:
    """What all textures share: the ambient light, and the tint of every surface that makes it one number."""

    ambient: float
    tint: Triple

    def texture(self, surface: Sphere | Plane, diffuse: float, opacity: float = 1, mirrors: bool = True) -> str:
        """The texture; a diffuse coefficient that Tachyon would ignore goes into the colour."""
        share = diffuse if diffuse and diffuse <= FAINTEST else 1.0
        colour = [value / 255 * tint * share for value, tint in zip(surface.colour, self.tint, strict=True)]
        return (
            f"TEXTURE AMBIENT {single(self.ambient / share)} DIFFUSE {single(diffuse / share)}"
            f" SPECULAR {single(surface.reflection if mirrors else 0)} OPACITY {opacity:g}"
            f" COLOR {' '.join(map(single, colour))} TEXFUNC 0"
        )


def _paint(scene: Scene) -> _Paint:
    red, green, blue = (value * scene.ambient_coefficient / 256 for value in scene.ambient)
    ambient = max(red, green, blue, key=abs)
    if not ambient:
        return _Paint(0.0, (1.0, 1.0, 1.0))
    tint = [value / ambient for value in (red, green, blue)]
    red, green, blue = (value if abs(value) > UNTINTED else UNTINTED for value in tint)
    return _Paint(ambient, (red, green, blue))


def _header(scene: Scene, settings: Settings, command: str, paint: _Paint) -> str:
    frustum = [side - 0.5 / size for size in (settings.width, settings.height) for side in (-0.5, 0.5)]
    return HEADER.format(
        title="A scene of the recursive ray tracing assignment, for Tachyon 0.99",
        command=command,
        source=source(scene, "#   "),
        width=settings.width,
        height=settings.height,
        depth=settings.depth,
        levels=settings.depth + 1,
        eye=_spaced(EYE),
        frustum=_spaced(frustum),
        light=_spaced(LIGHT),
        dimmed=number(DIMMED),
        light_colour=" ".join(single(DIMMED / value) for value in paint.tint),
    )


def _sphere(name: str, sphere: Sphere, paint: _Paint) -> str:
    diffuse = 0.0 if _holds(sphere, LIGHT) else sphere.diffuse
    shape = f"SPHERE CENTER {_spaced(sphere.centre)} RAD {number(sphere.radius)}"
    return f"# {name}\n{shape}\n  {paint.texture(sphere, diffuse)}\n"


def _plane(name: str, plane: Plane, paint: _Paint, behind: bool, end: float) -> str:
    """A plane, or up to `end` a disk, or a triangle if it is lit `behind`; what is farther away mirrors nothing."""
    diffuse = plane.diffuse if _is_lit(plane) else 0.0
    opacity = 1 if plane.distance_from(LIGHT) else SHADOWLESS
    normal = plane.unit_normal
    foot = [value * plane.distance_from(EYE) + 0.0 for value in normal]  # never -0.0
    place = f"CENTER {_spaced(foot)} NORMAL {_spaced(normal)}"
    if behind:
        shape = _triangle(plane, foot, end)
    else:
        shape = f"PLANE {place}" if end == ENDLESS else f"RING {place} INNER -1 OUTER {number(end)}"
    text = f"# {name}\n{shape}\n  {paint.texture(plane, diffuse, opacity)}\n"
    if end == ENDLESS:
        return text
    rest = f"RING {place} INNER {number(end)} OUTER {number(end * ENDLESS)}"
    return f"{text}# {name}, far away\n{rest}\n  {paint.texture(plane, diffuse, opacity, mirrors=False)}\n"


def _triangle(plane: Plane, foot: Iterable[float], radius: float) -> str:
    """A triangle around a circle. Its corners turn away from the normal, which Tachyon then keeps for its back."""
    normal, (across, along) = plane.unit_normal, plane.tangents
    corners = [
        [f + radius * (a * u + b * v) for f, u, v in zip(foot, across, along, strict=True)]
        for a, b in ((-2, -1), (0, 2), (2, -1))
    ]
    places = " ".join(f"V{index} {_spaced(corner)}" for index, corner in enumerate(corners))
    return f"STRI {places} " + " ".join(f"N{index} {_spaced(normal)}" for index in range(3))


def _cross(a: Iterable[float], b: Iterable[float]) -> Triple:
    (x, y, z), (u, v, w) = a, b
    return (y * w - z * v, z * u - x * w, x * v - y * u)


def _spaced(values: Iterable[float]) -> str:
    return " ".join(map(number, values))
