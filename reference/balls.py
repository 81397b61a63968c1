"""Ball arithmetic on the device: every number is a value and a radius that holds the true number.

A rounding adds `UNIT`, twice the roundoff of double precision, relative to the result. Radii are made of such errors
by sums, and products with positive numbers: that each error counts twice pays for the rounding of the radii themselves.
Numbers must stay clear of underflow and overflow. A radius that is not a number proves nothing, as it should.
"""

from __future__ import annotations

from typing import Any

import drjit as dr

Number = Any
Vector = Any
Mask = Any

UNIT = 2.0**-52


class Ball:
    """Numbers within `radius` of `value`, one a ray."""

    def __init__(self, value: Number, radius: Number) -> None:
        self.value, self.radius = value, radius

    def __add__(self, other: Ball) -> Ball:
        value = self.value + other.value
        return Ball(value, dr.fma(dr.abs(value), UNIT, self.radius + other.radius))

    def __sub__(self, other: Ball) -> Ball:
        value = self.value - other.value
        return Ball(value, dr.fma(dr.abs(value), UNIT, self.radius + other.radius))

    def __mul__(self, other: Ball) -> Ball:
        value, size, other_size = self.value * other.value, dr.abs(self.value), dr.abs(other.value)
        radius = dr.fma(self.radius, other.radius + other_size, dr.fma(size, other.radius, dr.abs(value) * UNIT))
        return Ball(value, radius)

    def __truediv__(self, other: Ball) -> Ball:
        """Where the divisor may be 0, the radius may be anything: test it before."""
        value, least = self.value / other.value, dr.abs(other.value) - other.radius
        radius = dr.fma(dr.abs(value), other.radius, self.radius) / least
        return Ball(value, dr.fma(dr.abs(value), UNIT, radius))

    def __neg__(self) -> Ball:
        return Ball(-self.value, self.radius)

    def squared(self) -> Ball:
        """The square, tighter than a product."""
        value, size = self.value * self.value, dr.abs(self.value)
        return Ball(value, dr.fma(self.radius, dr.fma(2, size, self.radius), value * UNIT))

    def root(self) -> Ball:
        """The square root of a positive number: |sqrt(a) - sqrt(b)| <= |a - b| / sqrt(b)."""
        value = dr.sqrt(self.value)
        return Ball(value, dr.fma(value, UNIT, self.radius / value))

    def beyond(self, least: float) -> Mask:
        """Where it surely is more than `least`."""
        return self.value - self.radius > least

    def below(self, most: float) -> Mask:
        """Where it surely is less than `most`."""
        return self.value + self.radius < most

    def where(self, chosen: Mask, other: Ball) -> Ball:
        """Itself where chosen, the other elsewhere."""
        return Ball(dr.select(chosen, self.value, other.value), dr.select(chosen, self.radius, other.radius))


class Arrow:
    """Vectors within `radius` of `value`; none of them, nor `value`, is longer than `length`."""

    def __init__(self, value: Vector, radius: Number, length: Number) -> None:
        self.value, self.radius, self.length = value, radius, length

    @staticmethod
    def of(value: Vector, radius: Number) -> Arrow:
        """A sum that was rounded to `value`, of terms whose errors sum to `radius`."""
        size = dr.norm(value)
        radius = dr.fma(size, UNIT, radius)
        return Arrow(value, radius, size + radius)

    def __sub__(self, other: Arrow) -> Arrow:
        return Arrow.of(self.value - other.value, self.radius + other.radius)

    def dot(self, other: Arrow) -> Ball:
        """By Cauchy and Schwarz; three products and two sums are rounded."""
        radius = dr.fma(self.radius, other.length, self.length * dr.fma(other.length, 3 * UNIT, other.radius))
        return Ball(dr.dot(self.value, other.value), radius)

    def square(self) -> Ball:
        """The square of its length."""
        value = dr.dot(self.value, self.value)
        return Ball(value, dr.fma(self.radius, 2 * self.length, 3 * UNIT * value))

    def along(self, t: Ball, d: Arrow) -> Arrow:
        """The point at t along d."""
        radius = dr.fma(dr.abs(t.value) + t.radius, d.radius, dr.fma(t.radius, d.length, self.radius))
        return Arrow.of(dr.fma(d.value, t.value, self.value), radius)
