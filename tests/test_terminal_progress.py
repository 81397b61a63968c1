"""Progress on a terminal: a pseudo-terminal is filled and what stands on it read."""

import fcntl
import os
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
from fakes import are_gone, hang, offer, wait_for
from helpers import EXAMPLE

from reports.terminal import progress_lines, summary_lines

COLUMNS, ROWS = 100, 30
ERASE = "\x1b[2K"
HOSTILE = "\x1b]0;mine\x07\x1b[2J\x1b[31m\r\n[bold]x[/bold]\x9b5A\x85\u202eevil"


class Screen:
    """What was written to a pseudo-terminal."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
        self.data = b""
        self.reader = threading.Thread(target=self._read)
        self.reader.start()

    def _read(self) -> None:
        while True:
            try:
                self.data += os.read(self.master, 65536)
            except OSError:  # the other end is closed
                return

    def text(self) -> str:
        os.close(self.slave)
        self.reader.join()
        os.close(self.master)
        return self.data.decode("utf-8")


@contextmanager
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[Screen]:
    """Standard error on a pseudo-terminal."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    for name in ("LINES", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    screen = Screen()
    with open(os.dup(screen.slave), "w", encoding="utf-8") as stream, monkeypatch.context() as patch:
        patch.setattr(sys, "stderr", stream)
        yield screen


def frames(text: str) -> list[list[str]]:
    """The lines that stood on the terminal, each time that it was drawn."""
    drawn = [re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", part).strip("\r\n") for part in text.split(ERASE)]
    return [[line.rstrip() for line in frame.splitlines()] for frame in drawn if frame.strip()]


def test_one_line_for_each_renderer(monkeypatch: pytest.MonkeyPatch) -> None:
    totals = {"certified": 2, "native": 2, "povray": 2, "comparing": 4}
    with terminal(monkeypatch) as screen, progress_lines(False, False, totals) as show:
        show("native", "a.txt", 0)
        show("povray", "a.txt: failed in 0.1 s", 1)
        show("povray", "a very long name of a scene, " * 20, 0)
        for _ in range(4):
            show("comparing", "a: native", 1)
    *_, last = [frame for frame in frames(screen.text()) if len(frame) > 1]
    assert [line.split()[0] for line in last] == list(totals)
    assert all(len(line) <= COLUMNS for line in last)
    counts = [re.findall(r"\d+/\d+", line) for line in last]
    assert counts == [["0/2"], ["0/2"], ["1/2"], ["4/4"]]
    assert last[1].endswith("a.txt")
    assert "a very long name" in last[2]
    assert last[3].endswith("a: native")


def test_the_lines_are_gone_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    with terminal(monkeypatch) as screen:
        with progress_lines(False, False, {"native": 1, "povray": 1}) as show:
            show("native", "a.txt", 1)
        print("the end", file=sys.stderr)
    text = screen.text()
    end = text.rpartition("native")[2]
    assert end.count(f"\x1b[1A{ERASE}") >= 2
    assert text.endswith("the end\r\n")
    assert "\x1b[?25h" in end  # the cursor is there again


@pytest.mark.parametrize("quiet", [False, True])
def test_names_cannot_command_the_terminal(quiet: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    with terminal(monkeypatch) as screen, progress_lines(quiet, True, {"native": 1, "povray": 1}) as show:
        show("native", f"{HOSTILE}.txt", 0)
        show("povray", "b.txt [/] [link=x]", 0)
    text = screen.text()
    if quiet:
        assert text == ""
        return
    assert "evil" in text
    assert not re.search(r"\x1b\]|\x1b\[2J|\x07|\x9b|\x85|\u202e", text)
    *_, last = [frame for frame in frames(text) if len(frame) > 1]
    assert [line.split()[0] for line in last] == ["native", "povray"]
    assert "[bold]x[/bold]" in last[0]
    assert last[1].endswith("b.txt [/] [link=x]")


def test_many_threads_may_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"renderer{place}" for place in range(8)]
    with (
        terminal(monkeypatch) as screen,
        progress_lines(False, False, dict.fromkeys(names, 50)) as show,
        ThreadPoolExecutor(8) as pool,
    ):
        list(pool.map(lambda name: [show(name, f"scene {step}", 1) for step in range(50)], names))
    *_, last = [frame for frame in frames(screen.text()) if len(frame) > 1]
    assert [re.findall(r"\S*\d/\d+", line) for line in last] == [["50/50"]] * 8


@pytest.mark.parametrize(("quiet", "verbose", "lines"), [(0, 0, 0), (0, 1, 2), (1, 0, 0), (1, 1, 0)])
def test_without_a_terminal_lines_come_if_asked_for(
    quiet: int, verbose: int, lines: int, capsys: pytest.CaptureFixture[str]
) -> None:
    with progress_lines(bool(quiet), bool(verbose), {"native": 2}) as show:
        show("native", f"{HOSTILE}.txt", 0)
        show("native", "b.txt", 1)
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == len(said.err.splitlines()) == lines
    assert all(letter.isprintable() for letter in said.err.replace("\n", ""))


def test_a_summary_line_is_one_line_whatever_is_in_it() -> None:
    def failed(renderer: str) -> dict[str, object]:
        return {"renderer": renderer, "status": "failed", "reason": f"bad: {HOSTILE}", "pixels": None, "verdict": None}

    scene = {"scene": f"a\nb  native  agree: {HOSTILE}", "reference": failed("certified"), "comparisons": [failed("x")]}
    lines = list(summary_lines({"scenes": [scene]}))
    assert len(lines) == 2
    assert all(line.isprintable() and "failed: bad: " in line for line in lines)


def test_a_large_picture_shows_its_rows(tmp_path: Path) -> None:
    screens = {}
    for size in ("64x64", "4096x3000"):
        screen = Screen()
        command = [sys.executable, "-m", "crossray", "render", str(EXAMPLE), "--size", size, "-o", "a.png"]
        environment = os.environ | {"TERM": "xterm", "COLUMNS": str(COLUMNS)}
        subprocess.run(command, cwd=tmp_path, env=environment, stderr=screen.slave, timeout=60, check=True)
        screens[size] = screen.text()
    assert screens["64x64"] == ""
    drawn = frames(screens["4096x3000"])
    assert any(re.search(r"^rows .* \d+/3000 ", line) for frame in drawn for line in frame)
    assert screens["4096x3000"].rindex("\x1b[?25h") > screens["4096x3000"].rindex("\x1b[?25l")


def test_being_stopped_leaves_the_terminal_as_it_was(tmp_path: Path) -> None:
    """The whole command, with its standard error on a terminal; the renderers do not belong to that terminal."""
    notes = [tmp_path / "note"]
    environment = offer(tmp_path / "fakes", {"hangs": f"tty </dev/tty; {hang(notes[0])}"})
    screen = Screen()
    with subprocess.Popen(
        [sys.executable, "-m", "crossray", "check", str(EXAMPLE), "--with", "hangs", "--size", "8x8", "--out", "out"],
        env=environment | {"TERM": "xterm", "COLUMNS": str(COLUMNS)},
        stderr=screen.slave,
        cwd=tmp_path,
    ) as process:
        processes = wait_for(*notes)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 130
    text = screen.text()
    assert are_gone(processes)
    drawn = [frame for frame in frames(text) if len(frame) > 1]
    assert [line.split()[0] for line in drawn[-1]] == ["certified", "hangs", "comparing"]
    assert any(re.fullmatch(r"hangs .* 0/1 \d:\d\d:\d\d .*example1.txt", frame[1]) for frame in drawn)
    assert text.rindex("\x1b[?25h") > text.rindex("\x1b[?25l")
    assert text.endswith("interrupted\r\n")
