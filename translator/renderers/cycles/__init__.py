"""Blender Cycles: the scene as a Blender script, for Blender with its window or as a Python module."""

from __future__ import annotations

from importlib import resources

from reference.scene import EYE, LIGHT, SCREEN_DISTANCE, Plane, Scene, Sphere, Triple, distinct_planes, distinct_spheres
from translator.contract import PYTHON, Export, Settings, number, single, source
from translator.renderers.cycles.limits import LIMITS, MOST_THREADS, refuse

TITLE = "Blender Cycles"
LICENCE = "GPL-3.0-or-later"
INSTALL = "pip install 'crossray[cycles]' (374 MB, for Python 3.11 only)"
VERSION = ((PYTHON, "-c", "import importlib.metadata as m; print('bpy', m.version('bpy'))"), r"bpy (\S+)")
TIMING = r"traced in ([0-9.e-]+) s"

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
    light = [value * scene.ambient_coefficient / 256 for value in scene.ambient]
    refuse(spheres, planes, light, bounces, settings)
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
