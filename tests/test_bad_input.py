"""Whatever is wrong is refused: malformed scenes with their place, impossible requests with exit code 2 or 3."""

import os
import re
import signal
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import FrameType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference.errors import SceneError, SceneWarning
from reference.text import load, parse

LINES = b"255 250 245\n0.1\n1\n250 200 0\n50 -70 300\n30\n1\n0.2\n1\n10 20 30\n0 -100 0\n0 1 0\n0.5\n1".split(b"\n")
PLAIN = b"\n".join(LINES) + b"\n"
AMBIENT = "the ambient colour (3 numbers)"
RADIUS = "sphere 1: radius (1 number)"
POSITION = "sphere 1: position (3 numbers)"
MEGABYTE = 1_000_000

UNPRIVILEGED = "-dac_override,-dac_read_search"
AS_A_USER = ["setpriv", f"--bounding-set={UNPRIVILEGED}", f"--inh-caps={UNPRIVILEGED}"] if os.geteuid() == 0 else []
WITH_SMALL_FILES = [
    *(sys.executable, "-c"),
    "import os, resource as r, sys; r.setrlimit(r.RLIMIT_FSIZE, (300, 300)); os.execv(sys.argv[1], sys.argv[1:])",
]
WITHOUT_INPUT = ["sh", "-c", 'exec "$@" <&-', "sh"]
KNOWN = b"what was here before"
LONG_NAME = "a" * 300 + ".png"
OUTPUTS = ["picture.jpg", "picture.png", "picture.exr"]


def put(number: int, text: bytes) -> bytes:
    return b"\n".join([*LINES[: number - 1], text, *LINES[number:]]) + b"\n"


def drop(number: int) -> bytes:
    return b"\n".join([*LINES[: number - 1], *LINES[number:]]) + b"\n"


MALFORMED = [
    ("empty", b"", "1:1", f"{AMBIENT}, found the end of the file"),
    ("only-bom", b"\xef\xbb\xbf", "1:1", f"{AMBIENT}, found the end of the file"),
    ("only-blank-lines", b"\n \n\t\r\n", "4:1", f"{AMBIENT}, found the end of the file"),
    ("only-blank-lines-cr", b"\r \r\t\r", "4:1", f"{AMBIENT}, found the end of the file"),
    ("no-ambient-colour", drop(1), "1:4", f"{AMBIENT}, found only 1 number"),
    ("no-ambient-coefficient", drop(2), "3:5", "nothing after the number of spheres (1 number), found '200'"),
    ("no-sphere-count", drop(3), "3:5", "nothing after the number of spheres (1 number), found '200'"),
    ("no-sphere-colour", drop(4), "5:3", f"{POSITION}, found only 1 number"),
    ("no-sphere-position", drop(5), "5:3", f"{POSITION}, found only 1 number"),
    ("no-radius", drop(6), "9:4", "nothing after the number of planes (1 number), found '20'"),
    ("no-plane-count", drop(9), "9:4", "nothing after the number of planes (1 number), found '20'"),
    ("no-normal", drop(12), "12:4", "plane 1: normal (3 numbers), found only 1 number"),
    ("no-last-line", drop(14), "13:4", "plane 1: reflection coefficient (1 number), found the end of the file"),
    ("breaks-off-in-blanks", b"1 2 3\n.5 \n\n\n", "2:4", "the number of spheres (1 number), found the end of the file"),
    ("text", b"hello\n" + PLAIN, "1:1", f"a number in {AMBIENT}, found 'hello'"),
    ("text-later", put(5, b"50 left 300"), "5:4", f"a number in {POSITION}, found 'left'"),
    ("nan", put(5, b"50 -70 nan"), "5:8", f"a finite number in {POSITION}, found 'nan'"),
    ("minus-nan", put(2, b"  -NaN"), "2:3", "a finite number in the ambient coefficient (1 number), found '-NaN'"),
    ("infinity", put(6, b"Infinity"), "6:1", f"a finite number in {RADIUS}, found 'Infinity'"),
    ("minus-inf", put(11, b"0 -inf 0"), "11:3", "a finite number in plane 1: point (3 numbers), found '-inf'"),
    ("overflow", put(6, b"1e999"), "6:1", f"a finite number in {RADIUS}, found '1e999'"),
    ("negative-count", put(3, b"-1"), "3:1", "a whole number of spheres, 0 or more, found -1"),
    ("fractional-count", put(3, b" 1.5"), "3:2", "a whole number of spheres, 0 or more, found 1.5"),
    ("negative-plane-count", put(9, b"-2"), "9:1", "a whole number of planes, 0 or more, found -2"),
    ("count-above-file", put(3, b"4"), "3:1", "spheres: at most 3, as many as the rest of the file can hold, found 4"),
    ("plane-count-above-file", put(9, b"7.0"), "9:1", "planes: at most 1, "),
    ("a-thousand-million-spheres", put(3, b"1000000000"), "3:1", "spheres: at most 3, "),
    ("10^400-spheres", put(3, b"1" + b"0" * 400), "3:1", "a finite number in the number of spheres (1 number)"),
    ("radius-0", put(6, b"0"), "6:1", "sphere 1: a radius above 0, found 0"),
    ("radius-minus-0", put(6, b" -0.0"), "6:2", "sphere 1: a radius above 0, found -0.0"),
    ("radius-negative", put(6, b"-30"), "6:1", "sphere 1: a radius above 0, found -30"),
    ("radius-underflow", put(6, b"1e-999"), "6:1", "sphere 1: a radius above 0, found 0"),
    ("zero-normal", put(12, b"  0 -0 0.0"), "12:3", "plane 1: a normal that is not zero, found 0 0 0"),
    ("lines-left-over", PLAIN + b"\n\n 1 2 3\n", "17:2", "the end of the file after the last plane, found '1'"),
    ("left-over-after-no-planes", b"1 2 3\n.5\n0\n0\n9", "5:1", "the end of the file after the last plane count"),
    ("too-many", put(1, b"1 2 3 4"), "1:7", f"nothing after {AMBIENT}, found '4'"),
    ("too-many-coefficients", put(7, b"1 0.2"), "7:3", "nothing after sphere 1: diffuse coefficient (1 number)"),
    ("too-few", put(4, b"250 200  "), "4:8", "sphere 1: colour (3 numbers), found only 2 numbers"),
    ("commas", put(1, b"255, 250, 245"), "1:1", f"a number in {AMBIENT}, found '255,'"),
    ("decimal-comma", put(2, b"0,1"), "2:1", "a number in the ambient coefficient (1 number), found '0,1'"),
    ("hexadecimal", put(6, b"0x1e"), "6:1", f"a number in {RADIUS}, found '0x1e'"),
    ("underscore", put(6, b"3_0"), "6:1", f"a number in {RADIUS}, found '3_0'"),
    ("half-an-exponent", put(6, b"3e"), "6:1", f"a number in {RADIUS}, found '3e'"),
    ("two-signs", put(6, b"+-3"), "6:1", f"a number in {RADIUS}, found '+-3'"),
    ("a-lone-point", put(6, b"."), "6:1", f"a number in {RADIUS}, found '.'"),
    ("unicode-digits", put(6, "٣٠".encode()), "6:1", f"a number in {RADIUS}, found '\\u0663\\u0660'"),
    ("unicode-minus", put(5, "0 −1 0".encode()), "5:3", f"a number in {POSITION}, found '\\u22121'"),
    ("second-bom", b"\xef\xbb\xbf" * 2 + PLAIN, "1:1", f"a number in {AMBIENT}, found '\\ufeff255'"),
    ("binary", bytes(range(256)), "3:115", "text in UTF-8, found the byte 0x80"),
    ("png", b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "1:1", "text in UTF-8, found the byte 0x89"),
    ("nul", b"\x00" * 64, "1:1", f"a number in {AMBIENT}, found '\\x00"),
    ("nul-inside", put(5, b"50 -70 3\x000"), "5:8", f"a number in {POSITION}, found '3\\x000'"),
    ("utf-16", PLAIN.decode().encode("utf-16"), "1:1", "text in UTF-8, found the byte 0xff"),
    ("utf-16-without-bom", PLAIN.decode().encode("utf-16-le"), "1:1", "a number in the ambient colour"),
    ("invalid-utf-8", put(5, b"50 \xc3( 300"), "5:4", "text in UTF-8, found the byte 0xc3"),
    ("cut-utf-8", PLAIN + "ä €".encode()[:-1], "15:3", "text in UTF-8, found the byte 0xe2"),
    ("invalid-after-characters", put(5, "ä€ ".encode() + b"\xff"), "5:4", "text in UTF-8, found the byte 0xff"),
    ("invalid-after-bom", b"\xef\xbb\xbf" + put(2, b"0\xff"), "2:2", "text in UTF-8, found the byte 0xff"),
    ("invalid-at-once-after-bom", b"\xef\xbb\xbf\xff", "1:1", "text in UTF-8, found the byte 0xff"),
    ("long-digits", b"1" * MEGABYTE, "1:1", f"a finite number in {AMBIENT}, found '1111"),
    ("long-digits-then-text", put(6, b"1" * MEGABYTE + b"x"), "6:1", f"a number in {RADIUS}, found '1"),
    ("long-fraction", put(1, b"." + b"1" * MEGABYTE), "1:1000002", f"{AMBIENT}, found only 1 number"),
    ("long-exponent", put(6, b"1e" + b"1" * MEGABYTE), "6:1", f"a finite number in {RADIUS}, found '1e"),
    ("long-blanks", put(1, b"1" + b" " * MEGABYTE + b"x"), "1:1000002", "a number in the ambient colour"),
    ("many-numbers", put(1, b"1 " * MEGABYTE), "1:7", f"nothing after {AMBIENT}, found '1'"),
    ("many-lines", PLAIN + b"1\n" * MEGABYTE, "15:1", "the end of the file after the last plane, found '1'"),
]


@pytest.fixture
def _no_hang() -> Iterator[None]:
    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise TimeoutError("reading took more than 5 s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(5)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("_no_hang")
@pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")
@pytest.mark.parametrize(("data", "place", "reason"), [pytest.param(*case[1:], id=case[0]) for case in MALFORMED])
def test_a_malformed_scene_is_refused_at_its_place(data: bytes, place: str, reason: str, tmp_path: Path) -> None:
    file = tmp_path / "a scene.txt"
    file.write_bytes(data)
    with pytest.raises(SceneError) as caught:
        load(file)
    message = str(caught.value)
    assert message.startswith(f"{file}:{place}: expected {reason}")
    assert re.fullmatch(r"[^\n]+, found [^\n]{1,200}", message)


@pytest.mark.parametrize("kept", [count for count in range(1, 14) if count not in (3, 9)])
@pytest.mark.parametrize("end", [b"", b"\n", b"\r\n\r\n"])
def test_a_scene_that_breaks_off_is_refused_at_its_end(kept: int, end: bytes) -> None:
    column = len(LINES[kept - 1]) + 1
    with pytest.raises(SceneError, match=rf"^a\.txt:{kept}:{column}: expected .+, found the end of the file$"):
        parse(b"\n".join(LINES[:kept]) + end, "a.txt")


WORDS = st.sampled_from([b"\n", b"\r", b" ", b"0", b"1", b"-2.5", b"nan", b"1e999", b"\xef\xbb\xbf", b"\xff", b"x"])


@given(st.binary() | st.lists(WORDS).map(b"".join) | st.binary(max_size=4).map(lambda data: PLAIN[:70] + data))
def test_anything_is_read_or_refused(data: bytes) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        try:
            parse(data, "a.txt")
        except SceneError as error:
            place = re.match(r"a\.txt:(\d+):(\d+): expected .+, found .+", str(error))
            assert place
            lines = re.split(rb"\r\n|\n|\r", data)
            assert 1 <= int(place[1]) <= len(lines)
            assert 1 <= int(place[2]) <= len(lines[int(place[1]) - 1]) + 1


def refuse(
    folder: Path, code: int, message: str, *words: str, under: list[str] | None = None, stdin: bytes = b""
) -> str:
    """Run `crossray render` in the folder; it must say the message, end with the code and change nothing there."""
    before = listing(folder)
    command = [*(under or []), sys.executable, "-m", "crossray", "render", "--size", "64x64", *words]
    result = subprocess.run(command, cwd=folder, input=stdin, capture_output=True, timeout=60, check=False)
    errors = result.stderr.decode()
    assert "Traceback" not in errors
    assert (result.returncode, result.stdout) == (code, b""), errors
    assert message in errors
    assert listing(folder) == before
    return errors


def listing(folder: Path) -> dict[Path, bytes | None]:
    return {
        path: path.read_bytes() if os.access(path, os.R_OK) and path.is_file() else None for path in folder.rglob("*")
    }


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "scene.txt").write_bytes(PLAIN)
    (tmp_path / "bad.txt").write_bytes(PLAIN + b"7")
    (tmp_path / "secret.txt").write_bytes(PLAIN)
    (tmp_path / "secret.txt").chmod(0)
    for name in (*OUTPUTS, "sealed.png"):
        (tmp_path / name).write_bytes(KNOWN)
    (tmp_path / "sealed.png").chmod(0o444)
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "locked").mkdir(mode=0o555)
    return tmp_path


@pytest.mark.parametrize(
    ("code", "message", "words"),
    [
        (2, "bad.txt:15:1: expected the end of the file after the last plane, found '7'\n", "bad.txt -o picture.jpg"),
        (2, "missing.txt:1:1: expected a readable scene file, found no such file", "missing.txt -o picture.png"),
        (2, "folder.png:1:1: expected a scene file, found a directory\n", "folder.png"),
        (2, "secret.txt:1:1: expected a readable scene file, found permission denied\n", "secret.txt"),
        (2, "<stdin>:15:1: expected the end of the file after the last plane, found '7'\n", "- -o picture.exr"),
        (2, "'--size': expected a size like 1000x1000, at most 65536 a side, found '10'", "scene.txt --size 10"),
        (2, "'--size': expected a size like 1000x1000, at most 65536 a side, found '0x10'", "scene.txt --size 0x10"),
        (2, "'--depth': -1 is not in the range 0<=x<=1048576", "scene.txt -o picture.png --depth -1"),
        (2, "'--convention': ", "scene.txt --convention invented"),
        (2, "picture.gif: expected a picture name ending in .jpg, ", "scene.txt -o picture.gif"),
        (2, "picture: expected a picture name ending in .jpg, ", "scene.txt -o picture"),
        (2, "picture.jpg: expected at most 65500 pixels a side", "scene.txt --size 65501x1 -o picture.jpg"),
        (2, "'SCENE'", ""),
        (3, "missing/picture.png: cannot be written: no such file", "scene.txt -o missing/picture.png"),
        (3, "locked/picture.png: cannot be written: permission denied\n", "scene.txt -o locked/picture.png"),
        (3, "folder.png: expected a file to write, found a directory\n", "scene.txt -o folder.png"),
        (3, "sealed.png: cannot be written: permission denied\n", "scene.txt -o sealed.png"),
        (3, "scene.txt/picture.png: cannot be written: not a directory\n", "scene.txt -o scene.txt/picture.png"),
        (3, f"{LONG_NAME}: cannot be written: file name too long\n", f"scene.txt -o {LONG_NAME}"),
    ],
)
def test_what_cannot_be_done_ends_with_a_message(folder: Path, code: int, message: str, words: str) -> None:
    refuse(folder, code, message, *words.split(), under=AS_A_USER, stdin=PLAIN + b"7")


def test_closed_standard_input_is_refused(folder: Path) -> None:
    refuse(folder, 2, "<stdin>:1:1: expected ", "-", "-o", "picture.png", under=WITHOUT_INPUT)


@pytest.mark.parametrize("output", OUTPUTS)
def test_a_file_that_cannot_grow_ends_with_3(folder: Path, output: str) -> None:
    errors = refuse(folder, 3, f"{output}: cannot be written: ", "scene.txt", "-o", output, under=WITH_SMALL_FILES)
    assert ".crossray-" not in errors


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("no file system can be mounted here")
    try:
        (disk / "scene.txt").write_bytes(PLAIN)
        for name in OUTPUTS:
            (disk / name).write_bytes(KNOWN)
        with suppress(OSError):
            (disk / "rest").write_bytes(bytes(1 << 17))
        assert not os.statvfs(disk).f_bavail
        yield disk
    finally:
        subprocess.run(["umount", disk], check=True)


@pytest.mark.parametrize("output", [*OUTPUTS, "new.jpg", "new.png", "new.exr"])
def test_a_full_disk_ends_with_3(full_disk: Path, output: str) -> None:
    message = f"{output}: cannot be written: no space left on device\n"
    errors = refuse(full_disk, 3, message, "scene.txt", "-o", output)
    assert ".crossray-" not in errors
