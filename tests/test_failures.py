"""Renderers that fail beside one that works: each failure is told, with its log, and the run goes on."""

import json
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from fakes import are_gone, offer, wait_for
from helpers import EXAMPLE, exact, pixels_over

from reference import Scene
from reference.image import read_image, write_image

SIZE = 16
CHECK = ("check", str(EXAMPLE), "--size", f"{SIZE}x{SIZE}", "--quiet")
SMALL_DISK = 24 << 20  # bytes


def check(
    renderers: list[str], out: Path, environment: dict[str, str], *before: str, timeout: float = 60, **how: Any
) -> dict[str, dict[str, Any]]:
    """The comparisons of a check that must end with 3, by renderer."""
    words = (*CHECK, "--with", ",".join(renderers), "--out", str(out), "--timeout", str(timeout))
    command = [*before, sys.executable, "-P", "-m", "crossray", *words]
    result = subprocess.run(
        command, env=environment, cwd=out.parent, capture_output=True, text=True, timeout=100, check=False, **how
    )
    assert result.returncode == 3, result
    assert all(line.startswith("libpng error") for line in result.stderr.splitlines()), result
    (scene,) = json.loads((out / "report.json").read_text(encoding="utf-8"))["scenes"]
    assert scene["reference"]["status"] == "rendered", scene["reference"]
    comparisons = {comparison["renderer"]: comparison for comparison in scene["comparisons"]}
    assert list(comparisons) == renderers
    assert [line.split()[:2] for line in result.stdout.splitlines()] == [["example1", name] for name in renderers]
    for name in renderers:
        if comparisons[name]["status"] == "failed":
            assert f"{name}  failed: {comparisons[name]['reason']}\n" in result.stdout
            assert comparisons[name]["verdict"] is comparisons[name]["image"] is None
            assert comparisons[name]["reason"] in (out / "junit.xml").read_text(encoding="utf-8")
    return comparisons


def assert_is_right(comparison: dict[str, Any], out: Path) -> None:
    assert (comparison["status"], comparison["verdict"]) == ("rendered", "agree")
    assert comparison["pixels"]["unexplained"] == 0
    assert comparison["metrics"]["max_error"] < 0.01
    assert pixels_over(exact(Scene.load(EXAMPLE), SIZE, SIZE), read_image(out / f"{comparison['image']}.exr")) == 0


def test_every_failure_is_told_and_the_rest_is_done(tmp_path: Path) -> None:
    (tmp_path / "tmp").mkdir()
    good = tmp_path / "good.png"
    write_image(good, np.random.default_rng(1).uniform(0, 255, (SIZE, SIZE, 3)))
    write_image(tmp_path / "small.png", np.zeros((4, 9, 3)))
    (tmp_path / "cut.png").write_bytes(good.read_bytes()[:-300])
    scripts = {
        "hangs": f"echo begun; echo $$ > {tmp_path}/note.part; mv {tmp_path}/note.part {tmp_path}/note; sleep 60",
        "segfaults": "echo allocating; kill -SEGV $$; sleep 60",
        "aborts": "echo assertion failed >&2; kill -ABRT $$; sleep 60",
        "truncates": f"echo all is well; cp {tmp_path}/cut.png scene.png",
        "forgets": "echo nothing to do",
        "shrinks": f"echo a small one; cp {tmp_path}/small.png scene.png",
        "is-missing": "exec /nonexistent/program",
        "talks": "yes abcdefghijklmnopqrstuvwxyz | head -c 270000; echo the end; exit 9",
    }
    povray = tmp_path / "bin/povray"  # fails while it is asked for its version, and again
    povray.parent.mkdir()
    povray.write_text("#!/bin/sh\necho POV-Ray 9.9\nkill -BUS $$\n", encoding="utf-8")
    povray.chmod(0o755)
    path = os.pathsep.join([str(povray.parent), os.environ["PATH"]])
    environment = offer(tmp_path / "fakes", scripts) | {"TMPDIR": str(tmp_path / "tmp"), "PATH": path}
    found = check(["povray", "native", *scripts], tmp_path / "out", environment, timeout=6)
    assert_is_right(found.pop("native"), tmp_path / "out")
    crashed = found.pop("povray")
    assert (crashed["version"], crashed["status"]) == ("unknown", "failed")
    assert crashed["reason"] == "it was stopped by SIGBUS: POV-Ray 9.9"
    assert {comparison["status"] for comparison in found.values()} == {"failed"}
    assert {comparison["version"] for comparison in found.values()} == {"1.2"}
    assert {comparison["command"] for comparison in found.values()} == {"sh draw.sh"}
    reasons = {name: comparison["reason"] for name, comparison in found.items()}
    logs = {name: comparison["log"] for name, comparison in found.items()}
    assert reasons["hangs"] == "it ran out of time (6 s): begun"
    assert reasons["segfaults"] == "it was stopped by SIGSEGV: allocating"
    assert reasons["aborts"] == "it was stopped by SIGABRT: assertion failed"
    assert reasons["truncates"].startswith("it left no usable picture (a whole picture, found one that breaks off)")
    assert reasons["forgets"] == "it left no usable picture (a picture, found no such file): nothing to do"
    assert "exit code" in reasons["is-missing"]
    assert "/nonexistent/program" in logs["is-missing"]
    assert reasons["shrinks"] == "expected a picture of 16x16, found 9x4: a small one"
    assert reasons["talks"] == "it failed with exit code 9: the end"
    assert len(logs["talks"]) < 100_000
    assert (logs["hangs"], logs["segfaults"], logs["truncates"]) == ("begun\n", "allocating\n", "all is well\n")
    assert are_gone(wait_for(tmp_path / "note"))
    assert not list((tmp_path / "tmp").iterdir())
    assert "it was stopped by SIGSEGV" in (tmp_path / "out/report.html").read_text(encoding="utf-8")


def can_mount() -> bool:
    """Whether a small file system can be made, as a user on most systems and in few containers."""
    program = shutil.which("unshare")
    words = ["--user", "--map-root-user", "--mount", "mount", "-t", "tmpfs", "tmpfs", "/tmp"]
    return program is not None and subprocess.run([program, *words], capture_output=True, check=False).returncode == 0


def test_a_full_disk(tmp_path: Path) -> None:
    """A renderer that writes without end; what it says last is still known. Where no disk can be made, a limit is."""
    small = tmp_path / "small"
    small.mkdir()
    fill = (
        "cat /dev/zero > scene.png; echo the disk is full >&2; echo still > again; echo $? is how it ended >&2; exit 5"
    )
    environment = offer(tmp_path / "fakes", {"fills": fill}) | {"TMPDIR": str(small)}
    mounted = can_mount()
    before = []
    if mounted:
        mount = f'mount -t tmpfs -o size={SMALL_DISK} tmpfs "$1" && shift && exec "$@"'
        before = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", mount, "sh", str(small)]

    def begin() -> None:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})  # one after the other: they share the disk
        if not mounted:
            resource.setrlimit(resource.RLIMIT_FSIZE, (SMALL_DISK, SMALL_DISK))

    found = check(["fills", "native"], tmp_path / "out", environment, *before, preexec_fn=begin)
    assert_is_right(found["native"], tmp_path / "out")
    assert found["fills"]["status"] == "failed"
    assert "the disk is full\n" in found["fills"]["log"]
    if mounted:
        assert "No space left on device" in found["fills"]["log"]
        assert found["fills"]["reason"].startswith("it failed with exit code 5: ")
    assert not list(small.iterdir())


def test_a_limit_that_the_user_has_set_stays(tmp_path: Path) -> None:
    """An unprivileged process cannot raise it, and must not fail for trying."""
    environment = offer(tmp_path / "fakes", {"tells": "sleep 0.5; ulimit -H -f; ulimit -H -c; exit 1"})
    limit = 64 << 20
    drop = ["setpriv", "--bounding-set=-sys_resource", "--inh-caps=-sys_resource"] if os.geteuid() == 0 else []
    before = drop if drop and shutil.which(drop[0]) else []
    found = check(
        ["tells"],
        tmp_path / "out",
        environment,
        *before,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    assert found["tells"]["log"] in (f"{limit // 512}\n0\n", f"{limit // 1024}\n0\n")
