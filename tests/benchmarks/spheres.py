"""Scenes of as many spheres as wanted, the same ones every time: a hill of them at random, with a floor and a wall."""

from __future__ import annotations

import numpy as np

from reference.scene import Plane, Scene, Sphere

# The hill fills the half of this box that is under its diagonal: it rises from the front, where eye and light see it.
LOW, HIGH = np.array([-600.0, -150.0, 350.0]), np.array([600.0, 350.0, 1250.0])
FLOOR = Plane((180.0, 170.0, 160.0), (0.0, -150.0, 0.0), (0.0, 1.0, 0.0), 0.7, 0.3)
WALL = Plane((120.0, 140.0, 170.0), (0.0, 0.0, 1300.0), (0.0, 0.0, -1.0), 0.7, 0.3)
RADIUS = (0.3, 0.4)  # from and to, of the mean distance from sphere to sphere


def sphere_scene(number: int) -> Scene:
    """`number` spheres of diffuse .7 and reflection .3, each of its own colour."""
    pick = np.random.default_rng(number)
    spacing = float((np.prod(HIGH - LOW) / 2 / number) ** (1 / 3))
    radii = spacing * pick.uniform(*RADIUS, number)
    places = pick.uniform(size=(number, 3))
    places[:, 1:].sort(axis=1)  # the height is at most the way to the back
    centres = LOW + places * (HIGH - LOW)
    centres[:, 1] = np.maximum(centres[:, 1], FLOOR.point[1] + radii)  # on the floor, not in it
    centres[:, 2] = np.minimum(centres[:, 2], WALL.point[2] - radii)
    colours = pick.integers(40, 256, (number, 3)).astype(float)
    rows = zip(colours.tolist(), centres.round(3).tolist(), radii.round(4).tolist(), strict=True)
    spheres = tuple(Sphere((r, g, b), (x, y, z), radius, 0.7, 0.3) for (r, g, b), (x, y, z), radius in rows)
    return Scene((255.0, 255.0, 255.0), 0.2, spheres, (FLOOR, WALL))
