"""Being stopped leaves no process and no file behind."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from fakes import are_gone, hang, offer, wait_for
from helpers import EXAMPLE

from reference import files
from reference.image import write_image
from translator.process import usable_cores

ENDED = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN); import crossray; crossray.main()"
RENDERER = """\
#!/bin/sh
[ $1 = --version ] && echo POV-Ray 9 && exit
echo $$ > {started}.part
mv {started}.part {started}
sleep 60
"""


def interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def test_a_file_just_begun_is_cleared_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "close", interrupt)
    with pytest.raises(KeyboardInterrupt):
        files.write_text(tmp_path / "a.txt", "")
    assert not list(tmp_path.iterdir())


def test_what_clearing_away_missed_is_cleared_away_at_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", interrupt)
        with pytest.raises(KeyboardInterrupt), files.replacing(tmp_path / "a.txt"):
            raise ValueError
    assert len(list(tmp_path.iterdir())) == 1
    files._clear_all()
    assert not list(tmp_path.iterdir())
    assert not files._begun


def test_a_signal_that_the_caller_ignores_is_ignored(tmp_path: Path) -> None:
    """As under nohup."""
    started, ended = tmp_path / "started", tmp_path / "ended"
    program = tmp_path / "povray"
    script = f"#!/bin/sh\n[ $1 = --version ] && echo POV-Ray 9 && exit\ntouch {started}\n"
    program.write_text(f"{script}while ! [ -e {ended} ]; do sleep 0.05; done\nexit 7\n")
    program.chmod(0o755)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"}
    command = [sys.executable, "-c", ENDED, "check", str(EXAMPLE), "--size", "8x8", "--with", "povray"]
    with subprocess.Popen(
        [*command, "--out", str(tmp_path / "out")], env=environment, stdout=subprocess.PIPE
    ) as process:
        wait_for(started)
        process.send_signal(signal.SIGHUP)
        time.sleep(0.2)
        ended.touch()
        said, _ = process.communicate(timeout=60)
    assert process.returncode == 3
    assert b"it failed with exit code 7" in said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_being_stopped_leaves_nothing_behind(number: signal.Signals, tmp_path: Path) -> None:
    folders = {name: tmp_path / name for name in ("bin", "tmp", "out")}
    for folder in folders.values():
        folder.mkdir()
    started = tmp_path / "started"
    program = folders["bin"] / "povray"
    program.write_text(RENDERER.format(started=started))
    program.chmod(0o755)
    environment = os.environ | {"PATH": f"{folders['bin']}:{os.environ['PATH']}", "TMPDIR": str(folders["tmp"])}
    command = [sys.executable, "-m", "crossray", "check", str(EXAMPLE), "--size", "8x8", "--with", "povray"]
    with subprocess.Popen(
        [*command, "--out", str(folders["out"])], env=environment, stderr=subprocess.PIPE, text=True
    ) as process:
        while not started.exists():
            assert process.poll() is None
            time.sleep(0.05)
        process.send_signal(number)
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 128 + number
    assert errors.strip() == "interrupted"
    with pytest.raises(ProcessLookupError):
        os.kill(int(started.read_text()), 0)
    assert not list(folders["tmp"].iterdir())
    assert not list(folders["out"].rglob(".crossray-*"))


@pytest.mark.parametrize("ending", [".jpg", ".png", ".exr"])
def test_being_stopped_while_drawing_keeps_the_old_picture(ending: str, tmp_path: Path) -> None:
    picture = tmp_path / f"picture{ending}"
    picture.write_bytes(b"what was here before")
    command = [sys.executable, "-m", "crossray", "render", str(EXAMPLE), "--size", "16384x16384", "-o", str(picture)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        while len(list(tmp_path.iterdir())) == 1:
            assert process.poll() is None
            time.sleep(0.02)
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=20)
    assert (process.returncode, errors) == (130, "interrupted\n")
    assert list(tmp_path.iterdir()) == [picture]
    assert picture.read_bytes() == b"what was here before"


def test_being_stopped_twice_with_much_to_do(tmp_path: Path) -> None:
    """Several renderers hang and ignore all they can, one of them when it is asked for its version; more are queued."""
    count = min(len(usable_cores()), 2)
    notes = [tmp_path / f"note{place}" for place in range(3)]
    names = [f"hang{place}" for place in range(9)]
    scripts = {name: hang(note) for name, note in zip(names, [*notes, *[tmp_path / "more"] * 6], strict=True)}
    environment = offer(tmp_path / "fakes", scripts, {"hang1": hang(notes[1])})
    with checking(tmp_path, environment, "--with", ",".join(names)) as process:
        processes = wait_for(*notes[:count])
        for _ in range(2):
            process.send_signal(signal.SIGINT)
        start = time.monotonic()
        _, errors = process.communicate(timeout=20)
        assert time.monotonic() - start < 5
    assert (process.returncode, errors) == (130, "interrupted\n")
    assert len(processes) == 2 * count
    assert are_gone(processes)
    assert_nothing_is_left(tmp_path)


def test_being_stopped_while_comparing(tmp_path: Path) -> None:
    write_image(tmp_path / "black.png", np.zeros((8, 8, 3)))
    names = [f"black{place}" for place in range(6)]
    environment = offer(tmp_path / "fakes", dict.fromkeys(names, f"cp {tmp_path}/black.png scene.png"))
    with checking(tmp_path, environment, "--verbose", "--with", ",".join(names)) as process:
        assert process.stderr
        said = [process.stderr.readline()]
        while not said[-1].startswith("comparing: "):
            assert said[-1]
            said.append(process.stderr.readline())
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert errors.endswith("interrupted\n")
    assert "Traceback" not in errors
    (scene,) = json.loads((tmp_path / "out/run.json").read_text(encoding="utf-8"))["scenes"]
    assert [picture["status"] for picture in scene["pictures"]] == ["rendered"] * 7
    assert not (tmp_path / "out/report.json").exists()
    assert_nothing_is_left(tmp_path)


def checking(folder: Path, environment: dict[str, str], *words: str) -> subprocess.Popen[str]:
    (folder / "tmp").mkdir()
    command = [sys.executable, "-m", "crossray", "check", str(EXAMPLE), "--size", "8x8", "--out", str(folder / "out")]
    environment = environment | {"TMPDIR": str(folder / "tmp")}
    return subprocess.Popen([*command, *words], env=environment, stderr=subprocess.PIPE, text=True)


def assert_nothing_is_left(folder: Path) -> None:
    assert not list((folder / "tmp").iterdir())
    assert not list((folder / "out").rglob(".crossray-*"))
