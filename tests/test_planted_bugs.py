"""Bugs planted in renderers come out unexplained: no class of differences swallows them, and none is seen without."""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, inf, radians, sin
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest
from click.testing import CliRunner
from helpers import ROOT, need, need_renderer

from crossray import app
from reference import EXACT, Scene, render
from reference.image import write_image
from reference.model import Model, Number
from reference.scene import merge_coincident
from translator.contract import PYTHON, Export, Settings
from translator.registry import adapter
from translator.renderers import native, povray

EXAMPLES = sorted((ROOT / "scenes").glob("example?.txt"))
DIAGNOSTIC = sorted((ROOT / "scenes" / "diagnostic").glob("*.txt"))
PLANE_SHADOW = ROOT / "scenes" / "diagnostic" / "plane_shadow.txt"
MOST = 0.8  # of the differing pixels are unexplained
FARTHER_THAN_MIRRORED = 1e5  # the square of a direction's length, of shadow rays alone: the light is 316 away


def side(path: Path) -> int:
    return 250 if path in EXAMPLES else 200


def check(path: Path, folder: Path, *names: str, size: str = "") -> tuple[int, list[dict[str, Any]]]:
    """`crossray check` of these renderers in this process: its exit code and the comparisons of its report."""
    size = size or f"{side(path)}x{side(path)}"
    result = CliRunner().invoke(app, ["check", str(path), "--size", size, "--out", str(folder), "--with", *names])
    assert isinstance(result.exception, SystemExit | None), result.exception
    (scene,) = json.loads((folder / "report.json").read_text(encoding="utf-8"))["scenes"]
    assert scene["reference"]["status"] == "rendered"
    return result.exit_code, scene["comparisons"]


@dataclass(frozen=True)
class Bug:
    """A mistake, as an edit of POV-Ray's scene and as a step of the model."""

    edit: Callable[[str], str]
    model: Model
    paths: list[Path]


def smaller_casters(text: str) -> str:
    """Each sphere casts the shadow of one that is 2 % smaller: a larger one would hide the sphere itself."""

    def split(sphere: re.Match[str]) -> str:
        start, radius, rest = sphere.groups()
        caster = f"{start}{float(radius) * 0.98!r}{rest}"
        return within(sphere[0], "no_shadow") + within(caster, "no_image no_reflection")

    return re.sub(r"(sphere \{ <[^>]*>\*Unit, )([0-9.e+-]+)(\*Unit\n.*?\n\}\n)", split, text, flags=re.DOTALL)


def within(block: str, words: str) -> str:
    """The block with these words at the end of its first object."""
    return block.replace("\n}\n", f"\n  {words}\n}}\n", 1)


def of_plane(number: int, words: str) -> Callable[[str], str]:
    def edit(text: str) -> str:
        before, start, block = text.partition(f"// plane {number}\n")
        return before + start + within(block, words)

    return edit


def stronger_mirrors(text: str) -> str:
    return re.sub(r"reflection \{ ([0-9.]+) \}", lambda found: f"reflection {{ {float(found[1]) * 1.01!r} }}", text)


def tilt(scene: Scene) -> Scene:
    """The first plane turned about an axis along x by 0.1 degrees."""
    first, *others = merge_coincident(scene).planes
    x, y, z = first.unit_normal
    c, s = cos(radians(0.1)), sin(radians(0.1))
    turned = replace(first, normal=(x, c * y - s * z, s * y + c * z))
    return replace(merge_coincident(scene), planes=(turned, *others))


def larger_casters(p: Any, d: Any, dd: Number, radius: Number, leaving: Any) -> tuple[Number, Number]:
    return EXACT.sphere_distances(p, d, dd, dr.select(dd > FARTHER_THAN_MIRRORED, 1.02 * radius, radius), leaving)


def no_plane(t: Number, *_: Any) -> Any:
    return t < -inf


BUGS = {
    "shadows off by 2 %": Bug(smaller_casters, replace(EXACT, sphere_distances=larger_casters), EXAMPLES),
    "kr x 1.01": Bug(
        stronger_mirrors,
        replace(EXACT, reflected_weight=lambda weight, kr, depth: EXACT.reflected_weight(weight, 1.01 * kr, depth)),
        EXAMPLES,
    ),
    "a normal tilted by 0.1 degrees": Bug(of_plane(1, "rotate 0.1*x"), replace(EXACT, surfaces=tilt), EXAMPLES),
    "a plane casts no shadow": Bug(
        of_plane(3, "no_shadow"), replace(EXACT, shadow=replace(EXACT.shadow, plane=no_plane)), [PLANE_SHADOW]
    ),
}
CASES = pytest.mark.parametrize(
    ("name", "path"),
    [(name, path) for name, bug in BUGS.items() for path in bug.paths],
    ids=lambda value: value.stem if isinstance(value, Path) else value,
)


def is_found(code: int, comparison: dict[str, Any]) -> None:
    pixels = comparison["pixels"]
    different = pixels["total"] - pixels["agree"]
    counts = f"{pixels['unexplained']} unexplained, {pixels['explained']}"
    assert (code, comparison["status"], comparison["verdict"]) == (1, "rendered", "disagree"), counts
    assert pixels["unexplained"] > 0, counts
    assert pixels["unexplained"] >= MOST * different, counts


@CASES
def test_bug_in_povray(name: str, path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    need("povray")
    right = povray.export

    def export(scene: Scene, settings: Settings) -> Export:
        exported = right(scene, settings)
        edited = BUGS[name].edit(exported.files["scene.pov"])
        assert edited != exported.files["scene.pov"]
        return replace(exported, files={"scene.pov": edited})

    monkeypatch.setattr(povray, "export", export)
    code, (comparison,) = check(path, tmp_path, "povray")
    is_found(code, comparison)


@CASES
def test_bug_in_our_tracer(name: str, path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    picture = render(Scene.load(path), BUGS[name].model, width=side(path), height=side(path), dtype=np.float64)
    write_image(tmp_path / "planted.exr", picture)
    program = f"import shutil; shutil.copy({str(tmp_path / 'planted.exr')!r}, 'scene.exr')"

    def export(scene: Scene, settings: Settings) -> Export:
        return Export({}, (PYTHON, "-c", program), "scene.exr", limits=native.LIMITS)

    monkeypatch.setattr(native, "export", export)
    code, (comparison,) = check(path, tmp_path, "native")
    is_found(code, comparison)


def of_spheres(**factors: float) -> Callable[[Scene], Scene]:
    """Each sphere with these values multiplied."""

    def change(scene: Scene) -> Scene:
        changed = (
            replace(ball, **{name: getattr(ball, name) * factors[name] for name in factors}) for ball in scene.spheres
        )
        return replace(scene, spheres=tuple(changed))

    return change


def tilt_more(scene: Scene) -> Scene:
    return tilt(tilt(scene))


CHANGES: dict[str, Callable[[Scene], Scene]] = {
    "kd x 0.97": of_spheres(diffuse=0.97),
    "radius x 1.002": of_spheres(radius=1.002),
    "a normal tilted by 0.2 degrees": tilt_more,
}
LAMPS = {  # files and what in them moves the light by 20
    "cycles": ("scene.py", "LIGHT = (500,", "LIGHT = (520,"),
    "mitsuba": ("scene.xml", 'value="500.0 ', 'value="520.0 '),
    "mitsuba-stock": ("light.xml", 'name="position" value="500.0 ', 'name="position" value="520.0 '),
    "radiance": ("light.rad", "4 500.0 ", "4 520.0 "),
    "tachyon": ("scene.dat", "LIGHT CENTER 500.0 ", "LIGHT CENTER 520.0 "),
}


@pytest.mark.parametrize("change", [*CHANGES, "light + 20"])
@pytest.mark.parametrize("name", LAMPS)
def test_bug_in_another_renderer(name: str, change: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    need_renderer(name)
    module = adapter(name)
    right = module.export

    def export(scene: Scene, settings: Settings) -> Export:
        exported = right(scene, settings)
        if change in CHANGES:
            files = right(CHANGES[change](scene), settings).files
        else:
            file, old, new = LAMPS[name]
            files = {**exported.files, file: exported.files[file].replace(old, new)}
        assert files != exported.files
        return replace(exported, files=files)

    monkeypatch.setattr(module, "export", export)
    code, (comparison,) = check(EXAMPLES[2], tmp_path, name, size="24x24")
    is_found(code, comparison)


@pytest.mark.parametrize("path", [*EXAMPLES, *DIAGNOSTIC], ids=lambda path: path.stem)
def test_no_renderer_has_unexplained_pixels(path: Path, tmp_path: Path) -> None:
    need("povray")
    code, comparisons = check(path, tmp_path, "native", "povray", "mitsuba")
    for comparison in comparisons:
        assert comparison["status"] in ("rendered", "unsupported"), comparison["reason"]
        if comparison["status"] == "rendered":
            wrong = [pixel for pixel in comparison["worst"] if not pixel["class"]]
            assert (comparison["pixels"]["unexplained"], wrong) == (0, []), comparison["renderer"]
            assert comparison["verdict"] == "agree"
    assert code == 0
    assert comparisons[0]["status"] == "rendered"


# A mirrored ray that meets the wall 2e8 away; POV-Ray ignores what is beyond 1e8, which its adapter knows of objects.
FAR = """\
255 255 255
0.5
0
2
0 0 0
0 0 300
0 1 -1
0
1
200 200 200
1000 0 0
-1 -0.000005 0.001
0
0
"""


def test_hits_too_far_for_povray_are_explained(tmp_path: Path) -> None:
    need("povray")
    path = tmp_path / "far.txt"
    path.write_text(FAR, encoding="utf-8")
    _, (comparison,) = check(path, tmp_path / "out", "povray", size="1x1")
    assert comparison["pixels"]["unexplained"] == 0
