"""Mitsuba 3 as it is: plain XML of stock plugins for its own command, with nothing of ours inside.

The integrator `path` follows mirrors and samples the light, but not as the assignment counts: emission is found one
bounce deeper than light from a lamp. So ambient light (as emission) and the lamp's are drawn apart, and a third scene
adds the two pictures. A lamp's light falls off with the square of the distance r, for which the diffuse reflectance
makes up: on a sphere r^2 is linear along the axis that points to the light; on a plane it is the sum of the squares of
two coordinates and a constant. A volume that is linear along one axis and blended BSDFs are enough for both.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from importlib import resources
from typing import Any

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
)
from translator.contract import PYTHON, Export, Limits, Settings, Unsupported, number, single, source

TITLE = "Mitsuba 3, stock"
LICENCE = "BSD-3-Clause"
INSTALL = "pip install mitsuba"
VERSION = ((PYTHON, "-c", "import importlib.metadata as m; print('mitsuba', m.version('mitsuba'))"), r"mitsuba (\S+)")
TIMING = r"traced in ([0-9.e-]+) s"

ORIGIN = (0.0, -100.0, 250.0)  # what becomes (0, 0, 0): rays start ahead in proportion to their coordinates there
MIRROR_SHARE = 1 - 2.0**-23  # of the blended BSDF: the rest is the smallest share that float32 keeps apart
DIMMED = 2.0**-60  # the diffuse reflectance, and the lamp is as much brighter: mirrored light then finds it black
PLANE_RADIUS = 1e9  # a plane is a disk of this radius
REACH = 2.0**10  # how far along a plane r^2 is right, as a multiple of the light's distance from it
# Three cells in a row, of values 2, 0 and 2, as Mitsuba's format for volumes: a valley with straight slopes. A weight
# of 1 is half a cell from its middle. The bounds after the sizes are unused.
VALLEY = struct.pack("<3sB5i6f3f", b"VOL", 3, 1, 3, 1, 1, 1, 0, 0, 0, 2, 2, 2, 2, 0, 2).decode("ascii") + "\n"
VALLEY_SIZE = 6  # of the row, as a multiple of the distance at which the weight is 1
CORNERS = [(x, y, SCREEN_DISTANCE) for x in (-SCREEN, SCREEN) for y in (-SCREEN, SCREEN)]
SCENES = ("ambient.xml", "light.xml", "scene.xml")

RAY_EPSILON = 1500 * 2.0**-24  # rays start ahead of a point by this times 1 + its largest coordinate, along the normal

# What Mitsuba carries: one side of each surface, in single precision.
COARSE = "Mitsuba's single precision is too coarse"
DEEPEST_BETWEEN_BALLS = 4  # bounces, where several spheres mirror each other and each magnifies the error
FARTHEST = 1e6  # of a sphere
LARGEST_RADIUS = 2000
APART = 1e-3  # between a surface and the screen
LIGHT_GAP = 10  # between a surface and the light
# Single precision, as it adds up in interval arithmetic.
LIMITS = Limits(precision=2.0**-20, far=0.9 * PLANE_RADIUS, ahead=RAY_EPSILON, origin=ORIGIN)

HEADER = """\
<!-- {title}
     Run: mitsuba -m scalar_rgb {scenes}
     The picture is scene.pfm, linear: 1.0 is level 255. The scene as the assignment writes it:

{source}
     The world is moved by {shift}, so that coordinates are small. -->
<scene version="3.0.0">
  <integrator type="path">
    <integer name="max_depth" value="{depth}"/>
    <integer name="rr_depth" value="1000000000"/>
  </integrator>

  <!-- Rays start on the screen, at a distance of {distance}; x points right. -->
  <sensor type="perspective">
    <float name="fov" value="{fov}"/>
    <float name="near_clip" value="{distance}"/>
    <float name="far_clip" value="1e30"/>
    <transform name="to_world">
      <scale x="-1"/>
      <lookat origin="0, 0, 0" target="0, 0, 1" up="0, 1, 0"/>
      <translate value="{shift}"/>
    </transform>
{film}
  </sensor>
"""

FILM = """\
    <sampler type="stratified">
      <integer name="sample_count" value="1"/>
      <boolean name="jitter" value="false"/>
    </sampler>
    <film type="hdrfilm">
      <integer name="width" value="{width}"/>
      <integer name="height" value="{height}"/>
      <string name="file_format" value="pfm"/>
      <string name="pixel_format" value="rgb"/>
      <string name="component_format" value="float32"/>
      <rfilter type="box"/>
    </film>"""

LAMP = """
  <!-- As bright as the diffuse reflectances are dark. -->
  <emitter type="point">
    <point name="position" value="{light}"/>
    <rgb name="intensity" value="{intensity}"/>
  </emitter>
"""

GLOWING = """
  <shape type="{shape}" id="{name}">
    {geometry}
    {mirror}
    <emitter type="area">{ambient}</emitter>
  </shape>
"""

LIT = """
  <shape type="{shape}" id="{name}">
    {geometry}
    <bsdf type="blendbsdf">
      <float name="weight" value="{share}"/>
      {diffuse}
      {mirror}
    </bsdf>
  </shape>
"""

SUM = """\
<!-- The sum of two pictures: each glows on a rectangle that lets the other through.
     Mitsuba writes PFM upside down; adding turns the pictures over once more. -->
<scene version="3.0.0">
  <integrator type="path">
    <integer name="max_depth" value="2"/>
  </integrator>
  <sensor type="orthographic">
    <transform name="to_world">
      <lookat origin="0, 0, 2" target="0, 0, 0" up="0, 1, 0"/>
    </transform>
{film}
  </sensor>
{pictures}</scene>
"""

PICTURE = """
  <shape type="rectangle">
    <transform name="to_world">
      <translate z="{height}"/>
    </transform>
    <bsdf type="null"/>
    <emitter type="area">
      <texture type="bitmap" name="radiance">
        <string name="filename" value="{name}"/>
        <string name="filter_type" value="nearest"/>
        <boolean name="raw" value="true"/>
      </texture>
    </emitter>
  </shape>
"""
NOTES = (
    "Three scenes for one command: ambient light (as emission), the lamp's light, and the sum of their pictures.",
    "The lamp's falloff r^2 is undone by diffuse reflectances: volumes that are linear along an axis blend constants.",
    "Diffuse and mirror are one blended BSDF: a share of 2^-23 for diffuse, whose reflectance is scaled by 2^23.",
    "Planes are disks of radius 1e9. `draw.py` only runs Mitsuba's command, of the same Python, and adds up the times.",
)


def export(scene: Scene, settings: Settings) -> Export:
    """Three scene files in XML, a volume, and the Python program that runs Mitsuba's command on them."""
    spheres, planes = distinct_spheres(scene), distinct_planes(scene)
    _refuse(spheres, planes, settings)
    surfaces: dict[str, Sphere | Plane] = {**spheres, **planes}
    film = FILM.format(width=settings.width, height=settings.height)
    ambient = [value * scene.ambient_coefficient / 256 for value in scene.ambient]
    glowing = [_glowing(name, surface, ambient) for name, surface in surfaces.items()]
    lamp = LAMP.format(light=_spaced(_moved(LIGHT)), intensity=_spaced([math.pi / DIMMED] * 3))
    lit = [lamp, *(_lit(name, surface) for name, surface in surfaces.items())]
    pictures = [PICTURE.format(name=name, height=height) for name, height in (("ambient.pfm", 1), ("light.pfm", 0))]
    program = resources.files(__name__).joinpath("draw.py").read_text(encoding="utf-8")
    files = {
        "ambient.xml": _scene("Ambient light and its reflections", scene, settings.depth + 1, film, glowing),
        "light.xml": _scene("The lamp's light and its reflections", scene, settings.depth + 2, film, lit),
        "scene.xml": SUM.format(film=film, pictures="".join(pictures)),
        "distance.vol": VALLEY,
        "draw.py": program,
    }
    command = (PYTHON, "draw.py", *SCENES, "--threads", str(settings.threads))
    return Export(files, command, "scene.pfm", NOTES, limits=LIMITS)


def _refuse(spheres: dict[str, Sphere], planes: dict[str, Plane], settings: Settings) -> None:
    if settings.width != settings.height:
        raise Unsupported("Mitsuba's camera has square pixels, so that a square screen needs a square picture")
    balls = sum(sphere.reflection != 0 for sphere in spheres.values())
    if balls > 1 and settings.depth > DEEPEST_BETWEEN_BALLS:
        raise Unsupported(
            f"{COARSE} for {settings.depth} bounces between {balls} mirroring spheres (at most {DEEPEST_BETWEEN_BALLS})"
        )
    for name, sphere in spheres.items():
        if math.hypot(*sphere.centre) + sphere.radius > FARTHEST:
            raise Unsupported(f"{COARSE} beyond {FARTHEST:g}: {name} reaches farther")
        if sphere.radius > LARGEST_RADIUS:
            raise Unsupported(f"{COARSE} for a radius over {LARGEST_RADIUS}: {name} has {sphere.radius:g}")
        _refuse_sides(name, sphere, *_distances_from_screen(sphere))
        _refuse_light_gap(name, math.dist(sphere.centre, LIGHT) - sphere.radius)
    for name, plane in planes.items():
        sides = [-plane.distance_from(corner) for corner in CORNERS]
        _refuse_sides(name, plane, min(sides), max(sides))
        if gap := plane.distance_from(LIGHT):
            _refuse_light_gap(name, gap)


def _refuse_light_gap(name: str, gap: float) -> None:
    """Shadow rays end before the light, by 0.09 % of the way."""
    if abs(gap) < LIGHT_GAP:
        raise Unsupported(f"Mitsuba's shadow rays end short of the light: {name} passes it at {abs(gap):g}")


def _refuse_sides(name: str, surface: Sphere | Plane, least: float, most: float) -> None:
    """Materials and emitters have one side, so that each surface must be seen from one side, and not lit on the other.

    `least` and `most` are the distances of the screen's points from the surface, negative at its back.
    """
    if least < APART and most > -APART:
        raise Unsupported(f"Mitsuba's emitters have one side: {name} meets the screen, so that both its sides are seen")
    if most < 0 and _is_lit(surface):
        raise Unsupported(f"Mitsuba's materials have one side: {name} is seen from its back and lit in front")


def _distances_from_screen(sphere: Sphere) -> tuple[float, float]:
    x, y, _ = sphere.centre
    nearest = (min(max(x, -SCREEN), SCREEN), min(max(y, -SCREEN), SCREEN), SCREEN_DISTANCE)
    farthest = (math.copysign(SCREEN, -x), math.copysign(SCREEN, -y), SCREEN_DISTANCE)
    return math.dist(sphere.centre, nearest) - sphere.radius, math.dist(sphere.centre, farthest) - sphere.radius


def _scene(title: str, scene: Scene, depth: int, film: str, parts: list[str]) -> str:
    header = HEADER.format(
        title=title,
        scenes=" ".join(SCENES),
        source=source(scene, "     "),
        shift=_spaced(_moved(EYE)),
        depth=depth,
        distance=SCREEN_DISTANCE,
        fov=math.degrees(2 * math.atan(SCREEN / SCREEN_DISTANCE)),
        film=film,
    )
    return "".join([header, *parts, "</scene>\n"])


def _glowing(name: str, surface: Sphere | Plane, ambient: list[float]) -> str:
    """A surface for the picture of ambient light."""
    light = [value / 255 * share for value, share in zip(surface.colour, ambient, strict=True)]
    return GLOWING.format(
        shape=_shape(surface),
        name=name.replace(" ", "-"),
        geometry=_geometry(surface),
        mirror=_mirror(surface.reflection),
        ambient=_constant("radiance", light),
    )


def _lit(name: str, surface: Sphere | Plane) -> str:
    """A surface for the picture of the lamp's light."""
    scale = surface.diffuse / 255 * DIMMED / (1 - MIRROR_SHARE) if _is_lit(surface) else 0.0
    colour = [value * scale for value in surface.colour]
    return LIT.format(
        shape=_shape(surface),
        name=name.replace(" ", "-"),
        geometry=_geometry(surface),
        share=MIRROR_SHARE,
        diffuse="\n      ".join(_diffuse(surface, colour)),
        mirror=_mirror(surface.reflection / MIRROR_SHARE),
    )


def _diffuse(surface: Sphere | Plane, colour: list[float]) -> list[str]:
    """The lines of a BSDF of reflectance colour x r^2, where r is the distance of the lamp."""
    if not any(colour):
        return _matte(colour, 0)
    light = _moved(LIGHT)
    if isinstance(surface, Sphere):
        centre = _moved(surface.centre)
        arm = [a - b for a, b in zip(centre, light, strict=True)]
        distance = math.hypot(*arm)
        axis = [value / distance for value in arm]
        start = [a - surface.radius * b for a, b in zip(centre, axis, strict=True)]
        ends = [(distance - surface.radius) ** 2, (distance + surface.radius) ** 2]
        return _blend(_distance(start, axis, 2 * surface.radius), *(_matte(colour, end) for end in ends))
    gap = surface.distance_from(LIGHT)
    foot = [a + gap * b for a, b in zip(light, surface.unit_normal, strict=True)]
    brightest = max(abs(value * surface.diffuse / 255) for value in surface.colour)
    reach = REACH * max(1.0, brightest) * abs(gap)
    near, far = _matte(colour, gap**2), _matte(colour, gap**2 + 2 * reach**2)
    squares = []
    for tangent in surface.tangents:
        share = _distance(foot, tangent, reach)
        squares.append(_blend(share, near, _blend(share, near, far)))
    return _blend('<float name="weight" value="0.5"/>', *squares)


def _blend(weight: str, one: list[str], other: list[str]) -> list[str]:
    return ['<bsdf type="blendbsdf">', *(f"  {line}" for line in [weight, *one, *other]), "</bsdf>"]


def _matte(colour: list[float], square: float) -> list[str]:
    return [f'<bsdf type="diffuse">{_constant("reflectance", [value * square for value in colour])}</bsdf>']


def _distance(point: Iterable[float], axis: Iterable[float], reach: float) -> str:
    """A weight: the distance from the plane through `point` across `axis`, as a share of `reach`."""
    size = reach * VALLEY_SIZE
    corner = [a - size / 2 * b for a, b in zip(point, axis, strict=True)]
    columns = [[size * value for value in vector] for vector in (axis, *_across(axis))]
    matrix = _matrix(columns, corner)
    return (
        f'<texture type="volume" name="weight"><volume type="gridvolume" name="volume">{matrix}'
        '<string name="filename" value="distance.vol"/><boolean name="raw" value="true"/></volume></texture>'
    )


def _across(axis: Iterable[float]) -> tuple[Triple, Triple]:
    """Two unit vectors that with the unit vector `axis` are a basis."""
    x, y, z = axis
    return Plane((0, 0, 0), EYE, (x, y, z), 0, 0).tangents


def _mirror(reflection: float) -> str:
    reflectance = _constant("specular_reflectance", [reflection] * 3)
    return f'<bsdf type="conductor"><string name="material" value="none"/>{reflectance}</bsdf>'


def _shape(surface: Sphere | Plane) -> str:
    return "sphere" if isinstance(surface, Sphere) else "disk"


def _geometry(surface: Sphere | Plane) -> str:
    flipped = "true" if _is_seen_from_back(surface) else "false"
    flip = f'<boolean name="flip_normals" value="{flipped}"/>'
    if isinstance(surface, Sphere):
        centre = f'<point name="center" value="{_spaced(_moved(surface.centre))}"/>'
        return f'{centre}\n    <float name="radius" value="{number(surface.radius)}"/>\n    {flip}'
    normal, offset = surface.unit_normal, surface.distance_from(ORIGIN)
    widened = [[PLANE_RADIUS * value for value in axis] for axis in surface.tangents]
    return f"{_matrix([*widened, normal], [value * offset + 0.0 for value in normal])}\n    {flip}"  # never -0.0


def _matrix(columns: list[Any], corner: list[float]) -> str:
    rows = [list(row) for row in zip(*columns, corner, strict=True)]
    matrix = "  ".join(_spaced(row) for row in [*rows, [0.0, 0.0, 0.0, 1.0]])
    return f'<transform name="to_world"><matrix value="{matrix}"/></transform>'


def _moved(point: Triple) -> list[float]:
    return [a - b for a, b in zip(point, ORIGIN, strict=True)]


def _is_lit(surface: Sphere | Plane) -> bool:
    """Whether the side that the normal points to has light, if nothing is in its way."""
    if isinstance(surface, Sphere):
        return surface.diffuse != 0 and math.dist(surface.centre, LIGHT) > surface.radius
    return surface.diffuse != 0 and surface.distance_from(LIGHT) < 0


def _is_seen_from_back(surface: Sphere | Plane) -> bool:
    """Whether the screen, where all rays start, is on the side that the normal points away from."""
    if isinstance(surface, Sphere):
        return math.dist(surface.centre, CORNERS[0]) < surface.radius
    return surface.distance_from(CORNERS[0]) > 0


def _constant(name: str, values: list[float]) -> str:
    value = " ".join(map(single, values))
    return f'<texture type="rawconstant" name="{name}"><vector name="value" value="{value}"/></texture>'


def _spaced(values: Iterable[float]) -> str:
    return " ".join(map(number, values))
