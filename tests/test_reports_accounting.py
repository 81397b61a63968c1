"""Why a pixel differs: for each class scenes made by hand with a pixel that belongs to it, and its near misses."""

import json
from collections.abc import Iterable
from dataclasses import asdict, replace
from itertools import combinations
from math import hypot, inf, nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import EXAMPLE, ROOT
from random_scenes import random_scene
from recorded import facts

import reference.proof
import reports.accounting
from crossray import app
from reference import Plane, Scene, Sphere
from reference.image import Picture, write_image
from reference.proof import Prover
from reference.scene import Triple
from reference.text import dump
from reports.accounting import CLASSES, DOCUMENT_WINDOW, KNIFE_EDGE, LIMIT, PRECISION, Reason, account, explain_pixel
from reports.recording import Recording
from reports.writing import write_reports
from translator.contract import Limits
from translator.renderers import mitsuba, native, povray

SIDE = 10  # pixels
NONE = Limits()
EVERY = (NONE, native.LIMITS, povray.LIMITS, mitsuba.LIMITS)

# A pixel of a floor and what it shows, just left of a side wall behind which the light is.
PIXEL = (5, 7)
POINT = (20.0, -100.0, 400.0)
TO_LIGHT = (480.0, 600.0, 100.0)
FLOOR = Plane((200, 150, 100), (0, -100, 0), (0, 1, 0), 0.6, 0)
WALL = Plane((90, 90, 220), POINT, (-1, 0, 0), 0.8, 0)
AMBIENT = 0.3 * 255 / 256


def shade(plane: Plane, cosine: float) -> Triple:
    red, green, blue = (value * (AMBIENT + plane.diffuse * cosine) for value in plane.colour)
    return (red, green, blue)


DARK, LIT = shade(FLOOR, 0), shade(FLOOR, 600 / hypot(*TO_LIGHT))
WALL_LIT = shade(WALL, 480 / hypot(*TO_LIGHT))


def scene_of(*planes: Plane) -> Scene:
    return Scene((255, 255, 255), 0.3, (), planes)


def room(gap: float, mirror: float = 0, facing: float = -1) -> Scene:
    """The floor, and the wall `gap` to the right of the point. A floor that mirrors has no diffuse term."""
    wall = replace(WALL, point=(20 + gap, 0, 0), normal=(facing, 0, 0))
    return scene_of(replace(FLOOR, reflection=mirror, diffuse=0) if mirror else FLOOR, wall)


def why(scene: Scene, value: Iterable[float], limits: Limits = NONE, pixel: tuple[int, int] = PIXEL) -> Reason | None:
    red, green, blue = map(float, value)
    return explain_pixel(Prover(scene, width=SIDE, height=SIDE), asdict(limits), *pixel, (red, green, blue))


def between(one: Triple, other: Triple, share: float = 0.5) -> list[float]:
    return [a + (b - a) * share for a, b in zip(one, other, strict=True)]


def colours(scene: Scene, pixel: tuple[int, int]) -> list[Triple]:
    found = Prover(scene, width=SIDE, height=SIDE).admissible(*pixel)
    assert found.complete
    return [colour.value for colour in found.colours]


def test_rays_that_start_off_their_surface_pass_what_stands_there() -> None:
    """Up by 1e-3 of 401 the shadow ray's start is still before the wall, which slants; by 1.5e-3 it is beyond."""
    scene = scene_of(FLOOR, replace(WALL, point=(20.055, -100, 400), normal=(1, 0.1, 0)))
    reason = why(scene, LIT, Limits(ahead=1.5e-3))
    assert reason == Reason(LIMIT, "the colour by rays that start off their surface, by 0.0015 of the coordinates")
    assert why(scene, np.add(LIT, 1), Limits(ahead=1.5e-3)) is None
    assert why(scene, LIT, Limits(ahead=1e-3)) is None
    assert why(scene, LIT, Limits(ahead=1.5e-3, origin=POINT)) is None


CORNER = Scene.load(ROOT / "scenes" / "diagnostic" / "corner_tie.txt")
TIES = [(0, 9), (1, 8)]  # on the diagonal, where side wall and floor meet: each of them lit, or in the other's shadow


@pytest.mark.parametrize("limits", EVERY)
@pytest.mark.parametrize("pixel", TIES)
def test_knife_edge_takes_its_admissible_colours_and_no_other(pixel: tuple[int, int], limits: Limits) -> None:
    found = colours(CORNER, pixel)
    assert len(found) == 4
    for colour in found:
        for off in (-0.49, 0, 0.49):
            reason = why(CORNER, np.add(colour, off), limits, pixel)
            assert reason == Reason(KNIFE_EDGE, "one of 4 admissible colours")
        for off in (-1, -0.51, 0.51, 1):
            assert why(CORNER, np.add(colour, (0, off, 0)), limits, pixel) is None
    for one, other in combinations(found, 2):
        assert why(CORNER, between(one, other), limits, pixel) is None
        assert why(CORNER, (one[0], other[1], one[2] + 1), limits, pixel) is None
    assert why(CORNER, (0, 0, 0), limits, pixel) is None


def test_pixel_beside_a_knife_edge_is_none() -> None:
    for colour in colours(CORNER, TIES[0]):
        assert why(CORNER, np.add(colour, 1), NONE, (0, 8)) is None
        assert why(CORNER, np.add(colour, 1), NONE, (1, 9)) is None
    one, other = colours(CORNER, (0, 8)), colours(CORNER, (1, 9))
    assert (len(one), len(other)) == (1, 1)
    assert why(CORNER, other[0], mitsuba.LIMITS, (0, 8)) is None
    assert why(CORNER, one[0], mitsuba.LIMITS, (1, 9)) is None


def test_knife_edge_with_more_colours_than_are_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    first, *others = colours(CORNER, TIES[0])
    monkeypatch.setattr(reference.proof, "LARGEST_SET", 1)
    assert [why(CORNER, colour, NONE, TIES[0]) for colour in (first, *others)] == [None] * 4


@pytest.mark.parametrize("gap", [0.001, 0.02, 0.047])
@pytest.mark.parametrize("limits", EVERY)
def test_shadow_within_the_documents_window(gap: float, limits: Limits) -> None:
    """The wall is at most 1e-4 of the way to the light from the point, which is 0.048 to the right."""
    scene = room(gap)
    assert colours(scene, PIXEL) == [pytest.approx(DARK)]
    assert why(scene, LIT, limits) == Reason(DOCUMENT_WINDOW, "the colour by the document's text")
    assert why(scene, np.add(LIT, (0, 0, 0.51)), limits) is None
    assert why(scene, between(DARK, LIT), limits) is None
    assert why(scene, (0, 0, 0), limits) is None


@pytest.mark.parametrize("limits", [NONE, native.LIMITS, povray.LIMITS])
def test_shadow_beyond_the_documents_window(limits: Limits) -> None:
    assert why(room(0.049), LIT, limits) is None


def test_mirrored_wall_within_the_documents_window() -> None:
    """Along the mirrored ray (5, 25, 100) the wall is 20.6 times as far away as to the right; the window is 1e-4."""
    for gap, kind in [(4e-6, DOCUMENT_WINDOW), (4.8e-6, DOCUMENT_WINDOW), (4.9e-6, None), (4e-4, None)]:
        scene = room(gap, mirror=0.5)
        (seen,) = colours(scene, PIXEL)
        assert max(np.subtract(seen, DARK)) > 1
        assert getattr(why(scene, DARK), "kind", None) == kind
        assert why(scene, between(DARK, seen)) is None


ALONG = hypot(*TO_LIGHT) / 480  # how far along the shadow ray for 1 to the right
ALONG_MIRROR = hypot(5, 25, 100) / 5


@pytest.mark.parametrize("gap", [0.05, 0.1, 2.0])
def test_blocker_nearer_than_the_declared_gap(gap: float) -> None:
    scene, distance = room(gap), gap * ALONG
    wide, narrow = distance * (1 + 1e-9), distance * (1 - 1e-9)
    evidence = f"the other side of a branch, reached by missing what is nearer than {wide:g} to the start of a ray"
    assert why(scene, LIT, Limits(gap=wide)) == Reason(LIMIT, evidence)
    assert why(scene, LIT, Limits(gap=narrow)) is None
    assert why(scene, LIT) is None
    assert why(scene, np.add(LIT, 0.51), Limits(gap=wide)) is None
    assert why(scene, between(DARK, LIT), Limits(gap=wide)) is None


@pytest.mark.parametrize("gap", [1e-5, 4e-4])
def test_mirrored_wall_nearer_than_the_declared_gap(gap: float) -> None:
    scene, distance = room(gap, mirror=0.5), gap * ALONG_MIRROR
    (seen,) = colours(scene, PIXEL)
    reason = why(scene, DARK, Limits(gap=distance * (1 + 1e-9)))
    assert reason
    assert reason.kind == LIMIT
    assert why(scene, DARK, Limits(gap=distance * (1 - 1e-9))) is None
    assert why(scene, between(DARK, seen), Limits(gap=distance * 2)) is None


def test_gap_and_precision_together() -> None:
    """The blocker is beyond the gap, but not for certain at the precision."""
    scene, gap = room(0.1), 0.1 * ALONG - 1e-5
    assert why(scene, LIT, Limits(gap=gap)) is None
    assert why(scene, LIT, Limits(precision=2.0**-20)) is None
    reason = why(scene, LIT, Limits(precision=2.0**-20, gap=gap))
    assert reason
    assert reason.kind == LIMIT
    assert reason.evidence.endswith(
        f"missing what is nearer than {gap:g} to the start of a ray and an error of 2^-24 of the coordinates"
    )
    assert why(scene, LIT, Limits(precision=2.0**-40, gap=gap)) is None


# How far beside the edge, as a share of 20: 1e-8, 2e-7, 5e-6.
@pytest.mark.parametrize(("gap", "step"), [(2e-7, -28), (4e-6, -24), (1e-4, -20)])
def test_edge_nearer_than_the_precision(gap: float, step: int) -> None:
    """The pixel shows the floor, in the wall's shadow, and at the other side of the edge the wall, in the light."""
    scene = room(gap, facing=1)
    assert colours(scene, PIXEL) == [pytest.approx(DARK)]
    evidence = f"the other side of a branch, reached by an error of 2^{step} of the coordinates"
    limits = Limits(precision=2.0**-20)
    assert why(scene, WALL_LIT, limits) == Reason(PRECISION, evidence)
    assert why(scene, WALL_LIT, Limits(2.0**-20, 0.1)) == Reason(PRECISION, evidence)
    assert why(scene, np.add(WALL_LIT, 0.09), limits) == Reason(PRECISION, evidence)
    assert why(scene, np.add(WALL_LIT, 0.2), limits) is None
    assert why(scene, between(DARK, WALL_LIT), limits) is None
    assert why(scene, WALL_LIT, Limits(precision=2.0**-40)) is None
    assert why(scene, WALL_LIT) is None


def test_edge_farther_than_the_precision() -> None:
    scene = room(2e-3, facing=1)
    assert why(scene, WALL_LIT, Limits(precision=2.0**-20)) is None
    assert why(scene, WALL_LIT, mitsuba.LIMITS) is None
    reason = why(scene, WALL_LIT, Limits(precision=2.0**-12))
    assert reason
    assert reason.evidence.endswith("an error of 2^-16 of the coordinates")


@pytest.mark.parametrize("gap", [1e-5, -1e-5, 0.1, -0.1])
def test_shadow_edge_nearer_than_the_precision(gap: float) -> None:
    """A sphere half way to the light, `gap` off the shadow ray: one side of the edge is lit, the other dark."""
    across = 20 + gap
    middle = [point + way / 2 for point, way in zip(POINT, TO_LIGHT, strict=True)]
    centre = (middle[0] + across * 600 / hypot(480, 600), middle[1] - across * 480 / hypot(480, 600), middle[2])
    scene = replace(scene_of(FLOOR), spheres=(Sphere((50, 50, 50), centre, 20, 1, 0),))
    truth, other = (LIT, DARK) if gap > 0 else (DARK, LIT)
    assert colours(scene, PIXEL) == [pytest.approx(truth)]
    reason = why(scene, other, Limits(precision=2.0**-20))
    assert getattr(reason, "kind", None) == (PRECISION if abs(gap) < 1e-4 else None)
    assert why(scene, other, Limits(precision=2.0**-40)) is None
    assert why(scene, between(truth, other), Limits(precision=2.0**-20)) is None


def test_branch_that_agrees_with_the_truth_explains_nothing() -> None:
    """Floor and wall differ by 0.3 levels: a renderer on either side of the edge agrees."""
    floor, wall = room(2e-7).planes
    red, green, blue = ((value + 0.3) / AMBIENT for value in DARK)
    scene = scene_of(floor, replace(wall, colour=(red, green, blue)))
    assert why(scene, np.add(DARK, 0.7), povray.LIMITS) is None


def test_document_explains_nothing_where_it_does_not_part() -> None:
    scene = room(5)
    assert why(scene, np.add(colours(scene, PIXEL)[0], 0.49)) is None


def test_colour_that_is_no_number_explains_nothing() -> None:
    """A mirror shows the point of a plane in which the light is: n.l is not defined, ambient light is there."""
    mirror, plane = Plane((0, 0, 0), (0, 0, 2000), (0, 0, -1), 0, 1), Plane((200,) * 3, (0, 500, 0), (0, -1, 0), 1, 0)
    prover = Prover(scene_of(mirror, plane), width=7, height=7)
    assert explain_pixel(prover, {}, 4, 2, (0, 0, 0)) is None


@pytest.mark.parametrize("limits", EVERY)
@pytest.mark.parametrize("scene", [room(5), Scene.load(EXAMPLE)], ids=["room", "example"])
def test_small_error_is_unexplained(scene: Scene, limits: Limits) -> None:
    for row in range(SIDE):
        for column in range(SIDE):
            for colour in colours(scene, (column, row)):
                assert why(scene, np.add(colour, (0.6, 0, 0)), limits, (column, row)) is None


def test_errors_in_random_scenes_are_unexplained() -> None:
    pick = np.random.default_rng(8)
    explained, most = 0, 0
    for seed in range(30):
        scene = random_scene(seed)
        prover = Prover(scene, width=200, height=200)
        for column, row in pick.integers(0, 200, (10, 2)).tolist():
            truth = prover.admissible(column, row).colours[0].value
            red, green, blue = np.clip(truth, 0, 200) + pick.uniform(0.6, 40, 3)
            explained += bool(explain_pixel(prover, asdict(mitsuba.LIMITS), column, row, (red, green, blue)))
            most += 1
    assert (explained, most) == (0, 300)


@pytest.mark.parametrize("limits", EVERY)
@pytest.mark.parametrize("wrong", [nan, inf, -inf])
def test_what_is_no_number_is_unexplained(wrong: float, limits: Limits) -> None:
    for colour in colours(CORNER, TIES[0]):
        for channel in range(3):
            value = list(colour)
            value[channel] = wrong
            assert why(CORNER, value, limits, TIES[0]) is None
    assert why(room(0.02), (*LIT[:2], wrong), limits) is None
    assert why(room(5), (wrong, wrong, wrong), limits) is None


def test_channels_over_255_are_clamped() -> None:
    bright = replace(CORNER, planes=tuple(replace(plane, colour=(2000, 100, 100)) for plane in CORNER.planes))
    bright = replace(bright, planes=(replace(bright.planes[0], colour=(2000, 10, 10)), *bright.planes[1:]))
    found = colours(bright, TIES[0])
    assert min(colour[0] for colour in found) > 300
    for colour in found:
        for red in (254.6, 255, 256, 300, 1e30):
            reason = why(bright, (red, *colour[1:]), NONE, TIES[0])
            assert reason
            assert reason.kind == KNIFE_EDGE
        for red in (254.4, 200, 0, -300):
            assert why(bright, (red, *colour[1:]), NONE, TIES[0]) is None


def test_after_very_many_unexplained_pixels_none_is_examined(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reports.accounting, "GIVE_UP", 0)
    prover = Prover(CORNER, width=SIDE, height=SIDE)
    picture = np.full((SIDE, SIDE, 3), 300.0)
    (column, row), other = TIES[0], np.array([(y, x) for y in range(SIDE) for x in range(SIDE) if (x, y) not in TIES])
    picture[row, column] = colours(CORNER, TIES[0])[1]
    for before, explained in [(49, True), (50, False), (51, False)]:
        places = np.concatenate([other[:before], [(row, column)]])
        reasons = account(prover, {}, picture, places)
        assert [reason is not None for reason in reasons] == [False] * before + [explained]
    monkeypatch.setattr(reports.accounting, "GIVE_UP", 60 * prover.surfaces)
    assert account(prover, {}, picture, np.concatenate([other[:59], [(row, column)]]))[-1]
    assert not account(prover, {}, picture, np.concatenate([other[:60], [(row, column)]]))[-1]


def test_explained_pixels_do_not_use_up_the_examination(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reports.accounting, "GIVE_UP", 0)
    (column, row), (first, *_) = TIES[0], colours(CORNER, TIES[0])
    picture = np.full((SIDE, SIDE, 3), first)
    reasons = account(Prover(CORNER, width=SIDE, height=SIDE), {}, picture, np.array([(row, column)] * 60))
    assert all(reasons)


def judged(folder: Path, text: str | None, truth: Picture, picture: Picture, limits: Limits = NONE) -> dict[str, Any]:
    """The comparison as it is reported; every pixel is counted once."""
    run = Recording(folder, "0.1.0")
    height, width, _ = truth.shape
    entry = run.add_scene("scene.txt", width, height, depth=3, convention="exact", text=text)
    run.add_picture(entry, facts("certified"), truth)
    run.add_picture(entry, {**facts("povray"), "limits": asdict(limits)}, picture)
    found: dict[str, Any]
    (found,) = write_reports(folder)["scenes"][0]["comparisons"]
    pixels = found["pixels"]
    assert pixels["total"] == width * height
    assert pixels["total"] == pixels["agree"] + sum(pixels["explained"].values()) + pixels["unexplained"]
    assert pixels["total"] - pixels["agree"] == found["over"]["0.5"]
    assert all(pixels["explained"].values())
    assert list(pixels["explained"]) == [kind for kind in CLASSES if kind in pixels["explained"]]
    assert found["verdict"] == ("disagree" if pixels["unexplained"] else "agree")
    return found


def drawn(scene: Scene) -> Picture:
    """The truth; at a tie the colour of the first listed."""
    rows = [[colours(scene, (column, row))[0] for column in range(SIDE)] for row in range(SIDE)]
    return np.array(rows)


def kinds(comparison: dict[str, Any]) -> list[tuple[int, int, str | None]]:
    return [(pixel["column"], pixel["row"], pixel["class"]) for pixel in comparison["worst"]]


def test_unexplained_pixels_are_listed_first_then_the_largest_error(tmp_path: Path) -> None:
    truth = drawn(CORNER)
    picture = truth.copy()
    for column, row in TIES:
        picture[row, column] = colours(CORNER, (column, row))[1]
    for column, row, off in [(7, 2, 2), (3, 3, 30), (8, 2, 2), (2, 1, 2), (5, 5, 0.4)]:
        picture[row, column] += off
    comparison = judged(tmp_path, dump(CORNER), truth, picture)
    assert comparison["pixels"] == {"total": 100, "agree": 94, "explained": {KNIFE_EDGE: 2}, "unexplained": 4}
    unexplained = [(3, 3, None), (2, 1, None), (7, 2, None), (8, 2, None)]
    assert kinds(comparison)[:4] == unexplained
    assert sorted(kinds(comparison)[4:]) == [(*place, KNIFE_EDGE) for place in TIES]
    assert max(pixel["error"] for pixel in comparison["worst"][:4]) < min(
        pixel["error"] for pixel in comparison["worst"][4:]
    )
    (written,) = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["scenes"][0]["comparisons"]
    assert (written["pixels"], written["worst"]) == (comparison["pixels"], comparison["worst"])


def test_every_class_in_one_picture(tmp_path: Path) -> None:
    """Floor and back wall tie in a row; beside the side wall the classes that its distance from the point makes."""
    for gap, value, limits, kind in [
        (0.02, LIT, NONE, DOCUMENT_WINDOW),
        (0.1, LIT, Limits(gap=0.2), LIMIT),
        (1e-4, WALL_LIT, mitsuba.LIMITS, PRECISION),
    ]:
        side = replace(WALL, point=(20 + gap, 0, 0), normal=(1 if kind == PRECISION else -1, 0, 0))
        back = Plane((50, 200, 200), (0, 0, 2000), (0, 0, -1), 0.5, 0)
        scene = scene_of(FLOOR, side, back)
        truth = drawn(scene)  # floor and back wall meet in row 5, at y = -5
        picture = truth.copy()
        picture[5, 3] = colours(scene, (3, 5))[1]
        picture[PIXEL[::-1]] = value
        comparison = judged(tmp_path / kind, dump(scene), truth, picture, limits)
        assert comparison["pixels"]["explained"] == {KNIFE_EDGE: 1, kind: 1}
        assert comparison["verdict"] == "agree"
        assert {pixel["class"] for pixel in comparison["worst"]} == {KNIFE_EDGE, kind}
        assert all(pixel["evidence"] for pixel in comparison["worst"])


def test_pixels_that_are_no_number_disagree(tmp_path: Path) -> None:
    truth = drawn(CORNER)
    picture = truth.copy()
    picture[9, 0] = nan
    picture[8, 1, 1] = inf
    picture[2, 2, 0] = -inf
    comparison = judged(tmp_path, dump(CORNER), truth, picture, mitsuba.LIMITS)
    assert comparison["pixels"] == {"total": 100, "agree": 97, "explained": {}, "unexplained": 3}


def test_255_agrees_with_300(tmp_path: Path) -> None:
    truth, picture = np.full((SIDE, SIDE, 3), 300.0), np.full((SIDE, SIDE, 3), 255.0)
    picture[4, 4] = 254
    comparison = judged(tmp_path, dump(CORNER), truth, picture)
    assert comparison["pixels"] == {"total": 100, "agree": 99, "explained": {}, "unexplained": 1}


@pytest.mark.parametrize("text", [None, "", "nonsense", dump(CORNER) + "7\n", dump(CORNER).replace("0.3", "nan")])
def test_without_a_scene_that_can_be_read_nothing_is_explained(text: str | None, tmp_path: Path) -> None:
    truth = drawn(CORNER)
    picture = truth.copy()
    for column, row in TIES:
        picture[row, column] = colours(CORNER, (column, row))[1]
    comparison = judged(tmp_path, text, truth, picture, mitsuba.LIMITS)
    assert comparison["pixels"] == {"total": 100, "agree": 98, "explained": {}, "unexplained": 2}
    assert sorted(kinds(comparison)) == [(*place, None) for place in TIES]


def test_scene_that_warns_is_explained(tmp_path: Path) -> None:
    """Numbers outside the usual range are legal."""
    scene = replace(CORNER, planes=(replace(CORNER.planes[0], colour=(300, -5, 0)), *CORNER.planes[1:]))
    truth = drawn(scene)
    picture = truth.copy()
    picture[9, 0] = colours(scene, (0, 9))[1]
    assert judged(tmp_path, dump(scene), truth, picture)["pixels"]["explained"] == {KNIFE_EDGE: 1}


def test_compare_explains_nothing(tmp_path: Path) -> None:
    truth = drawn(CORNER)
    picture = truth.copy()
    picture[9, 0] = colours(CORNER, (0, 9))[1]
    paths = [tmp_path / "right.exr", tmp_path / "other.exr"]
    for path, levels in zip(paths, (truth, picture), strict=True):
        write_image(path, levels)
    result = CliRunner().invoke(app, ["compare", *map(str, paths), "--out", str(tmp_path / "out")])
    assert result.exit_code == 1
    (comparison,) = json.loads((tmp_path / "out/report.json").read_text(encoding="utf-8"))["scenes"][0]["comparisons"]
    assert comparison["pixels"] == {"total": 100, "agree": 99, "explained": {}, "unexplained": 1}
    assert comparison["verdict"] == "disagree"
