"""The classic mistakes of this assignment: what was done, how it looks, which scene shows it, what to do.

A mistake is the document's model with a step replaced, and what is done with the levels at the end. Letters and numbers
are those of the project's list: C camera, I intersection, P planes, S shadows, L light, A ambient, R reflections,
Q quantisation. R11, a depth that never grows, has no picture: such a program never ends.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import atan, degrees, radians, tan
from typing import Any

import drjit as dr
import numpy as np

from reference import slips
from reference.model import DOCUMENT, GRAZING, SHIFT, Model, beyond
from reference.scene import LIGHT, SCREEN, SCREEN_DISTANCE, Scene, merge_coincident
from reference.slips import Levels, draw
from reference.world import View

FEATURES = ("geometry", "occlusion", "ambient", "diffuse", "shadows", "reflections", "quantisation")
CAMERA, SHADOW, REFLECTION = DOCUMENT.camera, DOCUMENT.shadow, DOCUMENT.reflection


def unchanged(levels: Levels) -> Levels:
    """The levels as they are."""
    return levels


@dataclass(frozen=True)
class Mistake:
    """One mistake, or several at once."""

    title: str
    looks: str
    hint: str
    feature: str
    revealed_by: str
    steps: Mapping[str, Any] = field(default_factory=dict)  # of the model
    depth: int | None = None  # bounces, where it is not the scene's
    compose: Callable[[Scene, Model, View], Levels] = draw
    after: Callable[[Levels], Levels] = unchanged
    rounding: bool = False  # changes no more than one level
    speckled: bool = False  # a pixel is right or wrong by chance

    def draw(self, scene: Scene, view: View) -> Levels:
        """The picture that a tracer with this mistake alone makes, to be clamped and truncated: height x width x 3."""
        depth = view.depth if self.depth is None else self.depth
        return self.after(self.compose(scene, replace(DOCUMENT, **self.steps), replace(view, depth=depth)))


def combine(one: Mistake, other: Mistake) -> Mistake | None:
    """Both at once; None where both change the same step."""
    steps = {**one.steps, **other.steps}
    both = one.steps.keys() & other.steps.keys()
    if both == {"surfaces"}:
        steps["surfaces"] = lambda scene: other.steps["surfaces"](one.steps["surfaces"](scene))
    elif both or draw not in (one.compose, other.compose) or (one.depth is not None and other.depth is not None):
        return None
    return replace(
        one,
        title=f"{one.title}; and {other.title}",
        steps=steps,
        depth=one.depth if other.depth is None else other.depth,
        compose=one.compose if other.compose is draw else other.compose,
        after=lambda levels: other.after(one.after(levels)),
        rounding=one.rounding and other.rounding,
        speckled=one.speckled or other.speckled,
    )


MISTAKES = {
    "C1": Mistake(
        "rows are in the wrong order",
        "the picture is upside down",
        "Row 0 is on top: y falls as the row grows.",
        "geometry",
        "example1",
        {"camera_direction": slips.seen_through(lambda x, y: (x, -y))},
    ),
    "C2": Mistake(
        "columns are in the wrong order",
        "the picture is mirrored, left is right",
        "Column 0 is on the left: x grows with the column.",
        "geometry",
        "example1",
        {"camera_direction": slips.seen_through(lambda x, y: (-x, y))},
    ),
    "C3": Mistake(
        "rows and columns are swapped",
        "the picture is transposed",
        "The first index of the picture's array is the row, the second the column.",
        "geometry",
        "example1",
        {"camera_direction": slips.transposed},
    ),
    "C4": Mistake(
        "rays go through the corners of pixels",
        "edges are off by half a pixel",
        "Add half a pixel: a ray goes through the middle of its pixel.",
        "geometry",
        "example3",
        {"camera_direction": slips.corners},
    ),
    "C5": Mistake(
        "pixels are spread from edge to edge of the screen",
        "edges drift, the more the farther they are from the middle",
        "1000 pixels share the screen's width: the pitch is 100 / 1000, not 100 / 999, so no linspace with both ends.",
        "geometry",
        "example3",
        {"camera_direction": slips.both_ends},
    ),
    "C6": Mistake(
        "rows are one off",
        "everything is one pixel too low",
        "The lowest row is row 999 of 1000, so use 999 - row.",
        "geometry",
        "example3",
        {"camera_direction": slips.a_row_off},
    ),
    "C7": Mistake(
        "the field of view is 90 degrees",
        "everything is too small",
        "The screen is 100 wide at a distance of 100, which is 53.13 degrees.",
        "geometry",
        "example1",
        {"camera_direction": slips.zoomed(2)},
    ),
    "C8": Mistake(
        "surfaces behind the eye are seen",
        "ghosts of what is behind the eye",
        "A camera ray meets only what is at t > 1.",
        "occlusion",
        "behind_eye",
        {"camera": replace(CAMERA, sphere=lambda t, leaving: (t < 0) | CAMERA.sphere(t, leaving))},
    ),
    "C9": Mistake(
        "surfaces before the screen are seen",
        "a blob in front",
        "A camera ray meets only what is behind the screen, at t > 1.",
        "occlusion",
        "near_unit",
        {"camera": beyond(SHIFT, GRAZING)},
    ),
    "C10": Mistake(
        "camera directions have unit length, and what is seen still begins at t = 1",
        "what is before the screen appears",
        "At t = 1 is the screen only if the direction is pixel - eye, of its own length.",
        "occlusion",
        "near_unit",
        {"camera_direction": slips.of_unit_length},
    ),
    "I1": Mistake(
        "the last surface that is met wins, not the nearest",
        "walls cover spheres",
        "Of all surfaces a ray meets keep the one with the smallest t.",
        "occlusion",
        "example1",
        {"nearer": lambda t, best: t == t},
    ),
    "I2": Mistake(
        "the first surface that is met wins, not the nearest",
        "what is listed first covers what is before it",
        "Of all surfaces a ray meets keep the one with the smallest t.",
        "occlusion",
        "example3",
        {"nearer": lambda t, best: best == np.inf},
    ),
    "I3": Mistake(
        "spheres are met at their far side",
        "spheres look inside out and dark",
        "Of the two roots take the smaller one that counts.",
        "occlusion",
        "example1",
        {"sphere_distances": slips.roots(slips.behind_first)},
    ),
    "I4": Mistake(
        "spheres are not met from inside",
        "a sphere around the eye or the light has no effect",
        "If the smaller root does not count, the larger one may.",
        "occlusion",
        "eye_inside",
        {"sphere_distances": slips.roots(lambda near, far, dd: (near, far * np.nan))},
    ),
    "I5": Mistake(
        "the roots are divided by 2 and multiplied by a",
        "spheres vanish",
        "Write / (2 * a): in / 2 * a the product comes last.",
        "occlusion",
        "example1",
        {"sphere_distances": slips.roots(lambda near, far, dd: (near * dd * dd, far * dd * dd))},
    ),
    "I6": Mistake(
        "r^2 is added, not subtracted",
        "spheres vanish",
        "c = p.p - r^2, with p = origin - centre; the document once prints a plus.",
        "occlusion",
        "example1",
        {"sphere_distances": slips.sum_of_squares},
    ),
    "I7": Mistake(
        "radii are taken for diameters",
        "spheres are half as large",
        "The file gives radii.",
        "geometry",
        "example1",
        {"surfaces": slips.half_as_large},
    ),
    "P1": Mistake(
        "the start of the ray is left out where it meets a plane",
        "what is seen directly is right, shadows and mirrors are wrong",
        "t = (q - o).n / d.n: subtract the ray's origin o, which is the eye only for camera rays.",
        "reflections",
        "example1",
        {"plane_arm": lambda point, origin: point},
    ),
    "P1/2": Mistake(
        "the direction of the ray is subtracted where it meets a plane, not its start",
        "planes are in the wrong place",
        "t = (q - o).n / d.n: subtract the ray's origin o, not its direction d.",
        "occlusion",
        "example1",
        {
            "plane_arm": lambda point, origin: point,
            "plane_distance": lambda q, normal, facing, leaving: dr.dot(q, normal) / facing - 1,
        },
    ),
    "P2": Mistake(
        "planes have t of the wrong sign",
        "planes vanish",
        "t = (q - o).n / d.n, with q a point of the plane and o the start of the ray.",
        "occlusion",
        "example1",
        {
            "plane_arm": lambda point, origin: origin - point,
            "plane_distance": lambda q, normal, facing, leaving: dr.dot(q, normal) / facing,
        },
    ),
    "P3": Mistake(
        "a plane's normal is taken from its point to where it is met",
        "the floor is shaded like a ball",
        "A plane has the same normal everywhere: the one in the file.",
        "diffuse",
        "example1",
        {"plane_normal": slips.spotted},
    ),
    "P4": Mistake(
        "planes are not met from the back",
        "a plane is missing",
        "A plane is met from both sides: any d.n that is not 0 will do.",
        "occlusion",
        "plane_back",
        {
            "camera": slips.facing_only(CAMERA),
            "shadow": slips.facing_only(SHADOW),
            "reflection": slips.facing_only(REFLECTION),
        },
    ),
    "P5": Mistake(
        "normals of planes are not normalised",
        "planes are too bright, or mirror strangely",
        "Divide the normal by its length when the file is read.",
        "diffuse",
        "long_normal",
        {"surfaces": slips.raw_normals},
    ),
    "S1": Mistake(
        "shadow rays meet the surface that they leave",
        "dark speckles",
        "Count shadow hits from t > 0.0001 on.",
        "shadows",
        "example1",
        {"shadow": slips.touching(SHADOW)},
        speckled=True,
    ),
    "S2": Mistake(
        "shadow rays go both ways",
        "almost everything is dark",
        "What is behind the point, at t < 0, casts no shadow on it.",
        "shadows",
        "example1",
        {
            "shadow": replace(
                SHADOW,
                sphere=lambda t, leaving: t < 1,
                plane=lambda t, facing, leaving: t < 1,
            )
        },
    ),
    "S3": Mistake(
        "what is beyond the light casts shadows",
        "false shadows",
        "The light is at t = 1: count only what has t < 1.",
        "shadows",
        "example1",
        {"shadow": beyond(SHIFT, GRAZING)},
    ),
    "S4": Mistake(
        "the shadow ray has unit length, and what counts is still between t = 0 and 1",
        "shadows are gone, but for contacts",
        "With a unit direction the light is at t = its distance; with light - point it is at t = 1.",
        "shadows",
        "example1",
        {"shadow": slips.between(SHIFT / slips.USUAL, 1 / slips.USUAL)},
    ),
    "S5": Mistake(
        "shadow rays start far too late",
        "shadows are detached from what casts them",
        "Count shadow hits from t > 0.0001 on.",
        "shadows",
        "thin_gap",
        {"shadow": slips.between(0.05)},
    ),
    "S6": Mistake(
        "the shadow test is the wrong way round",
        "lit where it should be dark",
        "Diffuse light is added where nothing stands before the light.",
        "shadows",
        "example1",
        {"local": lambda ambient, diffuse, dark, depth: ambient + dr.select(dark, diffuse, 0)},
    ),
    "S7": Mistake(
        "planes cast no shadow",
        "light leaks through walls",
        "Look for planes, too, between the point and the light.",
        "shadows",
        "plane_shadow",
        {"shadow": replace(SHADOW, plane=slips.never)},
    ),
    "S8": Mistake(
        "reflections have no shadows",
        "the mirror image is too light",
        "A mirrored colour is computed as any other, shadow ray included.",
        "shadows",
        "example1",
        {"local": lambda ambient, diffuse, dark, depth: ambient + dr.select(dark & (depth == 0), 0, diffuse)},
    ),
    "S9": Mistake(
        "ambient light is lost in shadow",
        "shadows are black",
        "Ambient light is always added; only the diffuse part is in shadow.",
        "ambient",
        "example1",
        {
            "cosine": slips.sine_or_cosine(slips.at_least(slips.TINY)),
            "local": lambda ambient, diffuse, dark, depth: dr.select(dark, 0, ambient + diffuse),
        },
    ),
    "S9/2": Mistake(
        "ambient light is lost in shadow",
        "shadows are black",
        "Ambient light is always added; only the diffuse part is in shadow.",
        "ambient",
        "example1",
        {
            "shadow": slips.skipping(SHADOW),
            "cosine": slips.sine_or_cosine(slips.at_least(slips.TINY)),
            "local": lambda ambient, diffuse, dark, depth: dr.select(dark, 0, ambient + diffuse),
        },
    ),
    "S10": Mistake(
        "shadow scales the whole colour",
        "shadows have the wrong brightness",
        "In shadow the diffuse part is 0 and the ambient part is whole.",
        "shadows",
        "coloured_ambient",
        {
            "cosine": slips.sine_or_cosine(slips.at_least(slips.TINY)),
            "local": lambda ambient, diffuse, dark, depth: (ambient + diffuse) * dr.select(dark, 0.2, 1),
        },
    ),
    "S10/2": Mistake(
        "shadow scales the whole colour",
        "shadows have the wrong brightness",
        "In shadow the diffuse part is 0 and the ambient part is whole.",
        "shadows",
        "coloured_ambient",
        {
            "shadow": slips.skipping(SHADOW),
            "cosine": slips.sine_or_cosine(slips.at_least(slips.TINY)),
            "local": lambda ambient, diffuse, dark, depth: (ambient + diffuse) * dr.select(dark, 0.2, 1),
        },
    ),
    "L1": Mistake(
        "normals of spheres are not normalised",
        "spheres are blown out",
        "Divide point - centre by the radius.",
        "diffuse",
        "example1",
        {"sphere_normal": lambda point, centre, radius: point - centre},
    ),
    "L2": Mistake(
        "the direction to the light is not normalised",
        "white-out",
        "Divide light - point by its length for n.l.",
        "diffuse",
        "example1",
        {"cosine": slips.raw_cosine},
    ),
    "L3": Mistake(
        "n.l below 0 is not cut off",
        "wild colours on the dark side",
        "Use max(0, n.l).",
        "diffuse",
        "example1",
        {"cosine": slips.sine_or_cosine(unchanged), "shadow": slips.skipping(SHADOW)},
        after=slips.wrapped,
    ),
    "L4": Mistake(
        "n.l is taken without its sign",
        "the dark side is lit",
        "Use max(0, n.l), not |n.l|.",
        "diffuse",
        "example1",
        {"cosine": slips.sine_or_cosine(abs), "shadow": slips.skipping(SHADOW)},
    ),
    "L5": Mistake(
        "the normal, or the direction to the light, is reversed",
        "lit on the wrong side",
        "The normal is point - centre, the direction light - point.",
        "diffuse",
        "example1",
        {
            "cosine": slips.sine_or_cosine(lambda along: slips.at_least(0)(-along)),
            "shadow": slips.skipping(SHADOW),
        },
    ),
    "L6": Mistake(
        "the light's place is taken for its direction",
        "floor and walls are of one brightness",
        "The direction to the light is light - point, another one at each point.",
        "diffuse",
        "example1",
        {"cosine": slips.parallel_light},
    ),
    "L7": Mistake(
        "light falls off with the square of the distance",
        "the back is dark",
        "This light does not fall off.",
        "diffuse",
        "example1",
        {"cosine": slips.fading(500)},
    ),
    "L8": Mistake(
        "the ambient colour tints the diffuse light",
        "a colour cast",
        "The ambient colour belongs to the ambient part alone; the light is white.",
        "diffuse",
        "coloured_ambient",
        {"surfaces": slips.tinted, "ambient": lambda surface, _, coefficient: surface * coefficient},
    ),
    "L9": Mistake(
        "the diffuse coefficient is ignored",
        "too bright",
        "diffuse = colour * kd * n.l.",
        "diffuse",
        "example1",
        {"surfaces": slips.each(lambda surface: replace(surface, diffuse=1.0))},
    ),
    "L10": Mistake(
        "diffuse and reflection coefficient are swapped",
        "mirrors are matte, and matte things mirror",
        "The diffuse coefficient comes first in the file, then the reflection coefficient.",
        "diffuse",
        "example1",
        {"surfaces": slips.each(lambda s: replace(s, diffuse=s.reflection, reflection=s.diffuse))},
    ),
    "A1": Mistake(
        "ambient light is divided by 255, not by 256",
        "one level too bright, here and there",
        "ambient = ambient colour * ka * colour / 256.",
        "ambient",
        "bright_ambient",
        {"ambient": lambda surface, colour, coefficient: surface * colour * (coefficient / 255)},
        rounding=True,
    ),
    "A2": Mistake(
        "ambient light does not take the surface's colour",
        "a grey veil",
        "ambient = ambient colour * ka * colour / 256.",
        "ambient",
        "example1",
        {"ambient": lambda surface, colour, coefficient: surface * 0 + colour * coefficient},
    ),
    "A3": Mistake(
        "ambient light is multiplied by the diffuse coefficient",
        "ambient light is too low",
        "kd belongs to the diffuse part alone.",
        "ambient",
        "example2",
        {"surfaces": slips.each(lambda s: replace(slips.scaled(s, s.diffuse), diffuse=1.0))},
    ),
    "R1": Mistake(
        "the reflected direction has the wrong sign",
        "wrong reflections",
        "d - 2 (d.n) n, with a minus.",
        "reflections",
        "example1",
        {"reflected_direction": slips.mirrored_wrong_way},
    ),
    "R2": Mistake(
        "the reflected direction is negated",
        "wrong reflections",
        "d - 2 (d.n) n, with d from the eye to the surface.",
        "reflections",
        "example1",
        {"reflected_direction": slips.mirrored_backward},
    ),
    "R3": Mistake(
        "d and n are multiplied component by component, not by a dot product",
        "a band at the rim of mirroring spheres",
        "(d.n) is one number: use dot(d, n).",
        "reflections",
        "example1",
        {"reflected_direction": slips.mirrored_by_component},
    ),
    "R4": Mistake(
        "reflected rays meet the surface that they leave",
        "speckled or brightened mirrors",
        "Start a little off the surface: count hits from t > 0.0001 on.",
        "reflections",
        "example1",
        {"reflection": slips.touching(REFLECTION)},
        speckled=True,
    ),
    "R4/2": Mistake(
        "reflected rays meet the surface that they leave",
        "brightened mirrors",
        "Start a little off the surface: count hits from t > 0.0001 on.",
        "reflections",
        "example1",
        {"reflection": slips.touching(REFLECTION)},
    ),
    "R5": Mistake(
        "t > 1 is asked of reflected rays, too",
        "holes near contacts",
        "t > 1 is for camera rays alone; reflected rays count from t > 0.0001 on.",
        "reflections",
        "touching_spheres",
        {"reflection": beyond(1, GRAZING)},
    ),
    "R6": Mistake(
        "the reflection coefficient is ignored",
        "everything is chrome",
        "Multiply the reflected colour by kr.",
        "reflections",
        "example1",
        {"surfaces": slips.each(lambda surface: replace(surface, reflection=1.0))},
    ),
    "R7": Mistake(
        "reflected light is divided by the depth",
        "what is mirrored twice is dimmer",
        "Multiply by kr alone.",
        "reflections",
        "facing_mirrors",
        {"reflected_weight": lambda weight, coefficient, depth: weight * coefficient / depth},
    ),
    "R8": Mistake(
        "the surface's own colour is multiplied by 1 - kr",
        "mirrors are dark",
        "Add kr times the reflected colour to the whole local colour.",
        "reflections",
        "example1",
        {"surfaces": slips.each(lambda surface: slips.scaled(surface, 1 - surface.reflection))},
    ),
    "R9": Mistake(
        "reflections are tinted by the surface",
        "coloured mirrors",
        "The reflected colour is multiplied by kr, not by the surface's colour.",
        "reflections",
        "example1",
        compose=slips.tinted_reflection,
    ),
    "R10": Mistake(
        "the surface's colour and the reflected one are averaged",
        "dull mirrors",
        "The parts are added, not averaged.",
        "reflections",
        "example1",
        compose=slips.averaged,
    ),
    "R12/0": Mistake(
        "there are no reflections",
        "mirrors are matte",
        "Three bounces follow the first hit.",
        "reflections",
        "example1",
        depth=0,
    ),
    "R12/1": Mistake(
        "one bounce is followed, not three",
        "mirrors show no mirrors",
        "The first hit is depth 0, and three bounces follow.",
        "reflections",
        "facing_mirrors",
        depth=1,
    ),
    "R12/2": Mistake(
        "two bounces are followed, not three",
        "the last mirror in a mirror is missing",
        "The first hit is depth 0, and three bounces follow.",
        "reflections",
        "facing_mirrors",
        depth=2,
    ),
    "R12/10": Mistake(
        "ten bounces are followed, not three",
        "mirrors in mirrors in mirrors go on",
        "The first hit is depth 0, and three bounces follow.",
        "reflections",
        "facing_mirrors",
        depth=10,
    ),
    "R13": Mistake(
        "grey comes back at the depth limit",
        "a tint at the limit",
        "Where the limit is reached, only the local colour remains.",
        "reflections",
        "facing_mirrors",
        compose=slips.grey_at_the_limit,
    ),
    "R14": Mistake(
        "the background is not black",
        "a tint where rays meet nothing, and in mirrors",
        "A ray that meets nothing brings back (0, 0, 0).",
        "reflections",
        "example1",
        compose=slips.before((40.0, 60.0, 90.0)),
    ),
    "Q1": Mistake(
        "levels above 255 wrap around",
        "specks in highlights",
        "Clamp to 0..255 before the numbers become bytes.",
        "quantisation",
        "saturated_mirror",
        after=slips.wrapped,
    ),
    "Q2": Mistake(
        "levels are clamped at each bounce",
        "highlights are dim in mirrors",
        "Clamp once, at the end.",
        "quantisation",
        "saturated_mirror",
        compose=slips.clamped_at_each_bounce,
    ),
    "Q3": Mistake(
        "levels are rounded, not truncated",
        "one level too bright, here and there",
        "Truncate: int(level).",
        "quantisation",
        "fractions",
        after=np.rint,
        rounding=True,
    ),
    "Q4": Mistake(
        "gamma is applied",
        "washed out",
        "The levels are written as they are.",
        "quantisation",
        "example1",
        after=slips.brightened(2.2),
    ),
    "Q5": Mistake(
        "blue and red are swapped",
        "wrong colours",
        "The order is red, green, blue; OpenCV writes blue first.",
        "quantisation",
        "example4",
        after=lambda levels: levels[:, :, ::-1],
    ),
    "Q6": Mistake(
        "levels are divided by the largest",
        "the whole picture is darker or brighter",
        "Clamp to 0..255; do not normalise.",
        "quantisation",
        "example1",
        after=slips.normalised,
    ),
}


@dataclass(frozen=True)
class Family:
    """A mistake with a number: `of(value)` is the one with that value, `right` the value of a scene's right picture."""

    title: str  # with {value}
    unit: str
    bounds: tuple[float, float]
    right: Callable[[Scene], float]
    of: Callable[[float], Mistake]
    told: Callable[[float], str] = "{:.4g}".format

    def mistake(self, value: float, scene: Scene) -> Mistake:
        """The mistake with a value, told with the right one."""
        right = f"{self.told(self.right(scene))}{self.unit}"
        title = f"{self.title} is {self.told(value)}{self.unit}, not {right}"
        return replace(self.of(value), title=title)


def ambient_of(value: float) -> Mistake:
    """The ambient coefficient is another one."""
    return replace(
        MISTAKES["A2"],
        looks="shadows are too light or too dark",
        hint="Use the ambient coefficient that the file gives in its second line.",
        steps={"surfaces": lambda scene: replace(merge_coincident(scene), ambient_coefficient=value)},
    )


FAMILIES = {
    "C7": Family(
        "the field of view",
        " degrees",
        (20.0, 120.0),
        lambda scene: degrees(2 * atan(SCREEN / SCREEN_DISTANCE)),
        lambda value: replace(
            MISTAKES["C7"],
            steps={"camera_direction": slips.zoomed(tan(radians(value) / 2) * SCREEN_DISTANCE / SCREEN)},
        ),
    ),
    "A4": Family("the ambient coefficient", "", (0.0, 1.0), lambda scene: scene.ambient_coefficient, ambient_of),
    "S5": Family(
        "the least t of shadow rays",
        "",
        (0.0005, 0.9),
        lambda scene: SHIFT,
        lambda value: replace(MISTAKES["S5"], steps={"shadow": slips.between(value)}),
    ),
    "L7": Family(
        "the distance at which light has its full strength, as if it fell off with the square,",
        "",
        (100.0, 2000.0),
        lambda scene: np.inf,
        lambda value: replace(MISTAKES["L7"], steps={"cosine": slips.fading(value)}),
    ),
    "R14": Family(
        "the background",
        "",
        (1.0, 255.0),
        lambda scene: 0.0,
        lambda value: replace(MISTAKES["R14"], compose=slips.before((value, value, value))),
    ),
    "Q4": Family(
        "gamma",
        "",
        (0.3, 3.5),
        lambda scene: 1.0,
        lambda value: replace(MISTAKES["Q4"], after=slips.brightened(value)),
    ),
}


def light_at(place: tuple[float, float, float]) -> Mistake:
    """The light is at another place."""
    shown, right = (f"({x:.4g}, {y:.4g}, {z:.4g})" for x, y, z in (place, LIGHT))
    return Mistake(
        f"the light is at {shown}, not at {right}",
        "shadows and shading are of another light",
        "The light is at (500, 500, 500).",
        "diffuse",
        "example1",
        {"light": place},
    )
