"""The import directions, the wheel, and what may not be in the tree."""

import ast
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

import reference

ROOT = Path(__file__).parent.parent
PACKAGES = ("reference", "translator", "reports")
# What each part may import of ours, narrowest part first; a longer name allows everything below it.
ALLOWED = {
    "translator.renderers": ("reference.scene", "reference.text", "translator.contract", "translator.likeness"),
    "translator": (
        "reference.errors",
        "reference.files",
        "reference.image",
        "reference.scene",
        "reference.text",
        "translator",
    ),
    "reports": ("reference", "reports"),
    "reference": ("reference",),
}


def modules() -> list[Path]:
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def imports(path: Path) -> Iterator[str]:
    """Every module of ours that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names = [node.module or ""]
        yield from (name for name in names if name.partition(".")[0] in (*PACKAGES, "crossray"))


def below(name: str, part: str) -> bool:
    return name == part or name.startswith(part + ".")


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_the_right_way(path: Path) -> None:
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    part = next(part for part in ALLOWED if below(module, part))
    own = [".".join(module.split(".")[:3])] if part == "translator.renderers" else []  # its parts, if it has several
    wrong = [name for name in imports(path) if not any(below(name, allowed) for allowed in (*ALLOWED[part], *own))]
    assert not wrong


def test_the_walk_sees_imports(tmp_path: Path) -> None:
    path = tmp_path / "module.py"
    path.write_text("import reports.page\ndef f():\n    from translator.run import draw\n    import numpy\n")
    assert list(imports(path)) == ["reports.page", "translator.run"]


def test_public_names() -> None:
    assert sorted(reference.__all__) == [
        "CONVENTIONS",
        "CrossrayError",
        "DOCUMENT",
        "EXACT",
        "Model",
        "PUBLISHED",
        "Plane",
        "Scene",
        "SceneError",
        "SceneWarning",
        "Sphere",
        "render",
    ]
    assert all(hasattr(reference, name) for name in reference.__all__)
    with pytest.raises(AttributeError, match="nothing"):
        _ = reference.nothing


def test_reading_a_scene_loads_no_tracer() -> None:
    program = "import sys, reference; reference.Scene.load(sys.argv[1]); print('drjit' in sys.modules)"
    command = [sys.executable, "-c", program, str(ROOT / "scenes" / "example1.txt")]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip() == "False"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    return next(folder.glob("*.whl"))


def test_the_wheel_holds_what_it_should(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    top = {name.partition("/")[0] for name in names}
    assert {name for name in top if not name.endswith(".dist-info")} == {"crossray.py", *PACKAGES}
    assert {"reports/assets/report.html", "reference/scenes/example1.txt"} <= set(names)
    companions = ("cycles/studio", "mitsuba/whitted", "mitsuba_stock/draw", "radiance/render", "tachyon/draw")
    assert {f"translator/renderers/{name}.py" for name in companions} <= set(names)
    assert not [name for name in names if name.endswith((".pyc", ".exr"))]


def test_the_wheel_works_elsewhere(wheel: Path, tmp_path: Path) -> None:
    """In a new environment that shares our dependencies but not our checkout."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    python = tmp_path / "venv" / "bin" / "python"
    (site,) = (tmp_path / "venv" / "lib").glob("python*/site-packages")
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", site, wheel],
        check=True,
    )
    dependencies = [path for path in sys.path if path.endswith("site-packages")]
    (site / "dependencies.pth").write_text("\n".join(dependencies))
    command = [str(python), "-m", "crossray"]
    shown = subprocess.run([*command, "--help"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "render" in shown.stdout
    found = subprocess.run(
        [python, "-c", "import crossray; print(crossray.__file__)"], cwd=tmp_path, capture_output=True
    )
    assert found.stdout.decode().strip() == str(site / "crossray.py")
    subprocess.run([*command, "check", "--size", "16x16", "--with", "native", "--out", "out"], cwd=tmp_path, check=True)
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000


def tracked() -> list[Path]:
    listing = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listing.returncode:
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listing.stdout.splitlines() if (ROOT / name).is_file()]


@pytest.mark.parametrize(("name", "least"), [("requirements.txt", 30), ("requirements-cycles.txt", 1)])
def test_requirements_are_pinned_without_addresses(name: str, least: int) -> None:
    text = (ROOT / name).read_text()
    pins = re.findall(r"^([\w.-]+)==([\w.]+)", text, re.MULTILINE)
    assert len(pins) >= least
    assert text.count("--hash=sha256:") >= len(pins)
    assert "://" not in text
    assert not re.search(r"^--", text, re.MULTILINE)


def test_no_machine_path_in_the_tree() -> None:
    needles = [f"{folder}/" for folder in (ROOT, Path.home()) if len(folder.parts) > 1]
    for path in tracked():
        content = path.read_bytes()
        assert not [needle for needle in needles if needle.encode() in content], path
