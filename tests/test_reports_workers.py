"""Worker processes: whatever a picture does to one, the others are graded and no process is left."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers import EXAMPLE

from reference import Scene
from reports import workers
from reports.collection import Entry
from reports.gradebook import Task
from reports.workers import Failed, run_jobs


class Poison:
    """A task that does something to the process that unpacks it."""

    def __init__(self, action: Callable[..., Any], *arguments: object) -> None:
        self.action, self.arguments = action, arguments

    def __reduce__(self) -> Any:
        return self.action, self.arguments


class Late:
    """A pipe whose line is read, and then it takes until the process is killed."""

    def __init__(self, pipe: Any) -> None:
        self.pipe, self.close = pipe, pipe.close

    def readline(self) -> bytes:
        line: bytes = self.pipe.readline()
        assert line.endswith(b"\n")
        self.pipe.read()
        return line


def missing(folder: Path) -> Task:
    """A harmless task, quickly done."""
    entry = Entry("anna", "example1", folder / "missing.png")
    return Task(entry, Scene.load(EXAMPLE), 3, folder, "missing", 100, True, {})


def test_a_crash_costs_its_own_job_only(tmp_path: Path) -> None:
    jobs = [missing(tmp_path), Poison(os.abort), missing(tmp_path), Poison(sys.exit, 7), missing(tmp_path)]
    answers = dict(run_jobs(jobs, ["a"] * 5, workers=1, threads=1, timeout=60))
    assert sorted(answers) == [0, 1, 2, 3, 4]
    failed = {place: answer.reason for place, answer in answers.items() if isinstance(answer, Failed)}
    assert failed.keys() == {1, 3}
    assert failed[1].startswith("the process that graded it was ended by SIGABRT")
    assert failed[3].startswith("the process that graded it ended with exit code 7")
    done = answers[4]
    assert not isinstance(done, Failed)
    assert done["record"]["verdict"] == "unreadable"


def test_a_job_that_hangs_is_ended(tmp_path: Path) -> None:
    jobs = [Poison(time.sleep, 60), missing(tmp_path)]
    answers = dict(run_jobs(jobs, "ab", workers=2, threads=1, timeout=8))
    assert answers[0] == Failed("it took more than 8 s")
    assert not isinstance(answers[1], Failed)


def test_an_answer_that_comes_as_the_time_ends_is_late(tmp_path: Path) -> None:
    worker = workers._Worker(1)
    try:
        worker.answers = Late(worker.answers)  # type: ignore[assignment]
        assert worker.do(missing(tmp_path), 10) == Failed("it took more than 10 s")
    finally:
        worker.end()


def test_an_unforeseen_error_is_told_and_the_worker_goes_on(tmp_path: Path) -> None:
    task = missing(tmp_path)
    broken = Task(task.entry, None, *list(vars(task).values())[2:])  # type: ignore[arg-type]
    (tmp_path / "missing.png").write_bytes(b"P6 1 1 255\n\0\0\0")
    answers = dict(run_jobs([broken], "a", workers=1, threads=1, timeout=60))
    assert not isinstance(answers[0], Failed)
    record = answers[0]["record"]
    assert (record["status"], record["verdict"]) == ("failed", None)
    assert record["reason"].startswith("grading it failed: ")


def test_a_swollen_worker_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started = []
    start = workers._Worker.__init__

    def counted(self: Any, threads: int) -> None:
        started.append(self)
        start(self, threads)

    monkeypatch.setattr(workers._Worker, "__init__", counted)
    for largest, expected in ((1 << 40, 1), (1, 3)):
        monkeypatch.setattr(workers, "LARGEST", largest)
        started.clear()
        assert len(dict(run_jobs([missing(tmp_path)] * 3, "aaa", workers=1, threads=1, timeout=60))) == 3
        assert len(started) == expected


def test_closing_ends_every_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    processes, before = [], set(threading.enumerate())
    start = workers._Worker.__init__

    def kept(self: Any, threads: int) -> None:
        start(self, threads)
        processes.append(self.process)

    monkeypatch.setattr(workers._Worker, "__init__", kept)
    jobs = [missing(tmp_path), Poison(time.sleep, 60), Poison(time.sleep, 60)]
    answers = run_jobs(jobs, "abc", workers=2, threads=1, timeout=60)
    next(answers)
    answers.close()
    assert {process.poll() for process in processes} == {-signal.SIGKILL}
    assert set(threading.enumerate()) <= before


def test_topics_stay_with_their_worker() -> None:
    queue = workers._Queue(["a", "b", "a", "c", "b", "a"])
    first, second = queue.take(None), queue.take(None)
    assert (first, second) == (("a", 0), ("b", 1))
    assert [queue.take("a"), queue.take("b"), queue.take("a")] == [("a", 2), ("b", 4), ("a", 5)]
    assert [queue.take("a"), queue.take("b")] == [("c", 3), None]
