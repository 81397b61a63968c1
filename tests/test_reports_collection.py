"""Whose picture is which scene's."""

from pathlib import Path

import pytest

from reference.errors import InputError
from reports.collection import Collection, collect

SCENES = ("example1", "example2")


def files(folder: Path, *names: str) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"")
    return folder


def told(collection: Collection, folder: Path) -> list[tuple[str, str, str | None]]:
    return [(e.student, e.scene, str(e.path.relative_to(folder)) if e.path else None) for e in collection.entries]


def test_a_folder_for_each_student(tmp_path: Path) -> None:
    folder = files(tmp_path, "anna/example1.jpg", "anna/out/EXAMPLE2.PNG", "ben/example2.png", "carl/notes.txt")
    assert told(collect(SCENES, [folder]), folder) == [
        ("anna", "example1", "anna/example1.jpg"),
        ("anna", "example2", "anna/out/EXAMPLE2.PNG"),
        ("ben", "example1", None),
        ("ben", "example2", "ben/example2.png"),
        ("carl", "example1", None),
        ("carl", "example2", None),
    ]


def test_students_in_file_names(tmp_path: Path) -> None:
    folder = files(tmp_path, "anna_example1.jpg", "example2-anna.png", "ben maier example2.png")
    assert told(collect(SCENES, [folder]), folder) == [
        ("anna", "example1", "anna_example1.jpg"),
        ("anna", "example2", "example2-anna.png"),
        ("ben maier", "example1", None),
        ("ben maier", "example2", "ben maier example2.png"),
    ]


def test_folders_named_after_scenes(tmp_path: Path) -> None:
    folder = files(tmp_path, "example1/anna.jpg", "example2/anna.jpg", "ben/example1/scene.jpg")
    assert told(collect(SCENES, [folder]), folder) == [
        ("anna", "example1", "example1/anna.jpg"),
        ("anna", "example2", "example2/anna.jpg"),
        ("ben", "example1", "ben/example1/scene.jpg"),
        ("ben", "example2", None),
    ]


def test_a_folder_with_pictures_named_like_scenes_is_one_students(tmp_path: Path) -> None:
    """As Gradescope hands them out, with whatever else was handed in."""
    folder = files(tmp_path / "submission", "example1.jpg", "src/tracer.py", "docs/logo.png")
    collection = collect(SCENES, [folder])
    assert told(collection, folder) == [
        ("submission", "example1", "example1.jpg"),
        ("submission", "example2", None),
    ]
    assert [(path.name, reason) for path, reason in collection.ignored] == [
        ("logo.png", "its name tells none of example1, example2")
    ]


def test_an_empty_folder_is_a_student_with_nothing(tmp_path: Path) -> None:
    folder = files(tmp_path / "submission", "readme.txt")
    assert told(collect(SCENES, [folder]), folder) == [
        ("submission", "example1", None),
        ("submission", "example2", None),
    ]


def test_with_one_scene_any_name_will_do(tmp_path: Path) -> None:
    folder = files(tmp_path, "anna/scene.jpg", "ben/picture.png", "carl.png")
    assert told(collect(["example1"], [folder]), folder) == [
        ("carl", "example1", "carl.png"),
        ("anna", "example1", "anna/scene.jpg"),
        ("ben", "example1", "ben/picture.png"),
    ]


def test_a_pattern(tmp_path: Path) -> None:
    folder = files(tmp_path, "w7/anna/example1/scene.jpg", "w7/ben/example2/scene.jpg", "w7/ben/example2/other.jpg")
    collection = collect(SCENES, [folder], "*/{student}/{scene}/scene.jpg")
    assert [entry for entry in told(collection, folder) if entry[2]] == [
        ("anna", "example1", "w7/anna/example1/scene.jpg"),
        ("ben", "example2", "w7/ben/example2/scene.jpg"),
    ]
    assert [path.name for path, _ in collection.ignored] == ["other.jpg"]


@pytest.mark.parametrize("pattern", ["{student}/{student}.jpg", "{who}.jpg"])
def test_what_is_no_pattern(pattern: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="pattern"):
        collect(SCENES, [files(tmp_path, "a.jpg")], pattern)


def test_the_longest_scene_name_wins(tmp_path: Path) -> None:
    folder = files(tmp_path, "anna_example1_big.png", "anna_example1.png")
    assert told(collect(["example1", "example1_big"], [folder]), folder) == [
        ("anna", "example1", "anna_example1.png"),
        ("anna", "example1_big", "anna_example1_big.png"),
    ]


def test_links_and_doubles_are_left_out(tmp_path: Path) -> None:
    """A link could show somebody else's picture."""
    folder = files(tmp_path / "class", "anna/example1.jpg", "anna/example1.png", "ben/example2.png")
    (folder / "ben" / "example1.jpg").symlink_to(folder / "anna" / "example1.jpg")
    (folder / "loop").symlink_to(folder)
    collection = collect(SCENES, [folder])
    assert [entry for entry in told(collection, folder) if entry[2]] == [
        ("anna", "example1", "anna/example1.jpg"),
        ("ben", "example2", "ben/example2.png"),
    ]
    assert sorted((path.name, reason) for path, reason in collection.ignored) == [
        ("example1.jpg", "it is a link"),
        ("example1.png", "example1.jpg is taken for example1"),
    ]


def test_named_files(tmp_path: Path) -> None:
    folder = files(tmp_path, "anna.png", "b/anna.png", "handed/example1.png", "handed/example2.png")
    pictures = [folder / "anna.png", folder / "b" / "anna.png", folder / "missing.png", folder / "handed/example1.png"]
    assert told(collect(["example1"], pictures), folder) == [
        ("anna", "example1", "anna.png"),
        ("anna (2)", "example1", "b/anna.png"),
        ("missing", "example1", "missing.png"),
        ("handed", "example1", "handed/example1.png"),
    ]
    pictures = [folder / "handed" / "example1.png", folder / "handed" / "example2.png"]
    assert told(collect(SCENES, pictures), folder) == [
        ("handed", "example1", "handed/example1.png"),
        ("handed", "example2", "handed/example2.png"),
    ]
    with pytest.raises(InputError, match=r"anna\.png:1:1: expected a name that tells the scene"):
        collect(SCENES, [folder / "anna.png"])
