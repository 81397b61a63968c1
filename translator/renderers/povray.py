"""POV-Ray: the scene in its scene description language, exactly, diffuse seen from behind and near cut included."""

from __future__ import annotations

import math

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
from translator.contract import Export, Limits, Settings, Unsupported, number, single, source

TITLE = "POV-Ray"
LICENCE = "AGPL-3.0-or-later"
INSTALL = "apt-get install povray"
VERSION = (("povray", "--version"), r"POV-Ray (\d[\w.]*)")
TIMING = r"Trace Time:.*\(([0-9.]+) seconds\)"

UNIT = 0.1  # POV-Ray's tolerances are absolute (1e-4 for reflections, 1e-3 for shadows) and suit this scale
DEEPEST = 255  # bounces: max_trace_level stops at 256
FARTHEST = 1e7 / UNIT  # POV-Ray ignores hits beyond 1e7 of its units
LIMITS = Limits(precision=2.0**-36, gap=1e-3 / UNIT, far=FARTHEST)
FARTHEST_PLANE = 1e5  # of a plane: slanting rays meet it much farther away
LIGHT_GAP = 1e-6  # between a sphere and the light

HEADER = """\
// {title}
// Run: {command}
// The colours are linear: no gamma. Coordinates are the assignment's, times Unit.
// The scene as the assignment writes it:
//
{source}
#version 3.7;
#declare Unit = {unit};

global_settings {{
  assumed_gamma 1.0
  max_trace_level {levels}  // the primary ray and {depth} bounces
  adc_bailout 0             // no bounce is dropped for being faint
  ambient_light rgb {ambient}  // ambient colour * coefficient / 256
}}
background {{ rgb 0 }}
camera {{
  perspective
  location 0
  direction {distance}*z
  up {side}*y
  right {side}*x
}}
light_source {{ {light}*Unit, rgb 1 }}
"""

INI = """\
; POV-Ray reads this file in place of your own povray.ini and the system's: none of their settings changes the picture.
"""


def export(scene: Scene, settings: Settings) -> Export:
    """One `.pov` file. Each surface: ambient and diffuse from its colour, the given normal on both sides, a mirror."""
    spheres, planes = distinct_spheres(scene), distinct_planes(scene)
    _refuse(spheres, planes, settings)
    size = (f"+W{settings.width}", f"+H{settings.height}")
    exactly = ("-A", "-D", "-P", "+FN16", "File_Gamma=1.0", f"+WT{settings.threads}")
    command = ("povray", "+Iscene.pov", "+Oscene.png", *size, *exactly)
    header = HEADER.format(
        title="A scene of the recursive ray tracing assignment, for POV-Ray 3.7",
        command=" ".join(command),
        source=source(scene, "//   "),
        unit=UNIT,
        levels=settings.depth + 1,
        depth=settings.depth,
        ambient=_vector(tuple(value * scene.ambient_coefficient / 256 for value in scene.ambient)),
        distance=SCREEN_DISTANCE,
        side=2 * SCREEN,
        light=_vector(LIGHT),
    )
    parts = [header]
    parts += [_sphere(name, sphere) for name, sphere in spheres.items()]
    parts += [_plane(name, plane) for name, plane in planes.items()]
    files = {"scene.pov": "\n".join(parts), "povray.ini": INI}
    notes = ("The picture is a 16 bit PNG with linear values; viewers that honour its gamma show it brighter.",)
    return Export(files, command, "scene.png", notes, {"POVINI": "povray.ini"}, LIMITS)


def _refuse(spheres: dict[str, Sphere], planes: dict[str, Plane], settings: Settings) -> None:
    if settings.depth > DEEPEST:
        raise Unsupported(f"POV-Ray follows at most {DEEPEST} bounces, not {settings.depth}")
    surfaces: dict[str, Sphere | Plane] = {**spheres, **planes}
    for name, surface in surfaces.items():
        if surface.diffuse < 0 or surface.reflection < 0:
            raise Unsupported(f"POV-Ray ignores negative coefficients: {name} has one")
    for name, sphere in spheres.items():
        if max(map(abs, sphere.centre)) + sphere.radius > FARTHEST:
            raise Unsupported(f"POV-Ray sees nothing beyond {FARTHEST:g}: {name} reaches farther")
        if abs(math.dist(sphere.centre, LIGHT) - sphere.radius) < LIGHT_GAP:
            raise Unsupported(f"POV-Ray decides by rounding whether {name} hides the light, which lies on it")
    for name, plane in planes.items():
        if abs(plane.distance_from(EYE)) > FARTHEST_PLANE:
            raise Unsupported(f"POV-Ray sees nothing beyond {FARTHEST:g}, where rays along {name} would meet it")


def _sphere(name: str, sphere: Sphere) -> str:
    shape = f"sphere {{ {_vector(sphere.centre)}*Unit, {number(sphere.radius)}*Unit"
    return _object(name, shape, sphere, near=sphere.centre[2] - sphere.radius <= SCREEN_DISTANCE)


def _plane(name: str, plane: Plane) -> str:
    normal, offset = plane.unit_normal, plane.distance_from(EYE)
    middle = SCREEN_DISTANCE * normal[2]  # n.d over the screen is middle -+ spread; the plane is met at offset / n.d
    spread = SCREEN * (abs(normal[0]) + abs(normal[1]))
    near = middle + spread >= offset if offset > 0 else middle - spread <= offset
    hidden = spread == 0 and offset == middle  # on the screen itself, where t = 1 does not count
    return _object(name, f"plane {{ {_vector(normal)}, {number(offset)}*Unit", plane, near, hidden)


def _object(name: str, shape: str, surface: Sphere | Plane, near: bool, hidden: bool = False) -> str:
    """One object; where camera rays can meet it before the screen, one for the camera and one for all other rays."""
    texture = _texture(surface)
    if not near:
        return f"// {name}\n{shape}\n{texture}}}\n"
    clip = f"  clipped_by {{ plane {{ -z, -{SCREEN_DISTANCE}*Unit }} }}  // the camera sees nothing before the screen\n"
    seen = f"// {name}, as the camera sees it\n{shape}\n{texture}{clip}  no_shadow no_reflection\n}}\n"
    rest = f"// {name}, as shadows and mirrors see it\n{shape}\n{texture}  no_image\n}}\n"
    return rest if hidden else seen + rest


def _texture(surface: Sphere | Plane) -> str:
    """The pair `diffuse front, back` swapped for the inside: the given normal shades both sides."""
    pigment = f"pigment {{ rgb <{', '.join(map(single, surface.colour))}>/255 }}"
    outside, inside = _finish(single(surface.diffuse), surface), _finish(f"0, {single(surface.diffuse)}", surface)
    return f"  texture {{ {pigment} {outside} }}\n  interior_texture {{ {pigment} {inside} }}\n"


def _finish(diffuse: str, surface: Sphere | Plane) -> str:
    return f"finish {{ ambient 1 diffuse {diffuse} specular 0 phong 0 reflection {{ {single(surface.reflection)} }} }}"


def _vector(values: Triple | tuple[float, ...]) -> str:
    return f"<{', '.join(map(number, values))}>"
