"""Radiance: its own surfaces, materials, lamp and view; `rtrace` draws what the lamp and what ambient light adds."""

from __future__ import annotations

import math
from collections.abc import Iterable
from importlib import resources

from reference.scene import EYE, SCREEN, SCREEN_DISTANCE, Scene, distinct_planes, distinct_spheres
from translator.contract import PYTHON, Export, Settings, number, source
from translator.renderers.radiance.faces import PLANE_RADIUS, THICKNESS, faces_of, shape, spaced
from translator.renderers.radiance.limits import Surfaces, limits_for, refuse, refuse_dark, unit_for
from translator.renderers.radiance.materials import is_subtracted, lamp, layer_file, layers_of

TITLE = "Radiance"
LICENCE = "BSD-3-Clause-LBNL"
INSTALL = "pip install pyradiance"
ASK = "import pyradiance as p; print(p.rtrace(b'', '', version=True).decode().strip(), 'of pyradiance', p.__version__)"
VERSION = ((PYTHON, "-c", ASK), r"RADIANCE (.+)")
TIMING = r"traced in ([0-9.e-]+) s"

HEADER = """\
# A scene of the recursive ray tracing assignment, for Radiance.
# Run: {command}
# The picture is the sum of one under the lamp and one under ambient light, as a material has one colour for both.
# Radiance's own programs draw the same in its own format, with fewer digits:
{steps}#
# The picture is linear: 1.0 is level 255. Coordinates are the assignment's{scale}, z negated, as Radiance's
# views are right-handed. Planes are disks; a bubble is a sphere seen from inside. By scene.opt ambient light is the
# same everywhere, one shadow ray goes to the centre of the lamp, mirrors are perfect and no ray is too faint.
#
# The scene as the assignment writes it:
#
{source}"""

STEP = """\
#   oconv {layer}.rad scene.rad > {layer}.oct
#   rpict @scene.opt -av {ambient} -vf scene.vf {size} -pa 0 -pj 0 -ps 1 {layer}.oct > {layer}.hdr
"""

VIEW = """\
rvu -vtv -vp {eye} -vd 0 0 -1 -vu 0 1 0 -vh {angle} -vv {angle} -vo {distance}
"""

OPTIONS = """\
-ab 0
-dj 0 -ds 0 -dt 0 -dc 1 -dr 0
-ss 0 -st 0
-lr {bounces} -lw 0
"""


def export(scene: Scene, settings: Settings) -> Export:
    """The surfaces, their materials under the lamp and under ambient light, view, options, the program that draws."""
    spheres, planes = distinct_spheres(scene), distinct_planes(scene)
    surfaces: Surfaces = {**spheres, **planes}
    unit = unit_for(planes)
    refuse(surfaces, settings.depth, unit)
    layers = layers_of(scene, surfaces)
    for colours in layers.values():
        refuse_dark(colours, surfaces, settings.depth)
    faces = [face for name, surface in surfaces.items() for face in faces_of(name, surface)]
    size = f"{settings.width}x{settings.height}"
    command = (PYTHON, "render.py", "scene.exr", "--size", size, "--threads", str(settings.threads))
    header = HEADER.format(
        command=" ".join(command),
        steps=_steps(layers, settings),
        scale="" if unit == 1 else f" times {number(unit)}",
        source=source(scene, "#   "),
    )
    angle = number(math.degrees(2 * math.atan(SCREEN / SCREEN_DISTANCE)))
    light, mirrors = lamp(surfaces, unit), settings.depth > 0
    files = {
        "scene.rad": header + "".join(shape(face, unit) for face in faces),
        "scene.vf": VIEW.format(eye=spaced(EYE), angle=angle, distance=number(SCREEN_DISTANCE * unit)),
        "scene.opt": OPTIONS.format(bounces=max(1, settings.depth)),  # 0 is Russian roulette; then nothing mirrors
        "render.py": resources.files(__name__).joinpath("render.py").read_text(encoding="utf-8"),
        **{f"{name}.rad": layer_file(name, colours, faces, light, mirrors) for name, colours in layers.items()},
    }
    notes = (
        "The picture is a sum: what the lamp adds and what ambient light adds, as a material has one colour for both.",
        f"Planes are disks of radius {PLANE_RADIUS / unit:g}, {THICKNESS / unit:g} thick if both sides are seen.",
    )
    return Export(files, command, "scene.exr", notes, limits=limits_for(planes, unit))


def _steps(layers: Iterable[str], settings: Settings) -> str:
    """The pictures of the layers and their sum, by Radiance's own programs."""
    size = f"-x {settings.width} -y {settings.height}"
    steps = [
        STEP.format(layer=layer, ambient="0 0 0" if layer.startswith("light") else "1 1 1", size=size)
        for layer in layers
    ]
    terms = " ".join(f"{'-s -1 ' * is_subtracted(layer)}{layer}.hdr" for layer in layers)
    return "".join([*steps, f"#   pcomb {terms} > scene.hdr\n"])
