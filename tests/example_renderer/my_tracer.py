"""My homework: a ray tracer in NumPy, which knows nothing of crossray.

    python -m my_tracer scene.txt picture.exr --size 1000x1000 --depth 3

All rays of a bounce are traced together. A ray cannot meet the plane that it leaves, and meets the sphere that it
leaves once more, at the far end of the chord: so no distance has to be "too small to count".
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

Array = NDArray[Any]

LIGHT = np.array([500.0, 500.0, 500.0])
SCREEN_SIDE, SCREEN_DISTANCE = 100.0, 100.0
PRIMARY = 1.0  # a ray of the camera ends on the screen at t = 1 and sees only what is behind it


@dataclass(frozen=True)
class Surface:
    """A sphere with a radius around `place`, or a plane with a unit normal through it. Colours are levels, 0..255."""

    colour: Array
    place: Array
    radius: float
    normal: Array
    diffuse: float
    reflection: float

    def distances(self, origin: Array, direction: Array, leaving: Array) -> tuple[Array, Array]:
        """The t of both crossings of each ray, rays x 3; not a number where there is none. `leaving` start here."""
        to_origin = origin - self.place
        if not self.radius:
            t = np.where(leaving, np.nan, -(to_origin @ self.normal) / (direction @ self.normal))
            return t, t
        a, b = dot(direction, direction), dot(to_origin, direction)
        c = dot(to_origin, to_origin) - self.radius**2
        nearest = to_origin - (b / a)[:, None] * direction  # from the centre to the ray: squares of it lose nothing
        q = -b - np.copysign(np.sqrt(a * (self.radius**2 - dot(nearest, nearest))), b)
        one, two = q / a, c / q
        return np.where(leaving, np.nan, np.fmin(one, two)), np.where(leaving, -2 * b / a, np.fmax(one, two))

    def normals(self, points: Array) -> Array:
        """The unit normal at each point; that of a plane is as the scene gives it, on both sides."""
        return (points - self.place) / self.radius if self.radius else np.broadcast_to(self.normal, points.shape)


def dot(a: Array, b: Array) -> Array:
    """Row by row."""
    return np.asarray(np.einsum("ij,ij->i", a, b))


def read(path: Path) -> tuple[Array, list[Surface]]:
    """The ambient light, 0..1 by channel, and the surfaces, spheres before planes."""
    numbers = iter(map(float, path.read_text(encoding="utf-8").split()))
    ambient = triple(numbers) / 256 * next(numbers)
    surfaces = []
    for is_plane in (False, True):
        for _ in range(int(next(numbers))):
            colour, place = triple(numbers), triple(numbers)
            normal, radius = (triple(numbers), 0.0) if is_plane else (np.ones(3), next(numbers))
            normal /= np.abs(normal).max()
            normal /= np.sqrt(normal @ normal)
            surfaces.append(Surface(colour, place, radius, normal, next(numbers), next(numbers)))
    return ambient, surfaces


def triple(numbers: Iterator[float]) -> Array:
    """The next three numbers."""
    return np.array(list(islice(numbers, 3)))


def trace(ambient: Array, surfaces: list[Surface], direction: Array, depth: int) -> Array:
    """The levels that each ray from the eye, rays x 3, brings back after up to `depth` bounces."""
    picture = np.zeros_like(direction)
    pixel, weight = np.arange(len(direction)), np.ones(len(direction))
    origin, leaving = np.zeros_like(direction), np.full(len(direction), -1)
    for bounce in range(depth + 1):
        t, met = nearest(surfaces, origin, direction, leaving, PRIMARY if bounce == 0 else 0.0)
        hit = met >= 0
        pixel, weight, direction, leaving = pixel[hit], weight[hit], direction[hit], met[hit]
        origin = origin[hit] + t[hit, None] * direction
        normal = np.empty_like(origin)
        for index, surface in enumerate(surfaces):
            here = leaving == index
            normal[here] = surface.normals(origin[here])
        colour = np.array([surface.colour for surface in surfaces]).reshape(-1, 3)[leaving]
        diffuse = np.array([surface.diffuse for surface in surfaces])[leaving]
        to_light = LIGHT - origin
        cosine = np.fmax(0, dot(normal, to_light)) / np.sqrt(dot(to_light, to_light))
        lit = np.where(blocked(surfaces, origin, to_light, leaving), 0, diffuse * cosine)
        picture[pixel] += weight[:, None] * colour * (ambient + lit[:, None])

        weight = weight * np.array([surface.reflection for surface in surfaces])[leaving]
        go_on = weight != 0
        direction = direction - 2 * dot(direction, normal)[:, None] * normal
        direction /= np.sqrt(dot(direction, direction))[:, None]
        pixel, weight, leaving = pixel[go_on], weight[go_on], leaving[go_on]
        origin, direction = origin[go_on], direction[go_on]
        if not len(pixel):
            break
    return picture


def nearest(
    surfaces: list[Surface], origin: Array, direction: Array, leaving: Array, beyond: float
) -> tuple[Array, Array]:
    """The smallest t over `beyond` of each ray and the surface there, -1 for none; of equal ones the first listed."""
    best, met = np.full(len(origin), np.inf), np.full(len(origin), -1)
    for index, surface in enumerate(surfaces):
        for t in surface.distances(origin, direction, leaving == index):
            closer = (t > beyond) & (t < best)
            best[closer], met[closer] = t[closer], index
    return best, met


def blocked(surfaces: list[Surface], origin: Array, to_light: Array, leaving: Array) -> Array:
    """Whether something stands between each origin and the light."""
    result = np.zeros(len(origin), dtype=bool)
    for index, surface in enumerate(surfaces):
        for t in surface.distances(origin, to_light, leaving == index):
            result |= (t > 0) & (t < 1)
    return result


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(prog="my_tracer", description="Draw a scene of the ray tracing assignment.")
    parser.add_argument("scene", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--size", default="1000x1000")
    parser.add_argument("--depth", type=int, default=3)
    parser.add_argument("--version", action="version", version="my_tracer 1.0")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    x = SCREEN_SIDE * ((np.arange(width) + 0.5) / width - 0.5)
    y = SCREEN_SIDE * (0.5 - (np.arange(height) + 0.5) / height)
    screen = np.stack([*np.meshgrid(x, y), np.full((height, width), SCREEN_DISTANCE)], axis=-1)
    ambient, surfaces = read(options.scene)
    start = time.perf_counter()
    with np.errstate(all="ignore"):  # rays that miss divide by zero and take roots of negative numbers
        levels = trace(ambient, surfaces, screen.reshape(-1, 3), options.depth)
    print(f"traced in {time.perf_counter() - start:.4f} s")
    picture = (levels / 255).reshape(height, width, 3).astype(np.float32)
    if not oiio.ImageBuf(picture).write(str(options.picture)):
        raise SystemExit(oiio.geterror())


if __name__ == "__main__":
    main()
