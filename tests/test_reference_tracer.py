"""The tracer against an independent transcription of the assignment, and against itself."""

import os
import random
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest
import transcription

import reference
from reference import device, tables, tracer, world
from reference.errors import DeviceError, InputError
from reference.explanation import explain
from reference.image import quantise, read_image
from reference.model import CONVENTIONS, DOCUMENT, EXACT, PUBLISHED, Model
from reference.scene import Plane, Scene, Sphere, Triple, holds_light
from reference.text import dump, parse
from reference.tracer import render

SCENES = Path(__file__).parent.parent / "scenes"
EXAMPLES = sorted(SCENES.glob("example?.txt"))
# A light exactly on a sphere and ties of two surfaces are decided by rounding, in both programs.
KNIFE_EDGES = ("corner_tie", "light_on_sphere")
DIAGNOSTIC = [path for path in sorted((SCENES / "diagnostic").glob("*.txt")) if path.stem not in KNIFE_EDGES]
FLOOR = Plane((90, 120, 60), (0, -100, 0), (0, 3, 0), 0.6, 0.4)

pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")


def names(path: Path) -> str:
    return path.stem


def random_scene(spheres: int, seed: int) -> Scene:
    pick = random.Random(seed)
    balls = [
        Sphere(
            (pick.randrange(256), pick.randrange(256), pick.randrange(256)),
            (pick.uniform(-150, 150), pick.uniform(-90, 150), pick.uniform(120, 600)),
            pick.uniform(3, 20),
            pick.random(),
            pick.random() * 0.6,
        )
        for _ in range(spheres)
    ]
    return Scene((255, 255, 255), 0.1, tuple(balls), (FLOOR,))


def worst(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max())


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("path", EXAMPLES + DIAGNOSTIC, ids=names)
def test_agrees_with_the_transcription(path: Path, convention: str) -> None:
    expected = transcription.picture(path.read_text(), 250, 250, 3, convention)
    drawn = render(Scene.load(path), CONVENTIONS[convention], width=250, height=250, dtype=float)
    assert worst(drawn, expected) <= 1e-6


@pytest.mark.parametrize("path", EXAMPLES, ids=names)
def test_published_pictures_are_equal_in_every_byte(path: Path) -> None:
    expected = transcription.truncated(transcription.picture(path.read_text(), 400, 400, 3, "published"))
    assert np.array_equal(quantise(render(Scene.load(path), PUBLISHED, width=400, height=400, dtype=float)), expected)


@pytest.mark.parametrize("path", EXAMPLES, ids=names)
def test_published_differs_from_the_document_in_mirrors_only(path: Path) -> None:
    scene = Scene.load(path)
    document, published = (render(scene, model, width=250, height=250) for model in (DOCUMENT, PUBLISHED))
    assert np.all(published <= document + 0.01)
    assert np.count_nonzero(np.abs(published - document).max(-1) > 8) > 250
    local = [render(scene, model, width=250, height=250, depth=0) for model in (DOCUMENT, PUBLISHED)]
    assert worst(*local) < 1e-3


@pytest.mark.parametrize("path", EXAMPLES, ids=names)
def test_single_precision_is_not_speckled(path: Path) -> None:
    scene = Scene.load(path)
    double, single = (np.clip(render(scene, EXACT, precision=name), 0, 255) for name in ("double", "single"))
    assert np.count_nonzero(np.abs(double - single).max(-1) > 0.5) <= 10


@pytest.mark.parametrize("path", EXAMPLES, ids=names)
def test_document_and_exact_agree_on_the_examples(path: Path) -> None:
    scene = Scene.load(path)
    assert worst(render(scene, DOCUMENT, dtype=float), render(scene, EXACT, dtype=float)) < 1e-8


@pytest.mark.parametrize("path", EXAMPLES + DIAGNOSTIC, ids=names)
def test_the_loop_draws_what_straight_code_draws(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene.load(path)
    monkeypatch.setattr(tables, "UNROLLED", 1000)
    straight = render(scene, width=120, height=120, dtype=float)
    monkeypatch.setattr(tables, "UNROLLED", 0)
    assert worst(render(scene, width=120, height=120, dtype=float), straight) < 1e-9


def test_many_spheres_agree_with_the_transcription() -> None:
    scene = random_scene(150, seed=3)
    expected = transcription.picture(dump(scene), 60, 60, 3, "document")
    assert worst(render(scene, width=60, height=60, dtype=float), expected) <= 1e-6


def kernels(*scenes: Scene, precision: str = "double") -> set[str]:
    """The kernels that drew these scenes, by the hash of their code."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        for scene in scenes:
            render(scene, width=32, height=32, precision=precision)
        return {entry["hash"] for entry in dr.kernel_history() if entry["type"] == dr.KernelType.JIT}


def test_other_numbers_need_no_other_kernel() -> None:
    first, second = (Scene.load(SCENES / f"example{number}.txt") for number in (1, 2))
    assert kernels(first) == kernels(second)
    assert kernels(first, precision="auto") == kernels(second, precision="auto")
    assert kernels(random_scene(4, seed=1)) == kernels(*(random_scene(4, seed=seed) for seed in range(2, 6)))


def test_large_scenes_share_one_kernel_whatever_their_counts() -> None:
    planes = replace(random_scene(40, seed=3), planes=(replace(FLOOR, point=(0, -120, 0)),))
    alone = kernels(random_scene(tables.UNROLLED, seed=1))
    assert kernels(random_scene(tables.UNROLLED, seed=1), random_scene(60, seed=2), planes) == alone


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("text", ["0\n0\n", "0\n1\n9 9 9\n0 -9 0\n0 1 0\n1\n1\n", "1\n9 9 9\n0 0 300\n9\n1\n1\n0\n"])
def test_scenes_without_some_objects(text: str, precision: str) -> None:
    scene = parse("255 255 255\n0.1\n" + text)
    drawn = render(scene, width=20, height=30, precision=precision)
    expected = transcription.picture(dump(scene), 20, 30, 3, "document")
    assert drawn.shape == (30, 20, 3)
    assert worst(drawn, expected) < 1e-3


@pytest.mark.parametrize("size", [(1, 1), (7, 3), (3, 200), (640, 480)])
def test_any_resolution(size: tuple[int, int]) -> None:
    text = (SCENES / "example3.txt").read_text()
    drawn = render(parse(text), width=size[0], height=size[1], dtype=float)
    assert worst(drawn, transcription.picture(text, *size)) <= 1e-6


@pytest.mark.parametrize("depth", [0, 1, 2, 12])
def test_any_depth(depth: int) -> None:
    text = (SCENES / "diagnostic" / "facing_mirrors.txt").read_text()
    drawn = render(parse(text), width=60, height=60, depth=depth, dtype=float)
    assert worst(drawn, transcription.picture(text, 60, 60, depth)) <= 1e-6


def test_endless_mirrors_end() -> None:
    scene = Scene.load(SCENES / "diagnostic" / "facing_mirrors.txt")
    assert np.isfinite(render(scene, width=8, height=8, depth=1000)).all()


def test_bands_make_no_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene.load(SCENES / "example1.txt")
    whole = render(scene, width=101, height=77)
    monkeypatch.setattr(tracer, "BAND", 1000)
    assert np.array_equal(render(scene, width=101, height=77), whole)


def test_render_returns_unclamped_float32() -> None:
    scene = Scene((255, 255, 255), 3.0, (Sphere((250, 200, 0), (0, 0, 300), 90, 1, 0),))
    drawn = reference.render(scene, width=10, height=10)
    assert drawn.dtype == np.float32
    assert drawn.max() > 500


@pytest.mark.parametrize("options", [{"width": 0}, {"height": 1 << 20}, {"depth": -1}, {"precision": "half"}])
def test_requests_out_of_range(options: dict[str, int]) -> None:
    with pytest.raises(InputError, match="expected"):
        render(Scene((0, 0, 0), 0), **options)  # type: ignore[arg-type]


def test_a_mistake_is_the_model_with_a_step_replaced() -> None:
    scene = Scene.load(SCENES / "example1.txt")
    unlit = replace(DOCUMENT, cosine=lambda normal, to_light: dr.zeros(type(to_light.x), dr.width(to_light)))
    assert (
        worst(
            render(scene, unlit, width=50, height=50, depth=0),
            render(
                replace(
                    scene,
                    spheres=tuple(replace(s, diffuse=0.0) for s in scene.spheres),
                    planes=tuple(replace(p, diffuse=0.0) for p in scene.planes),
                ),
                width=50,
                height=50,
                depth=0,
            ),
        )
        < 1e-3
    )


def test_the_documents_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[bool] = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("matplotlib.pyplot.show", lambda: shown.append(True))
    monkeypatch.setenv("MPLBACKEND", "agg")
    scene = Scene.load(SCENES / "example1.txt")
    scene.render()
    with pytest.raises(DeviceError, match="no display"):
        scene.render(show=True)
    assert not shown
    monkeypatch.setattr("matplotlib.pyplot.get_backend", lambda: "tkagg")
    scene.render(show=True)
    assert shown
    picture = read_image(tmp_path / "scene.jpg")
    assert picture.shape == (1000, 1000, 3)
    assert np.abs(picture - quantise(render(scene, dtype=float))).mean() < 2


def test_an_llvm_that_aborts_the_process_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(device.LLVM_VARIABLE, "/usr/lib/libLLVM-of-the-system.so")
    monkeypatch.setattr(device, "_TRIAL", "import os; os.abort()")
    with pytest.raises(DeviceError, match="does not work with Dr"):
        device.array_types(device="cpu")


def test_the_llvm_of_the_installation_is_used_unless_the_user_chose(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(device.LLVM_VARIABLE)
    monkeypatch.delitem(sys.modules, "drjit")
    device.provide_llvm()
    assert os.environ[device.LLVM_VARIABLE] == str(device.find_llvm())
    monkeypatch.setenv(device.LLVM_VARIABLE, "/chosen.so")
    device.provide_llvm()
    assert os.environ[device.LLVM_VARIABLE] == "/chosen.so"


def test_drjit_imported_first_does_not_abort_the_process() -> None:
    """A system's LLVM may work or not; the tracer draws, or says what to do."""
    program = (
        "import drjit, reference\n"
        "try: print(reference.render(reference.Scene((0, 0, 0), 0), width=4, height=4).sum())\n"
        "except reference.CrossrayError as error: print(error)\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != device.LLVM_VARIABLE}
    result = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "0.0" or "LLVM" in result.stdout


@pytest.mark.parametrize("normal", [(1, 0, -1), (1, -1, 0), (2, -1, -1), (3, -4, 1)])
def test_a_plane_through_the_light_shades_nothing(normal: tuple[int, int, int]) -> None:
    """At the light t is 1, which does not block; rounding must not decide."""
    ball = Sphere((200, 100, 50), (20, -30, 300), 60, 1, 0.2)
    through = Plane((0, 0, 0), (500, 500, 500), normal, 0, 0)
    alone = render(Scene((0, 0, 0), 0, (ball,), (FLOOR,)), EXACT, width=100, height=100, depth=0, dtype=float)
    both = render(Scene((0, 0, 0), 0, (ball,), (FLOOR, through)), EXACT, width=100, height=100, depth=0, dtype=float)
    seen = (both > 0).any(axis=-1)
    assert np.count_nonzero(seen) > 500
    assert np.array_equal(both[seen], alone[seen])


@pytest.mark.parametrize("ball", [((480, 470, 440), 70), ((400, 300, 300), 300)])
@pytest.mark.parametrize("model", [DOCUMENT, EXACT], ids=lambda model: model.name)
def test_a_sphere_through_the_light_shades_by_its_other_root(ball: tuple[Triple, float], model: Model) -> None:
    through = Sphere((200, 100, 50), *ball, 1, 0)
    scene = Scene((0, 0, 0), 0, (through,), (Plane((90, 90, 90), (0, 0, 900), (0, 0, -1), 1, 0), FLOOR))
    drawn = render(scene, model, width=100, height=100, depth=0, dtype=float)
    assert worst(drawn, transcription.picture(dump(scene), 100, 100, 0, "exact")) < 1e-6
    for column, row in [(5, 5), (90, 3), (50, 60)]:
        told = explain(scene, model, column=column, row=row, width=100, height=100, depth=0)
        assert told.colour == pytest.approx(drawn[row, column])


def test_a_camera_ray_along_a_plane_misses_it() -> None:
    scene = Scene((255, 255, 255), 1, (), (Plane((255, 0, 0), (0, -100, 0), (1, 1, 0), 0, 0),))
    drawn = render(scene, EXACT, width=32, height=32)
    assert not drawn[range(32), range(32)].any()


def test_coordinates_too_large_to_square() -> None:
    with pytest.raises(InputError, match=r"coordinates up to 1e\+100 in double precision, found 1e\+200"):
        render(Scene((0, 0, 0), 0, (Sphere((1, 1, 1), (0, 0, 1e200), 1, 1, 0),)))


def without_tree(scene: Scene, monkeypatch: pytest.MonkeyPatch, *, size: int, **options: Any) -> np.ndarray:
    """The picture by the loop over all surfaces."""
    with monkeypatch.context() as patch:
        patch.setattr(world, "is_convention", lambda model: False)
        return render(scene, width=size, height=size, dtype=float, **options)


@pytest.mark.parametrize("model", CONVENTIONS.values(), ids=CONVENTIONS)
@pytest.mark.parametrize("seed", range(3))
def test_the_tree_draws_what_the_loop_draws(model: Model, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the last bit: the eye among the spheres, spheres around the light, some behind the eye, some coincident."""
    scene = random_scene(90, seed)
    pick = random.Random(seed)
    around = [
        replace(ball, centre=(pick.gauss(0, 60), pick.gauss(0, 60), pick.gauss(40, 60))) for ball in scene.spheres
    ]
    lights = (Sphere((9, 9, 200), (500, 500, 500), 40, 1, 0.5), Sphere((90, 9, 20), (480, 520, 500), 20, 1, 0.5))
    scene = replace(scene, spheres=(*scene.spheres, *around[:20], *around[:3], *lights))
    drawn = render(scene, model, width=90, height=90, depth=4, dtype=float)
    assert np.array_equal(drawn, without_tree(scene, monkeypatch, model=model, size=90, depth=4))
    assert len(np.unique(drawn)) > 1000


def test_the_tree_keeps_to_the_scenes_order_in_a_tie() -> None:
    """Two spheres that mirror each other are equally far all along the plane between them."""
    left = Sphere((250, 0, 0), (-20, 0, 300), 40, 1, 0)
    right = replace(left, colour=(0, 250, 0), centre=(20, 0, 300))
    small = tuple(Sphere((0, 0, 9), (10.0 * place, 90, 400), 3, 1, 0) for place in range(-20, 20))
    for spheres in ((left, right), (right, left)):
        for before in (0, 20, 40):
            scene = Scene((255, 255, 255), 1, (*small[:before], *spheres, *small[before:]))
            between = render(scene, width=101, height=101, dtype=float)[40:60, 50]
            assert np.all(between.argmax(axis=1) == np.argmax(spheres[0].colour))


def test_light_on_one_of_many_spheres(monkeypatch: pytest.MonkeyPatch) -> None:
    ball = Sphere((200, 100, 50), (500, 500, 440), 60, 1, 0.3)
    scene = replace(random_scene(60, seed=4), spheres=(*random_scene(60, seed=4).spheres, ball))
    assert holds_light(ball)
    assert np.array_equal(render(scene, width=80, height=80, dtype=float), without_tree(scene, monkeypatch, size=80))


def test_a_plane_may_be_farther_than_numbers_go() -> None:
    plane = Plane((0, 0, 0), (1.7976931348623157e308, 0, 1.0793728971405305e292), (1, 0, 1), 0, 0)
    assert plane.distance_from((0, 0, 0)) == np.inf
    with pytest.raises(InputError, match="expected coordinates up to 1e\\+100 in double precision"):
        render(Scene((0, 0, 0), 0, (), (plane,)), width=3, height=3)
