"""Tachyon: the scene in its own scene file, which a program of ours hands to Tachyon's library with all its digits."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources

from reference.scene import EYE, LIGHT, Plane, Scene, Sphere, Triple, distinct_planes, distinct_spheres
from translator.contract import PYTHON, Export, Settings, number, single, source, spaced
from translator.renderers.tachyon.limits import ENDLESS, FAINTEST, LIMITS, UNIT, refuse
from translator.renderers.tachyon.places import holds, is_lit, only_between, reach, slants

PROGRAM = resources.files(__name__).joinpath("draw.py")
TITLE = "Tachyon"
LICENCE = "BSD-3-Clause"
INSTALL = "apt-get install tachyon-bin-nox"
VERSION = ((PYTHON, str(PROGRAM), "--version"), r"Tachyon (\d[\w.]*)")
TIMING = r"Ray Tracing Time: +([0-9.]+) seconds"

DIMMED = 2.0**-20  # the light's colour, while its strength is the inverse: so no cosine is too faint
UNTINTED = 2.0**-30  # stands for 0 in the tint, which the light's colour undoes
FAR = 2.0**21  # where a slanting mirror ends: farther away it would by rounding see itself, instead of nothing
SHADOWLESS = 0.999  # opacity of what looks opaque but casts no shadow

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
# Mirrored rays straight into a small light would end on it; what is as large as this they meet nowhere.
LIGHT CENTER {light} RAD 1e30
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
    refuse(spheres, planes, settings)
    options = ("--unit", number(UNIT), "--threads", str(settings.threads))
    command = (PYTHON, "draw.py", "scene.dat", "scene.exr", *options)
    paint = _paint(scene)
    parts = [_header(scene, settings, " ".join(command), paint)]
    parts += [_sphere(name, sphere, paint) for name, sphere in reversed(spheres.items())]
    between = only_between(spheres, planes)
    far = max([FAR, *(16 * reach(sphere) for sphere in spheres.values())])
    for name, plane in reversed(planes.items()):
        behind = name == between and is_lit(plane)
        ends = slants(plane) and (behind or (settings.depth > 0 and plane.reflection != 0))
        parts.append(_plane(name, plane, paint, behind, far if ends else ENDLESS))
    files = {"scene.dat": "\n".join([*parts, "END_SCENE\n"]), "draw.py": PROGRAM.read_text(encoding="utf-8")}
    return Export(files, command, "scene.exr", NOTES, limits=LIMITS)


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
        eye=spaced(EYE),
        frustum=spaced(frustum),
        light=spaced(LIGHT),
        dimmed=number(DIMMED),
        light_colour=" ".join(single(DIMMED / value) for value in paint.tint),
    )


def _sphere(name: str, sphere: Sphere, paint: _Paint) -> str:
    diffuse = 0.0 if holds(sphere, LIGHT) else sphere.diffuse
    shape = f"SPHERE CENTER {spaced(sphere.centre)} RAD {number(sphere.radius)}"
    return f"# {name}\n{shape}\n  {paint.texture(sphere, diffuse)}\n"


def _plane(name: str, plane: Plane, paint: _Paint, behind: bool, end: float) -> str:
    """A plane, or up to `end` a disk, or a triangle if it is lit `behind`; what is farther away mirrors nothing."""
    diffuse = plane.diffuse if is_lit(plane) else 0.0
    opacity = 1 if plane.distance_from(LIGHT) else SHADOWLESS
    normal = plane.unit_normal
    foot = [value * plane.distance_from(EYE) + 0.0 for value in normal]  # never -0.0
    place = f"CENTER {spaced(foot)} NORMAL {spaced(normal)}"
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
    places = " ".join(f"V{index} {spaced(corner)}" for index, corner in enumerate(corners))
    return f"STRI {places} " + " ".join(f"N{index} {spaced(normal)}" for index in range(3))
