"""Mitsuba 3 as it is: plain XML of stock plugins for its own command, with nothing of ours inside.

The integrator `path` follows mirrors and samples the light, but not as the assignment counts: emission is found one
bounce deeper than light from a lamp. So ambient light (as emission) and the lamp's are drawn apart, and a third scene
adds the two pictures. A lamp's light falls off with the square of the distance r, for which the diffuse reflectance
makes up: on a sphere r^2 is linear along the axis that points to the light; on a plane it is the sum of the squares of
two coordinates and a constant. A volume that is linear along one axis and blended BSDFs are enough for both.
"""

from __future__ import annotations

import math
from importlib import resources

from reference.scene import EYE, LIGHT, SCREEN, SCREEN_DISTANCE, Plane, Scene, Sphere, distinct_planes, distinct_spheres
from translator.contract import PYTHON, Export, Settings, source, spaced
from translator.renderers.mitsuba_stock.elements import moved
from translator.renderers.mitsuba_stock.falloff import VALLEY
from translator.renderers.mitsuba_stock.limits import LIMITS, refuse
from translator.renderers.mitsuba_stock.surfaces import DIMMED, glowing_shape, lit_shape

TITLE = "Mitsuba 3, stock"
LICENCE = "BSD-3-Clause"
INSTALL = "pip install mitsuba"
VERSION = ((PYTHON, "-c", "import importlib.metadata as m; print('mitsuba', m.version('mitsuba'))"), r"mitsuba (\S+)")
TIMING = r"traced in ([0-9.e-]+) s"

SCENES = ("ambient.xml", "light.xml", "scene.xml")

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
    refuse(spheres, planes, settings)
    surfaces: dict[str, Sphere | Plane] = {**spheres, **planes}
    film = FILM.format(width=settings.width, height=settings.height)
    ambient = [value * scene.ambient_coefficient / 256 for value in scene.ambient]
    glowing = [glowing_shape(name, surface, ambient) for name, surface in surfaces.items()]
    lamp = LAMP.format(light=spaced(moved(LIGHT)), intensity=spaced([math.pi / DIMMED] * 3))
    lit = [lamp, *(lit_shape(name, surface) for name, surface in surfaces.items())]
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


def _scene(title: str, scene: Scene, depth: int, film: str, parts: list[str]) -> str:
    header = HEADER.format(
        title=title,
        scenes=" ".join(SCENES),
        source=source(scene, "     "),
        shift=spaced(moved(EYE)),
        depth=depth,
        distance=SCREEN_DISTANCE,
        fov=math.degrees(2 * math.atan(SCREEN / SCREEN_DISTANCE)),
        film=film,
    )
    return "".join([header, *parts, "</scene>\n"])
