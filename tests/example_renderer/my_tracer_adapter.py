"""How crossray runs my tracer. Copy this file, write your own tracer's name and command into it, and install it.

crossray reads the names in capitals, calls `export` for each scene, writes the files into a fresh folder and runs the
command there, with nothing of your environment but PATH. It then compares the picture with the proven one, and puts
each pixel that is off by more than half a level in a class, or calls it unexplained. `translator/contract.py` of
crossray has the details. After `pip install ./example_renderer`:

    crossray doctor                                          # lists it
    crossray export scene.txt --to my-tracer                 # writes its files and says how to run them
    crossray check scene.txt --with my-tracer --out report   # holds its picture against the truth
"""

from __future__ import annotations

from math import dist

from reference.scene import EYE, LIGHT, Plane, Scene, Sphere, distinct_planes, distinct_spheres, merge_coincident
from reference.text import dump
from translator.contract import PYTHON, Export, Limits, Settings, Unsupported

TITLE = "My tracer"  # as reports call it
LICENCE = "MIT"  # as SPDX spells it
INSTALL = "pip install ./example_renderer"  # what somebody types who does not have it
# A command that says which version there is, and where in its answer. Its first word is a program on the PATH, or
# PYTHON for the Python that runs crossray.
VERSION = ((PYTHON, "-m", "my_tracer", "--version"), r"my_tracer (\S+)")
TIMING = r"traced in ([0-9.]+) s"  # where in its output the seconds are that tracing took, without start and files

# What the arithmetic cannot do better: points and directions have this relative error. It is for double precision, and
# for a few roundings in each of them; declare what yours does, not what makes pixels pass. A tracer that starts its
# rays a little ahead, or has a largest distance, also declares `gap` and `far`.
LIMITS = Limits(precision=2.0**-44)
FARTHEST = 1e9  # beyond it, roundings are as large as the scene


def export(scene: Scene, settings: Settings) -> Export:
    """The files for one scene and the command that draws them: a pure function, which runs nothing and opens nothing.

    My tracer reads the assignment's own format. For one that does not, write its language here, from the numbers in
    `scene`; `translator/renderers/povray.py` does so.
    """
    refuse(scene)
    command = (PYTHON, "-m", "my_tracer", "scene.txt", "picture.exr")
    options = ("--size", f"{settings.width}x{settings.height}", "--depth", str(settings.depth))
    # Coincident surfaces would show as speckles: the first listed stays.
    files = {"scene.txt": dump(merge_coincident(scene))}
    # The picture must be linear, level 255 being 1, in floats or 16 bits: 8 bits cannot tell half a level.
    notes = ("My tracer computes in double precision, on one core.",)
    return Export(files, command + options, "picture.exr", notes, limits=LIMITS)


def refuse(scene: Scene) -> None:
    """Raise Unsupported, with a reason for the user, for what would come out wrong: better no picture than that."""
    surfaces: dict[str, Sphere | Plane] = {**distinct_spheres(scene), **distinct_planes(scene)}
    for name, surface in surfaces.items():
        if isinstance(surface, Sphere):
            gap, reach = dist(surface.centre, LIGHT) - surface.radius, dist(surface.centre, EYE) + surface.radius
        else:
            gap, reach = surface.distance_from(LIGHT), abs(surface.distance_from(EYE))
        if abs(gap) < 1e-9:
            raise Unsupported(f"my tracer decides by rounding whether {name} hides the light, which lies on it")
        if not reach:
            raise Unsupported(f"my tracer decides by rounding what rays along {name} meet, which the eye is in")
        if reach > FARTHEST:
            raise Unsupported(f"my tracer sees nothing beyond {FARTHEST:g}: {name} reaches farther")
