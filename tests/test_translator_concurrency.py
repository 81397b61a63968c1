"""Several renderers at a time: how many, on which cores, in what order, and that all of them can be stopped."""

import os
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest
from fakes import ANSWERS, are_gone, hang, is_running, wait_for

import translator.concurrency
import translator.run
from reference import Scene
from translator.concurrency import AHEAD, Job, run_jobs, share_cores
from translator.contract import Export, Settings
from translator.run import Outcome, installed_version

EMPTY = Scene((255, 255, 255), 0.1)
SETTINGS = Settings(8, 6)
CORES = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]
QUICKLY = 5.0  # seconds


@pytest.fixture(autouse=True)
def fresh_versions() -> Iterator[None]:
    installed_version.cache_clear()
    yield
    installed_version.cache_clear()


@pytest.fixture
def on_cores(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Pretend to have so many cores."""

    def pretend(count: int) -> None:
        monkeypatch.setattr(translator.concurrency, "usable_cores", lambda: [CORES[0]] * count)

    return pretend


@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[Job]]:
    """A job for each shell script, its renderer called `0`, `1`, ..."""

    def make(*scripts: str, version: str = ANSWERS, timeout: float = 60) -> list[Job]:
        def adapter(name: str) -> SimpleNamespace:
            export = Export({"draw.sh": scripts[int(name)] + "\n"}, ("sh", "draw.sh"), "scene.png")
            return SimpleNamespace(
                TITLE="Fake",
                INSTALL="get fake",
                VERSION=(("sh", "-c", version), r"Fake (\S+)"),
                TIMING="in ([0-9.]+) s",
                export=lambda scene, settings: export,
            )

        monkeypatch.setattr(translator.run, "adapter", adapter)
        return [Job(str(place), "title", EMPTY, SETTINGS, timeout) for place in range(len(scripts))]

    return make


def silent(job: Job, outcome: Outcome | None) -> None:
    """Nobody watches."""


@pytest.mark.parametrize(
    ("cores", "count", "shares"),
    [
        ([3], 5, [[3]]),
        ([0, 1], 1, [[0, 1]]),
        ([0, 1], 0, [[0, 1]]),
        ([0, 1, 2, 3, 4], 2, [[0, 2, 4], [1, 3]]),
        ([4, 6, 9], 8, [[4], [6], [9]]),
    ],
)
def test_cores_are_shared_without_remainder(cores: list[int], count: int, shares: list[list[int]]) -> None:
    assert share_cores(cores, count) == shares


@pytest.mark.parametrize("cores", [1, 3])
def test_outcomes_come_in_the_order_of_the_jobs(
    cores: int, on_cores: Callable[[int], None], jobs: Callable[..., list[Job]]
) -> None:
    on_cores(cores)
    said: list[tuple[str, str | None]] = []
    waits = ["0.4", "0.01", "0.2", "0.01", "0.1", "0.01", "0.01"]
    todo = jobs(*(f"sleep {seconds}; echo I am {place}; exit 3" for place, seconds in enumerate(waits)))
    outcomes = list(
        run_jobs(todo, lambda job, outcome: said.append((job.renderer, outcome.status if outcome else None)))
    )
    assert [outcome.renderer for outcome in outcomes] == [job.renderer for job in todo]
    assert [outcome.log for outcome in outcomes] == [f"I am {place}\n" for place in range(7)]
    assert {outcome.reason for outcome in outcomes} == {f"it failed with exit code 3: I am {p}" for p in range(7)}
    assert sorted(said, key=str) == sorted(((job.renderer, end) for job in todo for end in (None, "failed")), key=str)
    assert all(said.index((job.renderer, None)) < said.index((job.renderer, "failed")) for job in todo)


@pytest.mark.parametrize("cores", [1, 3])
def test_never_more_at_a_time_than_cores(
    cores: int, on_cores: Callable[[int], None], jobs: Callable[..., list[Job]], tmp_path: Path
) -> None:
    on_cores(cores)
    script = f"echo + >> {tmp_path}/log; sleep 0.15; echo - >> {tmp_path}/log"
    assert len(list(run_jobs(jobs(*[script] * 7), silent))) == 7
    steps = (tmp_path / "log").read_text(encoding="ascii").split()
    running = [steps[: place + 1].count("+") - steps[:place].count("-") for place in range(len(steps))]
    assert len(steps) == 14
    assert max(running) <= cores
    assert max(running) > 1 or cores == 1


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="cores cannot be chosen on this system")
def test_processes_keep_to_their_share_of_the_cores(jobs: Callable[..., list[Job]], tmp_path: Path) -> None:
    tell = "grep Cpus_allowed_list /proc/self/status; nproc"
    outcomes = list(run_jobs(jobs(*[f"{tell}; sleep 0.2; exit 1"] * len(CORES)), silent))
    shares = []
    for outcome in outcomes:
        allowed, count = outcome.log.removeprefix("Cpus_allowed_list:").split()
        shares.append(cores_of(allowed))
        assert outcome.threads == int(count) == len(shares[-1])
    assert sorted(core for share in shares for core in share) == CORES
    (alone,) = run_jobs(jobs(f"{tell}; exit 1"), silent)
    assert alone.threads == len(CORES)
    assert cores_of(alone.log.split()[1]) == CORES
    assert sorted(os.sched_getaffinity(0)) == CORES


def cores_of(text: str) -> list[int]:
    """The cores that Linux lists as in 0-2,5."""
    spans = [span.partition("-") for span in text.split(",")]
    return [core for first, _, last in spans for core in range(int(first), int(last or first) + 1)]


def test_a_slow_first_job_bounds_how_much_is_drawn_ahead(
    on_cores: Callable[[int], None], jobs: Callable[..., list[Job]], tmp_path: Path
) -> None:
    on_cores(2)
    go = tmp_path / "go"
    begun: list[str] = []

    def report(job: Job, outcome: Outcome | None) -> None:
        if outcome is None:
            begun.append(job.renderer)

    todo = jobs(f"until [ -e {go} ]; do sleep 0.01; done", *["exit 1"] * 11)
    with closing(run_jobs(todo, report)) as outcomes:
        threading.Timer(1.0, go.touch).start()
        assert next(outcomes).renderer == "0"
        assert len(begun) <= 2 * AHEAD + 1, begun
        time.sleep(0.5)  # a slow consumer
        assert len(begun) <= 2 * AHEAD + 2, begun
        assert len(list(outcomes)) == 11
    assert len(begun) == 12


def test_closing_stops_everything(
    on_cores: Callable[[int], None], jobs: Callable[..., list[Job]], tmp_path: Path
) -> None:
    on_cores(3)
    notes = [tmp_path / str(place) for place in range(2)]
    before = set(threading.enumerate())
    outcomes = run_jobs(jobs("exit 1", hang(notes[0]), hang(notes[1]), *["sleep 60"] * 9), silent)
    assert next(outcomes).status == "failed"
    processes = wait_for(*notes)
    assert len(processes) == 4
    assert all(map(is_running, processes))
    start = time.monotonic()
    outcomes.close()
    assert time.monotonic() - start < QUICKLY
    assert are_gone(processes)
    assert set(threading.enumerate()) <= before


def test_an_exception_in_the_consumer_stops_everything(
    on_cores: Callable[[int], None], jobs: Callable[..., list[Job]], tmp_path: Path
) -> None:
    on_cores(2)
    note = tmp_path / "note"

    def consume() -> list[int]:
        with closing(run_jobs(jobs("exit 1", hang(note), *["sleep 60"] * 5), silent)) as outcomes:
            for _ in outcomes:
                processes.extend(wait_for(note))
                raise ZeroDivisionError
        return []

    processes: list[int] = []
    start = time.monotonic()
    with pytest.raises(ZeroDivisionError):
        consume()
    assert time.monotonic() - start < QUICKLY
    assert len(processes) == 2
    assert are_gone(processes)


@pytest.mark.parametrize("when", ["begins", "ends"])
def test_an_exception_in_the_report_stops_everything(
    when: str, on_cores: Callable[[int], None], jobs: Callable[..., list[Job]], tmp_path: Path
) -> None:
    on_cores(2)
    note = tmp_path / "note"
    processes: list[int] = []

    def report(job: Job, outcome: Outcome | None) -> None:
        if job.renderer == "1" and (outcome is None) == (when == "begins"):
            processes.extend(wait_for(note))
            raise ZeroDivisionError

    start = time.monotonic()
    with pytest.raises(ZeroDivisionError):
        list(run_jobs(jobs(hang(note), "exit 1", *["sleep 60"] * 5), report))
    assert time.monotonic() - start < QUICKLY
    assert len(processes) == 2
    assert are_gone(processes)


def test_a_version_question_that_hangs_can_be_stopped(
    on_cores: Callable[[int], None], jobs: Callable[..., list[Job]], tmp_path: Path
) -> None:
    on_cores(1)
    note = tmp_path / "note"

    def interrupt() -> None:
        wait_for(note)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        list(run_jobs(jobs("exit 1", "exit 1", version=hang(note)), silent))
    assert time.monotonic() - start < QUICKLY
    assert are_gone(wait_for(note))


def test_time_outs_are_of_each_job(on_cores: Callable[[int], None], jobs: Callable[..., list[Job]]) -> None:
    on_cores(2)
    start = time.monotonic()
    outcomes = list(run_jobs(jobs("sleep 60", "sleep 0.6; exit 1", "exit 1", timeout=1), silent))
    assert time.monotonic() - start < QUICKLY
    reasons = [outcome.reason for outcome in outcomes]
    assert reasons == ["it ran out of time (1 s)", *["it failed with exit code 1"] * 2]


def test_no_place_for_temporary_files_is_a_failure_of_each_job(
    jobs: Callable[..., list[Job]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "gone"))
    outcomes = list(run_jobs(jobs("exit 1", "exit 1"), silent))
    assert [outcome.status for outcome in outcomes] == ["failed", "failed"]
    assert all("No such file or directory" in (outcome.reason or "") for outcome in outcomes)


def test_a_process_that_gets_away_holds_nothing_up(jobs: Callable[..., list[Job]], tmp_path: Path) -> None:
    """One in a session of its own is out of reach; it keeps the log open."""
    note = tmp_path / "note"
    script = f"setsid sh -c 'echo $$ > {note}.part; mv {note}.part {note}; sleep 60' & "
    script += f"until [ -e {note} ]; do sleep 0.01; done; echo done; exit 1"
    start = time.monotonic()
    (outcome,) = run_jobs(jobs(script), silent)
    assert time.monotonic() - start < QUICKLY
    for process in wait_for(note):
        os.killpg(process, signal.SIGKILL)
    assert outcome.log == "done\n"
