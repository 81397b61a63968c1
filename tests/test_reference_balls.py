"""The ball arithmetic that certified pixels stand on: exact rational numbers say what is true."""

from __future__ import annotations

import operator
import random
from collections.abc import Callable, Iterator
from fractions import Fraction
from math import nextafter, ulp
from typing import Any

import drjit as dr
import numpy as np
import pytest
from flint import arb, ctx, fmpq
from numpy.typing import NDArray

from reference import balls
from reference.balls import Arrow, Ball
from reference.device import Types, array_types

Floats = NDArray[np.float64]
Exact = tuple[Fraction, ...]

COUNT = 1000
# Radii are rounded too, by a few parts in 2^53: that first errors count twice pays for it.
SLACK = 1 + Fraction(1, 2**49)
SHARES = [Fraction(1), Fraction(1, 2)]  # of the radii, how far off operands are at most, and so results


@pytest.fixture
def types() -> Types:
    """Of the processor, or of a graphics card where there is one: what certificates are computed with."""
    return array_types()


def exacts(values: Floats) -> list[Fraction]:
    return [Fraction(value) for value in values.tolist()]


def spread(pick: np.random.Generator, exponents: int) -> Floats:
    """Numbers of any size: random digits, digits that round badly, and neighbours of powers of 2."""
    digits = pick.integers(0, 2**52, COUNT)
    shifts = pick.integers(0, 53, COUNT)
    digits = np.choose(pick.integers(0, 4, COUNT), [digits, digits >> shifts << shifts, digits >> shifts, -digits - 1])
    digits &= 2**52 - 1
    digits[::7] = 2**52 - 1 - pick.integers(0, 3, len(digits[::7]))
    digits[1::7] = pick.integers(0, 3, len(digits[1::7]))
    sign = pick.choice([-1.0, 1.0], COUNT)
    return np.ldexp(sign * (1 + digits / 2**52), pick.integers(-exponents, exponents, COUNT))


def operands() -> Iterator[tuple[Floats, Floats, Floats]]:
    """Of any size; of nearly one size, so that sums cancel; and with a third that cancels the product."""
    pick = np.random.default_rng(1)
    yield spread(pick, 150), spread(pick, 150), spread(pick, 300)
    yield spread(pick, 30), spread(pick, 30), spread(pick, 60)
    a, b = spread(pick, 2), spread(pick, 2)
    yield a, b, -a * b
    yield a, np.nextafter(-a, b), np.nextafter(-a * np.nextafter(-a, b), 0)


ROUNDED: dict[str, Callable[[Any, Any, Any], Any]] = {
    "+": lambda a, b, c: a + b,
    "-": lambda a, b, c: a - b,
    "*": lambda a, b, c: a * b,
    "/": lambda a, b, c: a / b,
}


def same_bits(found: Floats, expected: Floats) -> bool:
    return np.array_equal(found.view(np.int64), expected.view(np.int64))


@pytest.mark.parametrize("name", ROUNDED)
def test_operations_are_rounded_correctly(name: str, types: Types) -> None:
    for numbers in operands():
        found = ROUNDED[name](*map(types.Float, numbers)).numpy()
        expected = [float(ROUNDED[name](*row)) for row in zip(*map(exacts, numbers), strict=True)]
        assert same_bits(found, np.array(expected))


def test_fused_operations_are_rounded_once(types: Types) -> None:
    for a, b, c in operands():
        found = dr.fma(types.Float(a), types.Float(b), types.Float(c)).numpy()
        expected = [float(x * y + z) for x, y, z in zip(exacts(a), exacts(b), exacts(c), strict=True)]
        assert same_bits(found, np.array(expected))


def test_roots_are_rounded_correctly(types: Types) -> None:
    for a, b, _ in operands():
        square = np.abs(np.where(np.arange(COUNT) % 2, a, b * b))
        for number in (square, np.nextafter(square, 0), np.nextafter(square, np.inf)):
            for root, true in zip(dr.sqrt(types.Float(number)).numpy().tolist(), exacts(number), strict=True):
                below, above = ((Fraction(root) + Fraction(nextafter(root, end))) / 2 for end in (0.0, float("inf")))
                assert below**2 < true < above**2, (root, true)


def test_no_step_is_reordered_or_merged(types: Types) -> None:
    """What fast-math would change, in one kernel; NumPy rounds every step."""
    for numbers in operands():
        a, b, c = numbers
        x, y, z = map(types.Float, numbers)
        found = [(x + y) - x, x * y + z, (x / z) / y, (x + y) + z, x * y - y * x, (x / y) * y, dr.sqrt(x * x) / y]
        dr.eval(found)
        expected = [(a + b) - a, a * b + c, (a / c) / b, (a + b) + c, a * b - b * a, (a / b) * b, np.sqrt(a * a) / b]
        for one, other in zip(found, expected, strict=True):
            assert same_bits(one.numpy(), other)


def off_by(pick: np.random.Generator, ball: Ball, share: Fraction, kind: int) -> list[Fraction]:
    """True numbers of a ball: at its ends, or anywhere in that share of it."""
    ends = pick.choice([-1, 1], COUNT)
    parts = [ends.tolist(), exacts(pick.uniform(-1, 1, COUNT)), np.zeros(COUNT, int).tolist()][kind]
    rows = zip(exacts(ball.value.numpy()), exacts(ball.radius.numpy()), parts, strict=True)
    return [value + radius * share * part for value, radius, part in rows]


def some_balls(pick: np.random.Generator, types: Types, widest: float) -> Ball:
    """Radii from 2^-60 of the values to `widest` times them, and none."""
    value = spread(pick, 20)
    radius = np.minimum(np.abs(value) * np.exp2(pick.uniform(-60, 6, COUNT)), np.abs(value) * widest)
    radius[::11] = 0
    return Ball(types.Float(value), types.Float(radius))


def holds(ball: Ball, truths: list[Fraction], share: Fraction = Fraction(1), slack: Fraction = SLACK) -> bool:
    rows = zip(exacts(ball.value.numpy()), exacts(ball.radius.numpy()), truths, strict=True)
    return all(abs(value - true) <= radius * share * slack for value, radius, true in rows)


STEPS: dict[str, tuple[Callable[..., Any], float]] = {
    "+": (operator.add, 64),
    "-": (operator.sub, 64),
    "*": (operator.mul, 64),
    "/": (operator.truediv, 0.9),
}


@pytest.mark.parametrize("share", SHARES, ids=str)
@pytest.mark.parametrize("name", STEPS)
def test_results_of_two_balls_hold_the_true_one(name: str, share: Fraction, types: Types) -> None:
    pick = np.random.default_rng(2)
    step, widest = STEPS[name]
    for kinds in [(0, 0), (0, 0), (0, 2), (2, 0), (1, 1), (2, 2)]:
        one, other = some_balls(pick, types, 64), some_balls(pick, types, widest)
        truths = [off_by(pick, ball, share, kind) for ball, kind in zip((one, other), kinds, strict=True)]
        assert holds(step(one, other), list(map(step, *truths)), share)


@pytest.mark.parametrize("share", SHARES, ids=str)
@pytest.mark.parametrize("kind", range(3))
def test_squares_and_negatives_hold_the_true_one(kind: int, share: Fraction, types: Types) -> None:
    pick = np.random.default_rng(3)
    ball = some_balls(pick, types, 64)
    truths = off_by(pick, ball, share, kind)
    assert holds(ball.squared(), [true**2 for true in truths], share)
    assert holds(-ball, [-true for true in truths], share)


@pytest.mark.parametrize("share", SHARES, ids=str)
@pytest.mark.parametrize("kind", range(3))
def test_roots_hold_the_true_one(kind: int, share: Fraction, types: Types) -> None:
    pick = np.random.default_rng(4)
    ball = some_balls(pick, types, 64)
    ball = Ball(dr.abs(ball.value), ball.radius)
    truths = [max(Fraction(0), true) for true in off_by(pick, ball, share, kind)]
    root = ball.root()
    for value, radius, true in zip(exacts(root.value.numpy()), exacts(root.radius.numpy()), truths, strict=True):
        off = radius * share * SLACK
        assert max(Fraction(0), value - off) ** 2 <= true <= (value + off) ** 2


def test_what_surely_is(types: Types) -> None:
    value, radius = types.Float([1, 1, 1, -1, -1, 1, 1]), types.Float([0.5, 1, 2, 0.5, 1, float("nan"), float("inf")])
    ball = Ball(value, radius)
    assert ball.beyond(0).numpy().tolist() == [True, *[False] * 6]
    assert ball.below(0).numpy().tolist() == [False] * 3 + [True] + [False] * 3
    chosen = (-ball).where(types.Float([1, 0, 0, 0, 0, 0, 0]) > 0, ball)
    assert chosen.value.numpy().tolist() == [-1, 1, 1, -1, -1, 1, 1]
    assert np.array_equal(chosen.radius.numpy(), radius.numpy(), equal_nan=True)


def vectors(array: Any) -> list[Exact]:
    """The vectors of a Dr.Jit array of them."""
    return list(zip(*map(exacts, array.numpy()), strict=True))


def dot(a: Exact, b: Exact) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def some_arrows(pick: np.random.Generator, types: Types) -> Arrow:
    """Components of one size or of many, and errors of up to a quarter."""
    x, y, z = (spread(pick, 12) for _ in range(3))
    size = np.sqrt(x * x + y * y + z * z)
    radius = size * np.exp2(pick.uniform(-60, -2, COUNT))
    radius[::11] = 0
    return Arrow.of(types.Vector3(*map(types.Float, (x, y, z))), types.Float(radius))


def of_length_one(vector: Exact) -> Exact:
    """In the same direction, not longer than 1 and hardly shorter."""
    numbers = np.array([float(value) for value in vector])
    numbers /= np.sqrt(numbers @ numbers) * (1 + 2**-50)
    unit = tuple(exacts(numbers))
    assert dot(unit, unit) <= 1
    return unit


def moved(pick: random.Random, arrow: Arrow, toward: list[Exact], share: Fraction) -> list[Exact]:
    """True vectors of an arrow, off by all of its radius: along `toward`, against it, or anywhere."""
    found = []
    for vector, radius, other in zip(vectors(arrow.value), exacts(arrow.radius.numpy()), toward, strict=True):
        direction = pick.choice([other, vector, tuple(Fraction(pick.gauss(0, 1)) for _ in range(3))])
        sign = pick.choice([-1, 1])
        off = (sign * radius * share * part for part in of_length_one(direction))
        found.append(tuple(a + b for a, b in zip(vector, off, strict=True)))
    return found


def points(arrow: Arrow, truths: list[Exact], share: Fraction) -> bool:
    """Whether true vectors are within the arrow's radius, and neither they nor its values longer than it says."""
    radii, lengths = exacts(arrow.radius.numpy()), exacts(arrow.length.numpy())
    for value, radius, length, true in zip(vectors(arrow.value), radii, lengths, truths, strict=True):
        off = tuple(a - b for a, b in zip(value, true, strict=True))
        if dot(off, off) > (radius * share * SLACK) ** 2:
            return False
        if max(dot(value, value), dot(true, true)) > (length * SLACK) ** 2:
            return False
    return True


@pytest.mark.parametrize("share", SHARES, ids=str)
def test_vectors_hold_the_true_ones(share: Fraction, types: Types) -> None:
    pick, choose = np.random.default_rng(5), random.Random(5)
    one, other = some_arrows(pick, types), some_arrows(pick, types)
    first = moved(choose, one, vectors(other.value), share)
    second = moved(choose, other, vectors(one.value), share)
    assert points(one, first, share)
    assert holds(one.dot(other), list(map(dot, first, second)), share)
    assert holds(one.square(), [dot(vector, vector) for vector in first], share)
    differences = [tuple(a - b for a, b in zip(*pair, strict=True)) for pair in zip(first, second, strict=True)]
    assert points(one - other, differences, share)
    t = some_balls(pick, types, 64)
    times = off_by(pick, t, share, kind=0)
    ends = [
        tuple(a + time * b for a, b in zip(start, d, strict=True))
        for start, time, d in zip(first, times, second, strict=True)
    ]
    assert points(one.along(t, other), ends, share)


def test_a_radius_left_out_is_noticed(types: Types, monkeypatch: pytest.MonkeyPatch) -> None:
    """These tests can fail: without the rounding errors no result holds the true one."""
    pick, choose = np.random.default_rng(6), random.Random(6)
    monkeypatch.setattr(balls, "UNIT", balls.UNIT / 4)
    one, other = some_balls(pick, types, 2**-60), some_balls(pick, types, 2**-60)
    truths = [off_by(pick, ball, Fraction(1), kind=2) for ball in (one, other)]
    assert not any(holds(step(one, other), list(map(step, *truths))) for step, _ in STEPS.values())
    assert not holds(one.squared(), [true**2 for true in truths[0]])
    a, b = some_arrows(pick, types), some_arrows(pick, types)
    narrow = [Arrow(arrow.value, arrow.radius / 4, arrow.length) for arrow in (a, b)]
    first, second = (moved(choose, *pair, Fraction(1)) for pair in ((a, vectors(b.value)), (b, vectors(a.value))))
    assert not holds(narrow[0].dot(narrow[1]), list(map(dot, first, second)))
    assert not holds(narrow[0].square(), [dot(vector, vector) for vector in first])


class Pool:
    """Balls on the device beside Arb's of the same numbers, and where no step was out of bounds."""

    def __init__(self, types: Types, seed: int) -> None:
        self.pick = random.Random(seed)
        self.balls: list[Ball] = []
        self.truths: list[list[arb]] = []
        self.valid: list[Any] = []
        for _ in range(5):
            decimals = [Fraction(self.pick.randrange(1, 10**6), 10**4) for _ in range(200)]
            values = [float(decimal) for decimal in decimals]
            radii = types.Float([ulp(value) for value in values])  # twice the roundoff
            truths = [arb(fmpq(decimal.numerator, decimal.denominator)) for decimal in decimals]
            self.add(Ball(types.Float(values), radii), truths, types.Mask(True))

    def add(self, ball: Ball, truths: list[arb], valid: Any) -> None:
        self.balls.append(ball)
        self.truths.append(truths)
        self.valid.append(valid)

    def step(self) -> None:
        one, other = (self.pick.randrange(len(self.balls)) for _ in range(2))
        a, b, x, y = self.balls[one], self.balls[other], self.truths[one], self.truths[other]
        valid = self.valid[one] & self.valid[other]
        match self.pick.choice(["+", "-", "*", "/", "square", "root"]):
            case "square":
                self.add(a.squared(), [true**2 for true in x], self.valid[one])
            case "root":
                truths = [true.sqrt() if true > 0 else true for true in x]
                self.add(a.root(), truths, self.valid[one] & a.beyond(0))
            case "/":
                self.add(a / b, list(map(operator.truediv, x, y)), valid & (b.beyond(0) | b.below(0)))
            case name:
                self.add(STEPS[name][0](a, b), list(map(STEPS[name][0], x, y)), valid)


def test_long_calculations_hold_the_true_result(types: Types, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fused into one kernel, and without slack: the first errors, counted twice, pay for all that follows."""
    monkeypatch.setattr(ctx, "prec", 3000)
    tried = 0
    for seed in range(12):
        pool = Pool(types, seed)
        for _ in range(15):
            pool.step()
        valid = [mask & (ball.radius < 1e100) for mask, ball in zip(pool.valid, pool.balls, strict=True)]
        dr.eval(valid, [(ball.value, ball.radius) for ball in pool.balls])
        for ball, truths, mask in zip(pool.balls, pool.truths, valid, strict=True):
            values, radii = ball.value.numpy(), ball.radius.numpy()
            for place in np.flatnonzero(mask.numpy() & (np.abs(values) < 1e100) & (np.abs(values) > 1e-100)):
                tried += 1
                off = abs(truths[place] - arb(float(values[place])))
                assert off <= arb(float(radii[place])), (seed, place, off, radii[place])
    assert tried > 20_000
