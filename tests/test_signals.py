"""Being stopped leaves no process and no file behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from helpers import EXAMPLE

RENDERER = """\
#!/bin/sh
[ $1 = --version ] && echo POV-Ray 9 && exit
echo $$ > {started}.part
mv {started}.part {started}
sleep 60
"""


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
