"""Worker processes that do one job at a time: what crashes, hangs or swells costs its own job only."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Generator, Hashable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from threading import Event, Lock, Thread, Timer
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = "import sys; sys.path.insert(0, sys.argv[1]); from reports.grader import serve; serve(int(sys.argv[2]))"
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OPENIMAGEIO_THREADS")
LARGEST = 1536 << 20  # bytes in memory after a job, with which a worker is replaced
LONGEST_ENDING = 2.0  # seconds for a process that answers no more to end by itself
KEPT_LOG = 2000  # bytes, from the end


@dataclass(frozen=True)
class Failed:
    """A job that was not done, and why, in one sentence."""

    reason: str


class _Worker:
    """A process that is given pickled jobs, each preceded by its length, and answers each with a line of JSON."""

    def __init__(self, threads: int) -> None:
        environment = os.environ | (dict.fromkeys(ONE_THREAD, "1") if threads == 1 else {})
        self.log = tempfile.TemporaryFile()  # noqa: SIM115  (lives as long as the process)
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-W", "ignore", "-c", PROGRAM, str(ROOT), str(threads)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.log,
            env=environment,
            start_new_session=True,  # the terminal's Ctrl-C is ours to pass on
        )
        assert self.process.stdin
        assert self.process.stdout
        self.tasks, self.answers = self.process.stdin, self.process.stdout

    def do(self, job: Any, timeout: float) -> dict[str, Any] | Failed:
        """The answer, or why there is none; the process is then gone."""
        expired = Event()

        def expire() -> None:
            expired.set()
            self.process.kill()

        late = Timer(timeout, expire)
        late.daemon = True
        late.start()
        line = b""
        with suppress(OSError):
            data = pickle.dumps(job)
            self.tasks.write(len(data).to_bytes(8, "little") + data)
            self.tasks.flush()
            line = self.answers.readline()
        late.cancel()
        late.join()  # from here on nothing kills the process but us
        if line.endswith(b"\n") and not expired.is_set():
            answer: dict[str, Any] = json.loads(line)
            return answer
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(LONGEST_ENDING)
        self.process.kill()
        code = self.process.wait()
        if expired.is_set():
            return Failed(f"it took more than {timeout:g} s")
        return Failed(f"the process that graded it {_ending(code)}{self._last_words()}")

    def _last_words(self) -> str:
        self.log.seek(0, os.SEEK_END)
        self.log.seek(max(0, self.log.tell() - KEPT_LOG))
        lines = self.log.read().decode("utf-8", "replace").split("\n")
        said = [line.strip() for line in lines if line.strip()]
        return f": {said[-1]}" if said else ""

    def end(self) -> None:
        """At once."""
        self.process.kill()
        self.process.wait()
        for pipe in (self.tasks, self.answers, self.log):
            with suppress(OSError):
                pipe.close()


def _ending(code: int) -> str:
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"


class _Queue:
    """Jobs by topic. Whoever asks gets one of the topic that it had last; else of the largest that nobody has."""

    def __init__(self, topics: Sequence[Hashable]) -> None:
        self.waiting: dict[Hashable, deque[int]] = {}
        for place, topic in enumerate(topics):
            self.waiting.setdefault(topic, deque()).append(place)
        self.taken: dict[Hashable, int] = dict.fromkeys(self.waiting, 0)
        self.lock = Lock()

    def take(self, last: Hashable) -> tuple[Hashable, int] | None:
        """A topic and the place of a job, or None when all are taken."""
        with self.lock:
            open_ = [topic for topic, places in self.waiting.items() if places]
            if not open_:
                return None
            topic = last
            if last not in open_:
                topic = min(open_, key=lambda topic: (self.taken[topic], -len(self.waiting[topic])))
                if last in self.taken:
                    self.taken[last] -= 1
                self.taken[topic] += 1
            return topic, self.waiting[topic].popleft()


def run_jobs(
    jobs: Mapping[int, Any] | Sequence[Any], topics: Sequence[Hashable], *, workers: int, threads: int, timeout: float
) -> Generator[tuple[int, dict[str, Any] | Failed], None, None]:
    """Do all jobs in at most `workers` processes of `threads` threads each; yields each one's place and its answer.

    Jobs of one topic go to one worker as long as there are others, so that what they share is made once.
    `timeout` is in seconds, for each job. When the iterator is closed, every process is ended.
    """
    queue, answers = _Queue(topics), SimpleQueue[tuple[int, dict[str, Any] | Failed] | BaseException]()
    running: set[_Worker] = set()
    lock, closed = Lock(), False

    def start() -> _Worker | None:
        with lock:
            if closed:
                return None
            worker = _Worker(threads)
            running.add(worker)
            return worker

    def stop(worker: _Worker) -> None:
        with lock:
            running.discard(worker)
        worker.end()

    def work() -> None:
        worker, topic = None, None
        try:
            while (taken := queue.take(topic)) is not None:
                topic, place = taken
                worker = worker or start()
                if worker is None:
                    return
                answer = worker.do(jobs[place], timeout)
                if isinstance(answer, Failed) or answer.get("memory", 0) > LARGEST:
                    stop(worker)
                    worker = None
                answers.put((place, answer))
        except BaseException as error:
            answers.put(error)
        finally:
            if worker:
                stop(worker)

    helpers = [Thread(target=work, daemon=True) for _ in range(min(workers, len(topics)))]
    try:
        for helper in helpers:
            helper.start()
        for _ in topics:
            answer = answers.get()
            if isinstance(answer, BaseException):
                raise answer
            yield answer
    finally:
        with lock:
            closed = True
            for worker in running:
                worker.process.kill()
        for helper in helpers:
            helper.join()
