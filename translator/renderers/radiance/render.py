"""Draw a scene of the recursive ray tracing assignment with Radiance.

    python render.py scene.exr --size 1000x1000

The picture is the sum of two: what the lamp adds and what ambient light adds. Where colours have negative parts, what
these would add is subtracted. `pip install pyradiance openimageio` brings all that is needed, `rtrace` included.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray
from pyradiance import BINPATH

LIGHT, AMBIENT = ("-av", "0", "0", "0"), ("-av", "1", "1", "1", "-w")  # -w: no warning that there is no lamp
LAYERS = {  # by the name of the materials: the options, the sign in the sum
    "light": (LIGHT, 1),
    "ambient": (AMBIENT, 1),
    "light-negative": (LIGHT, -1),
    "ambient-negative": (AMBIENT, -1),
}
ENVIRONMENT = {"RAYPATH": str(BINPATH.parent / "lib")}  # where Radiance's library is; nothing of the user's


def run(program: str, *options: str, given: bytes | memoryview = b"") -> bytes:
    """What one of Radiance's programs writes. Ends with its exit code if it fails; it has said why, unless stopped."""
    command = [BINPATH / program, *options]
    finished = subprocess.run(command, input=given, capture_output=True, env=ENVIRONMENT, check=False)
    sys.stderr.write(finished.stderr.decode("utf-8", "replace"))  # in one piece, as others may say something, too
    sys.stderr.flush()
    if finished.returncode < 0:
        raise SystemExit(f"{program} was stopped by signal {-finished.returncode}")
    if finished.returncode > 0:
        raise SystemExit(finished.returncode)
    return finished.stdout


def trace(layer: str, rays: bytes | memoryview) -> NDArray[np.float32]:
    """The colours that rays see in a layer, linear, three each."""
    options, _ = LAYERS[layer]
    return np.frombuffer(run("rtrace", "-h", "-fdf", "@scene.opt", *options, f"{layer}.oct", given=rays), np.float32)


def main() -> None:
    """Draw the layers in parts, as many at a time as there are threads, and write their sum."""
    parser = argparse.ArgumentParser(description="Draw a scene with Radiance.")
    parser.add_argument("picture", type=Path)
    parser.add_argument("--size", default="1000x1000", help="width x height in pixels")
    parser.add_argument("--threads", type=int, default=2, help="how many processes at a time")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    layers = [layer for layer in LAYERS if Path(f"{layer}.rad").exists()]
    for layer in layers:
        Path(f"{layer}.oct").write_bytes(run("oconv", "-w", f"{layer}.rad", "scene.rad"))
    # Rays go through the centres of pixels and start there, on the screen.
    rays = run("vwrays", "-fd", "-vf", "scene.vf", "-x", str(width), "-y", str(height), "-pa", "0")
    parts = np.array_split(np.frombuffer(rays).reshape(-1, 6), min(options.threads, height))
    jobs = product(layers, [part.data.cast("B") for part in parts])
    begin = time.perf_counter()
    with ThreadPoolExecutor(options.threads) as pool:
        colours = np.concatenate(list(pool.map(trace, *zip(*jobs, strict=True))))
    seconds = time.perf_counter() - begin
    signs = [np.float32(LAYERS[layer][1]) for layer in layers]
    pictures = colours.reshape(len(layers), height, width, 3)
    total = sum(sign * picture for sign, picture in zip(signs, pictures, strict=True))
    image = oiio.ImageBuf(total)
    if not image.write(str(options.picture)):
        raise SystemExit(image.geterror())
    print(f"traced in {seconds:.4f} s, without start-up, octrees and files")


if __name__ == "__main__":
    main()
