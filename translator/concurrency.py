"""Several renderers at a time, within the machine's cores."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, InvalidStateError, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass, replace
from queue import SimpleQueue
from threading import Event
from typing import Any

from reference.scene import Scene
from translator.contract import Settings
from translator.process import stop_all, usable_cores
from translator.run import Outcome, run_renderer

AHEAD = 2  # pictures for each core share that may wait in memory for a slower one before them


@dataclass(frozen=True)
class Job:
    """A scene, called `title`, to draw with a renderer in at most `timeout` seconds.

    The threads in its settings are replaced by its share of the cores.
    """

    renderer: str
    title: str
    scene: Scene
    settings: Settings
    timeout: float


def run_jobs(jobs: Sequence[Job], report: Callable[[Job, Outcome | None], None]) -> Generator[Outcome, None, None]:
    """Draw as many at a time as there are cores, each on its share of them. Yields the outcomes in the order of `jobs`.

    `report` is called from other threads as a job begins, with None, and as it ends. When the iterator is closed or
    an exception passes through it, one from `report` too, every renderer is stopped and nothing of them is left.
    """
    ending = Event()
    broken: Future[None] = Future()  # never done well
    free: SimpleQueue[list[int]] = SimpleQueue()
    shares = share_cores(usable_cores(), len(jobs))
    for share in shares:
        free.put(share)

    def work(job: Job) -> Outcome:
        share = free.get()
        try:
            if ending.is_set():
                raise CancelledError
            if hasattr(os, "sched_setaffinity"):
                os.sched_setaffinity(0, share)  # of this thread, and so of the processes that it starts
            report(job, None)
            settings = replace(job.settings, threads=len(share))
            outcome = run_renderer(job.renderer, job.scene, settings, job.timeout)
            report(job, outcome)
            return outcome
        except BaseException as error:
            with suppress(InvalidStateError):  # another one was first
                broken.set_exception(error)
            raise
        finally:
            free.put(share)

    def first() -> Outcome:
        either: list[Future[Any]] = [pending[0], broken]
        wait(either, return_when=FIRST_COMPLETED)
        if broken.done():
            broken.result()
        return pending.popleft().result()

    pending: deque[Future[Outcome]] = deque()
    pool = ThreadPoolExecutor(len(shares))
    try:
        for job in jobs:
            pending.append(pool.submit(work, job))
            if len(pending) > AHEAD * len(shares):
                yield first()
        while pending:
            yield first()
    finally:
        ending.set()
        pool.shutdown(wait=False, cancel_futures=True)
        while free.qsize() < len(shares):
            stop_all()  # again and again, as a job may be between two processes
            time.sleep(0.01)
        pool.shutdown()


def share_cores(cores: Sequence[int], jobs: int) -> list[list[int]]:
    """The cores in as many shares as there are jobs, or fewer, none of them empty."""
    count = max(1, min(len(cores), jobs))
    return [list(cores[first::count]) for first in range(count)]
