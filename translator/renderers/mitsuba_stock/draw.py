"""Draw scenes with Mitsuba's own command, that of this Python, and tell how long tracing took.

    python draw.py ambient.xml light.xml scene.xml

does what `mitsuba -m scalar_rgb ambient.xml light.xml scene.xml` does: one scene after the other.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
from importlib.util import find_spec
from pathlib import Path

UNITS = {"ms": 1e-3, "s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
TIME = re.compile(r"Rendering finished\. \(took ([0-9.]+)([a-z]+)\)")
CHATTER = "Invalid sample value"  # of every pixel that is negative


def find_program() -> Path:
    """Mitsuba's command comes in its Python package."""
    package = find_spec("mitsuba")
    if package is None or package.origin is None:
        raise SystemExit("Mitsuba is not installed: pip install mitsuba")
    return Path(package.origin).with_name("mitsuba")


def main() -> None:
    """Run the command with all its words; end as it does."""
    parser = argparse.ArgumentParser(description="Draw scenes with Mitsuba's own command.")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    options = parser.parse_args()
    command = [find_program(), "-m", "scalar_rgb", "-t", str(options.threads), *options.scenes]
    seconds = 0.0
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if CHATTER not in line:
                print(line, end="", flush=True)
            if time := TIME.search(line):
                seconds += float(time[1]) * UNITS[time[2]]
    if process.returncode < 0:
        os.kill(os.getpid(), -process.returncode)
    if process.returncode:
        raise SystemExit(process.returncode)
    print(f"traced in {seconds:.3f} s, in all scenes")


if __name__ == "__main__":
    main()
