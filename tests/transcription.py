"""A plain NumPy float64 transcription of the model's specification, for use as a cross-check in tests."""

from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

LIGHT = (500, 500, 500)
SCREEN = 1.0
SHIFT = 1e-4
DOCUMENT_EPSILON = 1e-6


class Surface(NamedTuple):
    """A sphere (`radius`, no `normal`) or a plane (unit `normal`, no `radius`); `exact` is its place as decimals."""

    colour: Floats
    place: Floats
    normal: Floats | None
    radius: float
    diffuse: float
    reflection: float
    exact: tuple[Fraction, ...]


class Scene(NamedTuple):
    """A scene file: the ambient term, and the surfaces in listed order, spheres before planes."""

    ambient: Floats
    ambient_coefficient: float
    surfaces: list[Surface]


class Convention(NamedTuple):
    """What sets one row of "Three conventions of the same model" apart from the others."""

    epsilon: float
    near: float
    skips_own: bool = False
    closed_planes: bool = False
    start_shift: float = 0.0
    divides: bool = False
    symbolic: bool = False


CONVENTIONS = {
    "document": Convention(DOCUMENT_EPSILON, SHIFT),
    "published": Convention(1e-3, SHIFT, skips_own=True, closed_planes=True, start_shift=SHIFT, divides=True),
    "exact": Convention(0.0, 0.0, symbolic=True),
}


class Rays(NamedTuple):
    """Rays `origin + t direction`; `own` is the index of the surface each one leaves, -1 at the eye."""

    origin: Floats
    direction: Floats
    own: NDArray[np.intp]

    def only(self, chosen: Bools) -> "Rays":
        return Rays(self.origin[chosen], self.direction[chosen], self.own[chosen])


def read(text: str) -> Scene:
    """Read a valid scene file: one value group a line, blank lines skipped."""
    rows = [[Fraction(token) for token in line.split()] for line in text.lstrip("\ufeff").splitlines() if line.strip()]
    groups = iter(rows)
    ambient, coefficient = _floats(next(groups)), float(next(groups)[0])
    spheres = [_surface(groups, False) for _ in range(int(next(groups)[0]))]
    planes = [_surface(groups, True) for _ in range(int(next(groups)[0]))]
    return Scene(ambient, coefficient, spheres + planes)


def _surface(groups: Iterator[list[Fraction]], is_plane: bool) -> Surface:
    colour, place, shape, (diffuse,), (reflection,) = (next(groups) for _ in range(5))
    normal, radius = None, float(shape[0])
    if is_plane:
        largest = max(abs(value) for value in shape)
        scaled = _floats([value / largest for value in shape])
        normal, radius = scaled / np.sqrt(scaled @ scaled), 0.0
    exact = (*place, *shape)
    return Surface(_floats(colour), _floats(place), normal, radius, float(diffuse), float(reflection), exact)


def _floats(values: list[Fraction]) -> Floats:
    return np.array([float(value) for value in values], dtype=np.float64)


def _coincide(first: Surface, second: Surface) -> bool:
    """Whether two surfaces are the same set of points, decided on the exact decimals."""
    if first.normal is None or second.normal is None:
        return first.exact == second.exact
    (a, b, c), (u, v, w) = first.exact[3:], second.exact[3:]
    return b * w == c * v and c * u == a * w and a * v == b * u and _holds(first, second.exact[:3])


def _holds(surface: Surface, point: tuple[Fraction | int, ...]) -> bool:
    """Whether a point lies on the surface, decided on the exact decimals."""
    offset = [p - q for p, q in zip(point, surface.exact[:3], strict=True)]
    if surface.normal is None:
        return sum(value * value for value in offset) == surface.exact[3] ** 2
    return sum(value * n for value, n in zip(offset, surface.exact[3:], strict=True)) == 0


def _merged(surfaces: list[Surface]) -> list[Surface]:
    """Coincident surfaces merged: the first listed stays."""
    return [one for i, one in enumerate(surfaces) if not any(_coincide(earlier, one) for earlier in surfaces[:i])]


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray((a * b).sum(axis=-1), dtype=np.float64)


def _crossings(surface: Surface, rays: Rays, own: Bools, rules: Convention, to_light: bool) -> list[Floats]:
    """The t of each crossing of a surface, smaller root first, NaN where there is none or the rules exclude it."""
    p, d = rays.origin - surface.place, rays.direction
    light_on_it = to_light and rules.symbolic and _holds(surface, LIGHT)
    if surface.normal is not None:
        slope = _dot(d, surface.normal)
        missed = (np.abs(slope) < rules.epsilon) | (slope == 0) | light_on_it
        missed |= own & (rules.skips_own or rules.symbolic)
        return [np.where(missed, np.nan, -_dot(p, surface.normal) / slope)]
    a, b, c = _dot(d, d), 2 * _dot(p, d), _dot(p, p) - surface.radius**2
    root = np.sqrt(b * b - 4 * a * c)
    near, far = (-b - root) / (2 * a), (-b + root) / (2 * a)
    if light_on_it:
        near, far = np.full_like(a, np.nan), np.where(own, np.nan, c / a)
    elif rules.symbolic or rules.skips_own:
        near, far = np.where(own, np.nan, near), np.where(own, -b / a if rules.symbolic else np.nan, far)
    return [near, far]


def _nearest(surfaces: list[Surface], rays: Rays, rules: Convention, near: float) -> tuple[Floats, NDArray[np.intp]]:
    """The nearest hit beyond `near` (infinity and -1 for a miss); on a tie the first listed wins."""
    best, which = np.full(len(rays.own), np.inf), np.full(len(rays.own), -1, dtype=np.intp)
    for index, surface in enumerate(surfaces):
        for t in _crossings(surface, rays, rays.own == index, rules, to_light=False):
            counts = t >= near if rules.closed_planes and surface.normal is not None else t > near
            closer = counts & (t < best)
            best[closer], which[closer] = t[closer], index
    return best, which


def _blocked(surfaces: list[Surface], rays: Rays, rules: Convention) -> Bools:
    """Whether anything lies between the origins and the light."""
    result = np.zeros(len(rays.own), dtype=np.bool_)
    for index, surface in enumerate(surfaces):
        for t in _crossings(surface, rays, rays.own == index, rules, to_light=True):
            result |= (t < 1) & (t > rules.near)
    return result


def _colour(scene: Scene, rays: Rays, rules: Convention, depth: int, max_depth: int) -> Floats:
    """colour(ray, depth) = ambient + diffuse + reflection; a miss gives black."""
    result = np.zeros((len(rays.own), 3))
    t, which = _nearest(scene.surfaces, rays, rules, SCREEN if depth == 0 else rules.near)
    met = which >= 0
    hits = rays.only(met)
    which, point = which[met], hits.origin + t[met][:, None] * hits.direction
    surface_colour, normal = np.empty_like(point), np.empty_like(point)
    kd, kr = np.empty((len(which), 1)), np.empty((len(which), 1))
    for index, surface in enumerate(scene.surfaces):
        on = which == index
        surface_colour[on], kd[on], kr[on] = surface.colour, surface.diffuse, surface.reflection
        normal[on] = (point[on] - surface.place) / surface.radius if surface.normal is None else surface.normal

    shadow = Rays(point, np.array(LIGHT, dtype=np.float64) - point, which)
    cosine = _dot(normal, shadow.direction) / np.sqrt(_dot(shadow.direction, shadow.direction))
    lit = np.where(_blocked(scene.surfaces, shadow, rules), 0.0, np.fmax(0.0, cosine))
    local = scene.ambient * scene.ambient_coefficient * surface_colour / 256 + surface_colour * kd * lit[:, None]

    mirrors = kr[:, 0] != 0
    if depth < max_depth and mirrors.any():
        bounced = hits.direction - 2 * _dot(hits.direction, normal)[:, None] * normal
        bounced /= np.sqrt(_dot(bounced, bounced))[:, None]
        reflected = Rays(point + rules.start_shift * normal, bounced, which).only(mirrors)
        seen = _colour(scene, reflected, rules, depth + 1, max_depth)
        local[mirrors] += kr[mirrors] * (seen / (depth + 1) if rules.divides else seen)
    result[met] = local
    return result


def picture(text: str, width: int, height: int, depth: int = 3, convention: str = "document") -> Floats:
    """The linear picture of a scene file, (height, width, 3) on the 0..255 scale, not clamped; `depth` is max_depth."""
    scene, rules = read(text), CONVENTIONS[convention]
    if rules.symbolic:
        scene = scene._replace(surfaces=_merged(scene.surfaces))
    x = (100 * np.arange(width) + 50 - 50 * width) / width
    y = (50 * height - 100 * np.arange(height) - 50) / height
    direction = np.stack([*np.meshgrid(x, y), np.full((height, width), 100.0)], axis=-1).reshape(-1, 3)
    camera = Rays(np.zeros_like(direction), direction, np.full(len(direction), -1, dtype=np.intp))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return _colour(scene, camera, rules, 0, depth).reshape(height, width, 3)


def truncated(image: Floats) -> NDArray[np.uint8]:
    """Clamped once to [0, 255] and truncated, not rounded, to 8 bits."""
    return np.clip(image, 0, 255).astype(np.uint8)
