"""Mitsuba 3: stock shapes, materials, light, sensor and film in XML; the integrator is ours (`whitted.py` here)."""

from __future__ import annotations

import math
from importlib import resources

from reference.scene import (
    EYE,
    LIGHT,
    SCREEN,
    SCREEN_DISTANCE,
    Plane,
    Scene,
    Sphere,
    distinct_planes,
    distinct_spheres,
)
from translator.contract import PYTHON, Export, Limits, Settings, Unsupported, number, single, source, spaced
from translator.likeness import find_alike

TITLE = "Mitsuba 3"
LICENCE = "BSD-3-Clause"
INSTALL = "pip install mitsuba"
VERSION = ((PYTHON, "-c", "import importlib.metadata as m; print('mitsuba', m.version('mitsuba'))"), r"mitsuba (\S+)")
TIMING = r"traced in ([0-9.e-]+) s"

MIRROR_SHARE = 1 - 2.0**-23  # of the blended BSDF: the rest is the smallest share that float32 keeps apart
PLANE_RADIUS = 1e9  # a plane is a disk of this radius
BESIDE = 1 + 2.0**-20  # stretches the picture where rays run within a plane through the eye: by rounding they meet it
# Single precision, as it adds up in interval arithmetic; rays start ahead by 1e-4 of the way to the light.
LIMITS = Limits(precision=2.0**-20, gap=0.1, far=0.9 * PLANE_RADIUS)
# What single precision carries, found by comparing pictures.
COARSE = "Mitsuba's single precision is too coarse"
DEEPEST = 16  # bounces
MANY_BALLS = 20  # that mirror each other: each magnifies the error, and more ways lead between more of them
DEEPEST_BETWEEN_MANY = 5  # bounces
FARTHEST = 1e6  # of a sphere
FARTHEST_PLANE = 1e4  # slanting rays meet it much farther away
LARGEST_RADIUS = 2000  # the surface of a larger sphere shades itself
SPHERE_LIGHT_GAP = 25  # grazing shadow rays end that much before the light
PLANE_LIGHT_GAP = 1
APART = 1e-3  # between surfaces that look alike

HEADER = """\
<!-- A scene of the recursive ray tracing assignment, for Mitsuba 3.
     Run: {command}
     The picture is linear: 1.0 is level 255. The scene as the assignment writes it:

{source}-->
<scene version="3.0.0">
  <integrator type="whitted">
    <integer name="max_depth" value="{depth}"/>
    <!-- The height of a pixel over its width; 1 + 2^-20 times that if a slanting plane goes through the eye, as rays
         that run within the plane would meet it by rounding. -->
    <float name="stretch" value="{stretch}"/>
  </integrator>

  <!-- Rays start on the screen, at z = {distance}; x points right. -->
  <sensor type="perspective">
    <float name="fov" value="{fov}"/>
    <string name="fov_axis" value="x"/>
    <float name="near_clip" value="{distance}"/>
    <float name="far_clip" value="1e30"/>
    <transform name="to_world">
      <scale x="-1"/>
      <lookat origin="0, 0, 0" target="0, 0, 1" up="0, 1, 0"/>
    </transform>
    <sampler type="stratified">
      <integer name="sample_count" value="1"/>
      <boolean name="jitter" value="false"/>
    </sampler>
    <film type="hdrfilm">
      <integer name="width" value="{width}"/>
      <integer name="height" value="{height}"/>
      <string name="pixel_format" value="rgb"/>
      <string name="component_format" value="float32"/>
      <rfilter type="box"/>
    </film>
  </sensor>

  <emitter type="point">
    <point name="position" value="{light}"/>
    <rgb name="intensity" value="{intensity}"/>
  </emitter>
"""

SURFACE = """
  <shape type="{shape}" id="{name}">
    {geometry}
    <bsdf type="blendbsdf">
      <float name="weight" value="{share}"/>
      <bsdf type="diffuse">{diffuse}</bsdf>
      <bsdf type="conductor">
        <string name="material" value="none"/>
        {mirror}
      </bsdf>
    </bsdf>
    <emitter type="area">{ambient}</emitter>
  </shape>
"""


def export(scene: Scene, settings: Settings) -> Export:
    """A scene file in XML and the Python program with the integrator, which draws it."""
    spheres, planes = distinct_spheres(scene), distinct_planes(scene)
    _refuse(spheres, planes, settings)
    command = (PYTHON, "whitted.py", "scene.xml", "scene.exr")
    header = HEADER.format(
        command=" ".join(command),
        source=source(scene, "     "),
        depth=settings.depth,
        stretch=settings.width / settings.height * (BESIDE if any(map(_slants_through_eye, planes.values())) else 1),
        fov=math.degrees(2 * math.atan(SCREEN / SCREEN_DISTANCE)),
        distance=SCREEN_DISTANCE,
        width=settings.width,
        height=settings.height,
        light=spaced(LIGHT),
        intensity=spaced([math.pi] * 3),
    )
    light = [value * scene.ambient_coefficient / 256 for value in scene.ambient]
    shapes = [_surface(name, "sphere", _ball(sphere), sphere, light) for name, sphere in spheres.items()]
    shapes += [_surface(name, "disk", _frame(plane), plane, light) for name, plane in planes.items()]
    program = resources.files(__name__).joinpath("whitted.py").read_text(encoding="utf-8")
    files = {"scene.xml": "".join([header, *shapes, "</scene>\n"]), "whitted.py": program}
    notes = (
        "Diffuse and mirror are one blended BSDF: a share of 2^-23 for diffuse, whose reflectance is scaled by 2^23.",
        "Ambient light is emission. Planes are disks of radius 1e9.",
    )
    return Export(files, (*command, "--threads", str(settings.threads), "--time"), "scene.exr", notes, limits=LIMITS)


def _refuse(spheres: dict[str, Sphere], planes: dict[str, Plane], settings: Settings) -> None:
    """Single precision bounds how deep, how far, how close together and how near the light a scene may go."""
    balls = sum(sphere.reflection != 0 for sphere in spheres.values())
    deepest, between = DEEPEST, ""
    if balls >= MANY_BALLS:
        deepest, between = DEEPEST_BETWEEN_MANY, f" between {balls} mirroring spheres"
    if settings.depth > deepest:
        raise Unsupported(f"{COARSE} for {settings.depth} bounces{between} (at most {deepest})")
    for name, sphere in spheres.items():
        if max(map(abs, sphere.centre)) + sphere.radius > FARTHEST:
            raise Unsupported(f"{COARSE} beyond {FARTHEST:g}: {name} reaches farther")
        if sphere.radius > LARGEST_RADIUS:
            raise Unsupported(f"{COARSE} for a radius over {LARGEST_RADIUS}: {name} has {sphere.radius:g}")
        if abs(gap := math.dist(sphere.centre, LIGHT) - sphere.radius) < SPHERE_LIGHT_GAP:
            raise Unsupported(f"{COARSE} within {SPHERE_LIGHT_GAP} of the light: {name} passes at {abs(gap):g}")
    for name, plane in planes.items():
        x, y, z = plane.unit_normal
        offset = plane.distance_from(EYE)
        if abs(offset) > FARTHEST_PLANE:
            raise Unsupported(f"{COARSE} beyond {FARTHEST_PLANE:g}: {name} is {abs(offset):g} from the eye")
        if abs(gap := plane.distance_from(LIGHT)) < PLANE_LIGHT_GAP:
            raise Unsupported(f"{COARSE} within {PLANE_LIGHT_GAP} of the light: {name} passes at {abs(gap):g}")
        if abs(x) + abs(y) < APART / SCREEN and abs(offset - SCREEN_DISTANCE * z) < APART:
            raise Unsupported(f"{COARSE} to tell {name} from the screen")
    if pair := find_alike(spheres, planes, APART):
        raise Unsupported(f"{COARSE} to tell {pair[0]} from {pair[1]}")


def _slants_through_eye(plane: Plane) -> bool:
    return sum(map(bool, plane.normal)) > 1 and not plane.distance_from(EYE)


def _surface(name: str, shape: str, geometry: str, surface: Sphere | Plane, light: list[float]) -> str:
    colour = [value / 255 for value in surface.colour]
    return SURFACE.format(
        shape=shape,
        name=name.replace(" ", "-"),
        geometry=geometry,
        share=MIRROR_SHARE,
        diffuse=_constant("reflectance", [surface.diffuse * value / (1 - MIRROR_SHARE) for value in colour]),
        mirror=_constant("specular_reflectance", [surface.reflection / MIRROR_SHARE] * 3),
        ambient=_constant("radiance", [a * b for a, b in zip(light, colour, strict=True)]),
    )


def _ball(sphere: Sphere) -> str:
    centre = f'<point name="center" value="{spaced(sphere.centre)}"/>'
    return f'{centre}\n    <float name="radius" value="{number(sphere.radius)}"/>'


def _frame(plane: Plane) -> str:
    """The unit disk, widened and turned by a rotation of full precision (`lookat` would lose digits of the normal)."""
    normal, offset = plane.unit_normal, plane.distance_from(EYE)
    centre = [value * offset + 0.0 for value in normal]  # nearest the eye; never -0.0
    widened = ([PLANE_RADIUS * value for value in axis] for axis in plane.tangents)
    rows = [list(row) for row in zip(*widened, normal, centre, strict=True)]
    matrix = "  ".join(spaced(row) for row in [*rows, [0.0, 0.0, 0.0, 1.0]])
    return f'<transform name="to_world"><matrix value="{matrix}"/></transform>'


def _constant(name: str, values: list[float]) -> str:
    value = " ".join(map(single, values))
    return f'<texture type="rawconstant" name="{name}"><vector name="value" value="{value}"/></texture>'
