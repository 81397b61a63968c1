"""One ray tree in ball arithmetic, with a choice wherever the balls cannot tell which way a ray goes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from flint import arb

from reference.enclosure import HeldPlane, HeldSphere, Point, Tables, along, ball, dot, minus, mirrored
from reference.rules import Rules

Verdict = bool | None  # None: the balls cannot tell

ZERO, ONE = arb(0), arb(1)


class UndecidedError(Exception):
    """The balls are too wide at this precision."""


class UnboundedError(Exception):
    """A mirrored ray starts at an unlimited distance, among surfaces that it does not leave behind."""


class Hit(NamedTuple):
    """Where a ray may hit: `sure` if it does, `ruled` if it does by the model's rule for ties."""

    t: arb
    place: int
    sure: bool
    ruled: bool
    bounded: bool = True  # else t is the least that it can be


class _Window(NamedTuple):
    """What counts along a ray: from `least` on, surely from `clear` on; planes with |d.n| up to `missed` do not."""

    least: arb
    clear: arb
    missed: arb


class Ray(NamedTuple):
    """A ray of the tree: what it hit, None for nothing, and whether that has a diffuse term."""

    origin: Point
    d: Point  # as long as the camera's
    hit: Hit | None
    lit: bool


class Walk:
    """One way through the choices: `path` lists the first of them; `taken` all, each with the number of its ways."""

    def __init__(self, tables: Tables, rules: Rules, path: list[int], may_choose: bool) -> None:
        self.tables, self.rules, self.path, self.may_choose = tables, rules, path, may_choose
        self.taken: list[tuple[int, int]] = []
        self.rays: list[Ray] = []

    def choose(self, ways: int) -> int:
        """Which way to go where the balls cannot tell; the first is the model's rule for ties."""
        if not self.may_choose:
            raise UndecidedError
        place = len(self.taken)
        way = self.path[place] if place < len(self.path) else 0
        self.taken.append((way, ways))
        return way

    def next_path(self) -> list[int] | None:
        """The path that differs from this one in the last choice that has another way."""
        taken = list(self.taken)
        while taken and taken[-1][0] + 1 == taken[-1][1]:
            taken.pop()
        return [*(way for way, _ in taken[:-1]), taken[-1][0] + 1] if taken else None

    def colour(self, d: Point, limit: int) -> Point:
        """What the camera's ray along `d` brings back; raises UndecidedError and UnboundedError."""
        total: Point = (ZERO, ZERO, ZERO)
        weight, origin, leaving = ONE, self.tables.eye, None
        d = self.loosened(d)
        for depth in range(limit + 1):
            hit = self.nearest(origin, d, leaving)
            if hit is None:
                self.rays.append(Ray(origin, d, None, lit=False))
                break
            surface = self.tables.surfaces[hit.place]
            point = self.loosened(along(origin, hit.t, d))
            arm = minus(point, surface.centre) if isinstance(surface, HeldSphere) else surface.normal
            cosine = self.cosine(surface, point, arm, hit.place) if hit.bounded else self.far_cosine(hit, origin, d)
            self.rays.append(Ray(origin, d, hit, lit=not cosine.is_zero()))
            lit = surface.diffuse * cosine
            red, green, blue = (
                sum_ + weight * colour * (ambient + lit)
                for sum_, colour, ambient in zip(total, surface.colour, self.tables.ambient, strict=True)
            )
            total = (red, green, blue)
            if surface.reflection.is_zero() or depth == limit:
                break
            if not hit.bounded:
                self.leave_behind(hit, origin, d)
                break
            weight = weight * surface.reflection
            d = self.loosened(mirrored(d, arm, surface))
            origin, leaving = self.start(point, arm, d), hit.place
        return total

    def loosened(self, point: Point) -> Point:
        """With the error that the rules' precision allows."""
        if not self.rules.precision:
            return point
        error = arb(0, self.rules.precision * max(float(value.abs_upper()) for value in point))
        return (point[0] + error, point[1] + error, point[2] + error)

    def nearest(self, origin: Point, d: Point, leaving: int | None) -> Hit | None:
        """The first hit along the ray; by choice where several may be the first."""
        dd = dot(d, d)
        window = self.window(leaving, dd.sqrt())
        hits: list[Hit] = []
        for index, surface in self.tables.along(origin, d):
            if isinstance(surface, HeldSphere):
                hits += _meet_sphere(index, surface, origin, d, dd, leaving, window, bool(self.rules.ahead))
            elif index != leaving:
                hits += _meet_plane(index, surface, origin, d, leaving, window)
        if self.rules.far:
            seen = arb(self.rules.far) / dd.sqrt()
            hits = [hit if hit.t < seen else hit._replace(sure=False) for hit in hits]
        sure = [hit for hit in hits if hit.sure]
        if not sure:
            return _choose_hit(self, [*hits, None])
        first = min(sure, key=lambda hit: float(hit.t.upper()))
        return _choose_hit(self, [hit for hit in hits if not hit.t > first.t])

    def window(self, leaving: int | None, length: arb) -> _Window:
        """What counts along a ray; the rules of mirrored rays are about directions at unit length."""
        missed = ball(self.rules.grazing)
        if leaving is None:
            return _Window(ONE, ONE, missed)
        clear = max(self.rules.reflection, self.rules.gap)
        return _Window(ball(self.rules.reflection) / length, ball(clear) / length, missed * length)

    def cosine(self, surface: HeldSphere | HeldPlane, point: Point, arm: Point, index: int) -> arb:
        """n.l where the light reaches the point, else 0."""
        to_light = minus(self.tables.light, point)
        distance = dot(to_light, to_light).sqrt()
        if isinstance(surface, HeldSphere):
            cosine = dot(arm, to_light) / (surface.radius * distance)
        else:
            cosine = -surface.from_light / (surface.length * distance)
        if surface.diffuse.is_zero() or cosine <= 0:
            return ZERO
        if not cosine > 0:
            return ZERO.union(cosine.upper())  # whether or not something blocks it
        if self.rules.ahead:
            point = self.start(point, arm, to_light)
            to_light = minus(self.tables.light, point)
            distance = dot(to_light, to_light).sqrt()
        return ZERO if self.blocked(point, to_light, distance, index) else cosine

    def start(self, point: Point, arm: Point, d: Point) -> Point:
        """Where the ray along `d` starts that leaves a surface of normal `arm`: there, or off it on the side of `d`."""
        if not self.rules.ahead:
            return point
        largest = max(float(abs(a - ball(b)).mid()) for a, b in zip(point, self.rules.origin, strict=True))
        step = arb(self.rules.ahead * (1 + largest)) / dot(arm, arm).sqrt()
        return along(point, -step if dot(arm, d) < 0 else step, arm)

    def blocked(self, point: Point, to_light: Point, distance: arb, leaving: int) -> bool:
        """Whether a surface stands before the light; by choice where that is open."""
        if self.rules.short:
            to_light = minus(along(self.tables.light, ball(-self.rules.short), to_light), point)
        start = ball(self.rules.shadow)
        late = max(start, arb(self.rules.gap) / distance, key=lambda share: float(share.upper()))
        doubts = []
        for index, surface in self.tables.along(point, to_light):
            verdict, ruled = self.blocks(surface, point, to_light, index == leaving, start)
            if verdict and self.rules.gap:
                verdict, ruled = self.blocks(surface, point, to_light, index == leaving, late)[0] or None, True
            if verdict:
                return True
            if verdict is None:
                doubts.append(ruled)
        if not doubts:
            return False
        return any(doubts) is (self.choose(2) == 0)

    def blocks(
        self, surface: HeldSphere | HeldPlane, point: Point, to_light: Point, left: bool, start: arb
    ) -> tuple[Verdict, bool]:
        """Whether the surface is met at start < t < 1, and whether it is so by the model's rule for ties."""
        if isinstance(surface, HeldSphere):
            return _sphere_blocks(surface, point, to_light, left, start, bool(self.rules.short))
        if left or surface.from_light.is_zero():
            return False, False
        side = surface.offset - dot(point, surface.normal)
        if self.rules.grazing and abs(side - surface.from_light) <= arb(self.rules.grazing) * surface.length:
            return False, False
        at_end = side - dot(to_light, surface.normal) if self.rules.short else surface.from_light
        return _opposite(side * (1 - start) + at_end * start, at_end), False

    def far_cosine(self, hit: Hit, origin: Point, d: Point) -> arb:
        """n.l of a plane at a distance of at least hit.t along d: at most its distance from the light over that."""
        plane = self.tables.surfaces[hit.place]
        assert isinstance(plane, HeldPlane)
        to_light = minus(self.tables.light, origin)
        least = hit.t * dot(d, d).sqrt() - dot(to_light, to_light).sqrt()
        if not least > 0:
            raise UnboundedError
        return ZERO.union((abs(plane.from_light) / (plane.length * least)).upper())

    def leave_behind(self, hit: Hit, origin: Point, d: Point) -> None:
        """Raise UnboundedError unless the ray mirrored at a distance of at least hit.t meets nothing any more."""
        plane = self.tables.surfaces[hit.place]
        assert isinstance(plane, HeldPlane)
        onward = mirrored(d, plane.normal, plane)
        for index, surface in enumerate(self.tables.surfaces):
            if index == hit.place:
                continue
            if isinstance(surface, HeldSphere):
                p = minus(origin, surface.centre)
                behind = hit.t * dot(d, onward) > abs(dot(p, onward))
                behind &= hit.t * dot(d, d).sqrt() > dot(p, p).sqrt() + surface.radius
            else:
                slope, slope_onward = dot(d, surface.normal), dot(onward, surface.normal)
                behind = slope * slope_onward > 0
                behind &= hit.t * abs(slope) > abs(surface.offset - dot(origin, surface.normal))
            if not behind:
                raise UnboundedError


def _choose_hit(walk: Walk, ways: list[Hit | None]) -> Hit | None:
    """Where several hits may be the first: by the model's rule the first listed of those that tie, then the others."""
    if len(ways) == 1:
        return ways[0]
    ruled = [hit for hit in ways if hit and hit.ruled]
    nearest = min(ruled, key=lambda hit: float(hit.t.lower()), default=None)
    first = next((hit for hit in ruled if nearest and not hit.t > nearest.t), None)
    return [first, *(way for way in ways if way is not first)][walk.choose(len(ways))]


def _meet_sphere(
    index: int, sphere: HeldSphere, origin: Point, d: Point, dd: arb, leaving: int | None, window: _Window, off: bool
) -> Iterator[Hit]:
    """The roots that may count, up to the first that surely does if the ray meets the sphere at all.

    A ray that starts off the sphere that it leaves does so outside and away from it, or inside.
    """
    p = minus(origin, sphere.centre)
    half = dot(p, d)
    sure = True
    if index == leaving and not (off and half < 0):
        roots = [-2 * half / dd]
    else:
        constant = sphere.at_eye if leaving is None else dot(p, p) - sphere.radius**2
        squared = half * half - dd * constant
        if squared < 0:
            return
        sure = bool(squared > 0)
        root = squared.sqrt() if sure else ZERO.union(squared.upper().sqrt())
        roots = [(-half - root) / dd, (root - half) / dd][index == leaving :]
    for t in roots:
        counts, clear = bool(t > window.least), bool(t > window.clear)
        if counts or not t < window.least:
            yield Hit(t, index, sure and clear, counts)
        if clear:
            return


def _meet_plane(
    index: int, plane: HeldPlane, origin: Point, d: Point, leaving: int | None, window: _Window
) -> Iterator[Hit]:
    """The crossing if it may count. Along a plane, what is farther than any bound, or a miss by the rule for ties."""
    if leaving is None and (plane.offset.is_zero() or plane.is_screen):
        return
    side = plane.offset if leaving is None else plane.offset - dot(origin, plane.normal)
    facing = dot(d, plane.normal)
    slope, missed = abs(facing), window.missed * plane.length
    if not missed.is_zero() and slope <= missed:
        return
    if facing > 0 or facing < 0:
        t = side / facing
        counts = bool(t > window.least)
        if counts or not t < window.least:
            yield Hit(t, index, bool(t > window.clear and (missed.is_zero() or slope > missed)), counts)
        return
    farther = side.abs_lower()
    if farther > 0:
        farther = arb.pos_inf() if facing.is_zero() else farther / facing.abs_upper()
    yield Hit(farther, index, sure=False, ruled=False, bounded=False)


def _sphere_blocks(
    sphere: HeldSphere, point: Point, to_light: Point, left: bool, start: arb, short: bool
) -> tuple[Verdict, bool]:
    """Whether dd t^2 + 2 half t + constant has a root in start < t < 1, by its signs; a double root counts.

    Unless the way is `short`, the light is at its end.
    """
    p, dd = minus(point, sphere.centre), dot(to_light, to_light)
    half = dot(p, to_light)
    constant = ZERO if left else dot(p, p) - sphere.radius**2
    at_end = constant + 2 * half + dd if short else sphere.at_light
    if at_end.is_zero():  # one root is 1, so that the other is constant / dd
        return not left and _both(_positive(constant - start * dd), _positive(dd - constant)), False
    if left and start.is_zero():
        return _both(_positive(-half), _positive(at_end)), False
    slope, end_slope = half + dd * start, half + dd
    at_start = constant + (half + slope) * start
    squared = half * half - dd * constant
    if squared < 0:
        return False, False
    if at_end < 0:
        return _positive(at_start), False
    if not at_end > 0:
        return None, False
    dips = _both(_positive(-slope), _positive(end_slope))
    if at_start < 0 or (dips and squared > 0):
        return True, True
    if at_start > 0:
        return dips and None, True
    return None, False


def _both(one: Verdict, other: Verdict) -> Verdict:
    return False if one is False or other is False else None if one is None or other is None else True


def _positive(value: arb) -> Verdict:
    return True if value > 0 else False if value < 0 else None


def _opposite(one: arb, other: arb) -> Verdict:
    """Whether two balls have opposite signs."""
    return _positive(-one * other)
