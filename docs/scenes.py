"""Write docs/scenes.md, what the scenes of scenes/diagnostic reveal: `make docs`."""

from __future__ import annotations

import sys
from pathlib import Path

from reference import Scene

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from mistakes import MISTAKES, SIDE, share  # noqa: E402

PAGE = ROOT / "docs" / "scenes.md"
FOLDER = ROOT / "scenes" / "diagnostic"
FEWEST = 10 / SIDE**2  # the least share that is listed
HIDDEN = 0.0005  # the largest share in an example that passes unseen

PURPOSES = {
    "behind_eye": "A ball behind the eye shows in the mirror only; where t < 0 counts, its ghost hangs in front.",
    "bright_ambient": "Nothing but ambient light: with / 255 a channel of every pixel is one level higher.",
    "coincident": "Two balls, and two floors, are in the same place: the first listed is seen, without speckles.",
    "coloured_ambient": "The ambient light is orange: it shows in shadows and must not tint what the white light adds.",
    "corner_tie": "Pixel rays meet the edge of wall and floor exactly: there the first listed, the wall, is seen.",
    "eye_inside": "Eye and floor are inside a ball, the light is not: camera and shadow rays meet it from inside.",
    "eye_on_plane": "A plane through the eye is seen in mirrors only, and shades all that is below it.",
    "facing_mirrors": "Two walls mirror each other, one of them behind the eye: every bounce shows a ball more. "
    "Where the depth never grows (R11), the picture never ends.",
    "far_plane": "The wall is 30 million units away, beyond any limit that seemed large enough.",
    "fractions": "Nothing but ambient light: every level ends in .625, which rounding takes up and truncation down.",
    "horizon": "The floor ends at its horizon, which meets a row of pixel centres exactly: d.n = 0.",
    "inside_mirror": "The eye is inside a mirroring ball, which reflects itself until the depth limit.",
    "light_inside": "The light is inside a ball, which the screen cuts open: we see into it, and all outside is dark.",
    "light_on_plane": "The light lies exactly on the back wall, where t = 1: the wall casts no shadow.",
    "light_on_sphere": "The light lies exactly on a ball, where t = 1: the ball shades only by its other root.",
    "long_normal": "The normals of floor and wall have length 2 and 3.",
    "near_cross": "The screen cuts two balls: where the near root is before it, the far root is seen.",
    "near_front": "A ball before the screen is unseen, but casts a shadow and shows in the mirror.",
    "near_unit": "Two balls are before the screen, one of them within one unit of the eye: that tells C9 from C10.",
    "plane_back": "Floor and wall face away: they are seen and mirror, but only ambient light reaches that side.",
    "plane_lit_behind": "A ceiling between eye and light faces the light: it is seen lit, and shades all below.",
    "plane_shadow": "A wall on the right stands between the light and all that is seen.",
    "saturated_mirror": "A floor far brighter than 255 is seen in a ball that reflects half of it.",
    "sky_dome": "Eye, light and scene are inside one ball, the sky.",
    "tangent": "Twelve pixel rays touch the ball in exactly one point, which is a hit.",
    "thin_gap": "Pebbles lie half a unit above the floor: a large offset loses shadows as short as theirs.",
    "tiny_normal": "The normal of the floor has length 0.000000001.",
    "touching_spheres": "Mirroring balls touch and cut one another: near there, reflected rays are short.",
}


def load_all(folder: Path) -> dict[str, Scene]:
    """The scenes of a folder, by name."""
    return {path.stem: Scene.load(path) for path in sorted(folder.glob("*.txt"))}


def revealed(scene: Scene) -> dict[str, float]:
    """The mistakes that a scene reveals, with their shares, largest first; of rounding, what changes every pixel."""
    shares = {name: share(scene, mistake) for name, mistake in MISTAKES.items()}
    listed = [name for name in shares if shares[name] >= (1 if MISTAKES[name].rounding else FEWEST)]
    return {name: shares[name] for name in sorted(listed, key=lambda name: -shares[name])}


def percent(share: float) -> str:
    """Two digits or so: 98 %, 4.5 %, 0.12 %, 0."""
    value = 100 * share
    if not value:
        return "0"
    return f"{value:.0f} %" if value >= 10 else f"{value:.1f} %" if value >= 1 else f"{value:.2f} %"


def page() -> str:
    """The text of docs/scenes.md."""
    examples = load_all(ROOT / "scenes").values()
    known = {
        name: 0.0 if mistake.rounding else max(share(scene, mistake) for scene in examples)
        for name, mistake in MISTAKES.items()
    }
    lines = [INTRODUCTION, "| scene | what it reveals | mistakes |", "|---|---|---|"]
    for name, scene in load_all(FOLDER).items():
        found = [
            f"**{mistake} {percent(size)}**" if known[mistake] <= HIDDEN else f"{mistake} {percent(size)}"
            for mistake, size in revealed(scene).items()
        ]
        lines.append(f"| [{name}](../scenes/diagnostic/{name}.txt) | {PURPOSES[name]} | {', '.join(found)} |")
    lines += ["", "## The mistakes", "", "| | mistake | at most, in an example |", "|---|---|---|"]
    for name, mistake in MISTAKES.items():
        lines.append(f"| {name} | {mistake.summary} | {'one level' if mistake.rounding else percent(known[name])} |")
    return "\n".join(lines) + "\n"


INTRODUCTION = f"""\
# What the diagnostic scenes reveal

The document's four examples hide many mistakes. Each scene in `scenes/diagnostic` is small and shows one thing.

Beside a mistake stands the share of {SIDE} x {SIDE} pixels whose 8-bit levels are off by more than 8 when only that
mistake is made. **Bold** are those that no example shows. A1 and Q3 change one level at most, somewhere in any scene;
they are listed where they change every pixel. This page is written by `make docs`.
"""


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
