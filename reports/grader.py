"""The worker process: reads pictures to grade from standard input, answers each with a line of JSON."""

from __future__ import annotations

import json
import os
import pickle
import resource
import sys
from typing import Any

LARGEST = 24 << 30  # bytes of addresses, most of which Dr.Jit and LLVM only reserve


def serve(threads: int) -> None:
    """Grade one task after another on so many threads, until standard input ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no answer
    tasks = os.fdopen(os.dup(0), "rb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (LARGEST, LARGEST))
    from reference.device import load_drjit

    load_drjit().set_thread_count(threads)
    while length := tasks.read(8):
        task = pickle.loads(tasks.read(int.from_bytes(length, "little")))
        answer = {**_answer(task), "memory": _memory()}
        answers.write(json.dumps(answer, allow_nan=False).encode("ascii") + b"\n")
        answers.flush()


def _answer(task: Any) -> dict[str, Any]:
    from reports.gradebook import empty_record
    from reports.grading import grade_picture

    try:
        return {"record": grade_picture(task)}
    except MemoryError:
        return {"record": empty_record(task.entry, "failed", "there is not enough memory for this picture")}
    except Exception as error:
        import traceback

        traceback.print_exc()
        reason = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        return {"record": empty_record(task.entry, "failed", f"grading it failed: {reason}")}


def _memory() -> int:
    """Bytes in memory now."""
    try:
        with open("/proc/self/statm", "rb") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
