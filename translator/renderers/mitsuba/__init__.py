"""Mitsuba 3: stock shapes, materials, light, sensor and film in XML; the integrator is ours (`whitted.py` here)."""

from __future__ import annotations

import math
from importlib import resources
from typing import Any

from reference.scene import (
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
from translator.contract import PYTHON, Export, Settings, Unsupported, number

TITLE = "Mitsuba 3"
INSTALL = "pip install mitsuba"
VERSION = ((PYTHON, "-c", "import importlib.metadata as m; print('mitsuba', m.version('mitsuba'))"), r"mitsuba (\S+)")
TIMING = r"traced in ([0-9.e-]+) s"

MIRROR_SHARE = 1 - 2.0**-23  # of the blended BSDF: the rest is the smallest share that float32 keeps apart
PLANE_RADIUS = 1e9  # a plane is a disk of this radius
DEEPEST = 16  # bounces: beyond, single precision rays between mirrors stray too far
LIGHT_GAP = 0.5  # shadow rays end a little before the light, by less than this
FARTHEST = 1e6  # single precision: beyond, hit points are off by more than a tenth of a unit
LARGEST_RADIUS = 2000  # single precision: the surface of a larger sphere shades itself

HEADER = """\
<!-- A scene of the recursive ray tracing assignment, for Mitsuba 3.
     Run: {command}
     The picture is linear: 1.0 is level 255. -->
<scene version="3.0.0">
  <integrator type="whitted">
    <integer name="max_depth" value="{depth}"/>
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
    spheres = {f"sphere {place}": sphere for place, sphere in distinct_spheres(scene).items()}
    planes = {f"plane {place}": plane for place, plane in distinct_planes(scene).items()}
    _refuse(spheres, planes, settings)
    command = (PYTHON, "whitted.py", "scene.xml", "scene.exr")
    header = HEADER.format(
        command=" ".join(command),
        depth=settings.depth,
        stretch=settings.width / settings.height,
        fov=math.degrees(2 * math.atan(SCREEN / SCREEN_DISTANCE)),
        distance=SCREEN_DISTANCE,
        width=settings.width,
        height=settings.height,
        light=_spaced(LIGHT),
        intensity=_spaced([math.pi] * 3),
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
    return Export(files, (*command, "--time"), "scene.exr", notes)


def _refuse(spheres: dict[str, Sphere], planes: dict[str, Plane], settings: Settings) -> None:
    """Single precision bounds how deep, how far and how near the light a scene may go."""
    coarse = "Mitsuba's single precision is too coarse"
    if settings.depth > DEEPEST:
        raise Unsupported(f"{coarse} for {settings.depth} bounces (at most {DEEPEST})")
    offsets = {name: _dot(plane.unit_normal, plane.point) for name, plane in planes.items()}
    reach = {name: max(map(abs, sphere.centre)) + sphere.radius for name, sphere in spheres.items()}
    reach |= {name: abs(offset) for name, offset in offsets.items()}
    for name, distance in reach.items():
        if not distance <= FARTHEST:
            raise Unsupported(f"{coarse} beyond {FARTHEST:g}: {name} reaches {distance:g}")
    for name, sphere in spheres.items():
        if sphere.radius > LARGEST_RADIUS:
            raise Unsupported(f"{coarse} for a radius over {LARGEST_RADIUS}: {name} has {sphere.radius:g}")
    gaps = {name: math.dist(sphere.centre, LIGHT) - sphere.radius for name, sphere in spheres.items()}
    gaps |= {name: _dot(plane.unit_normal, LIGHT) - offsets[name] for name, plane in planes.items()}
    for name, gap in gaps.items():
        if abs(gap) < LIGHT_GAP:
            short = f"Mitsuba's shadow rays end {LIGHT_GAP:g} short of the light"
            raise Unsupported(f"{short}: {name} passes within {abs(gap):g}")


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
    centre = f'<point name="center" value="{_spaced(sphere.centre)}"/>'
    return f'{centre}\n    <float name="radius" value="{number(sphere.radius)}"/>'


def _frame(plane: Plane) -> str:
    """The unit disk, widened and turned by a rotation of full precision (`lookat` would lose digits of the normal)."""
    normal = plane.unit_normal
    axis = [float(index == min(range(3), key=lambda i: abs(normal[i]))) for index in range(3)]
    across = _unit(_cross(axis, normal))
    along = _cross(normal, across)
    rows = [
        [PLANE_RADIUS * u, PLANE_RADIUS * v, n, p]
        for u, v, n, p in zip(across, along, normal, plane.point, strict=True)
    ]
    matrix = "  ".join(_spaced(row) for row in [*rows, [0.0, 0.0, 0.0, 1.0]])
    return f'<transform name="to_world"><matrix value="{matrix}"/></transform>'


def _constant(name: str, values: list[float]) -> str:
    return f'<texture type="rawconstant" name="{name}"><vector name="value" value="{_spaced(values)}"/></texture>'


def _cross(a: Any, b: Any) -> Triple:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _unit(a: Triple) -> Triple:
    length = math.hypot(*a)
    return (a[0] / length, a[1] / length, a[2] / length)


def _spaced(values: Any) -> str:
    return " ".join(map(number, values))


def _dot(a: Triple, b: Triple) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
