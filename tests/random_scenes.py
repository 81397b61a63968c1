"""Scenes made from a number: spheres and planes in any position, matte and mirroring, written in short decimals."""

import random

from reference.scene import Plane, Scene, Sphere, Triple, merge_coincident

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def random_scene(seed: int) -> Scene:
    """The scene of that number: 1 to 8 spheres and up to 4 planes, in front of the eye for the most part."""
    pick = random.Random(seed)

    def decimal(low: float, high: float, digits: int = 1) -> float:
        return round(pick.uniform(low, high), digits)

    def triple(low: float, high: float, digits: int = 1) -> Triple:
        return (decimal(low, high, digits), decimal(low, high, digits), decimal(low, high, digits))

    def share() -> float:
        return pick.choice([0.0, 0.2, 0.5, 1.0, decimal(0, 1, 2)])

    def colour() -> Triple:
        return triple(0, 255, 0)

    def sphere() -> Sphere:
        radius = decimal(5, 80)
        centre = (decimal(-150, 150), decimal(-110, 120), decimal(80 if pick.random() < 0.1 else 150, 600))
        return Sphere(colour(), centre, radius, share(), share())

    def plane() -> Plane:
        if pick.random() < 0.6:
            axis, length = pick.choice(AXES), pick.choice([-2.0, -1.0, 1.0, 1.0, 3.0])
            normal = (axis[0] * length, axis[1] * length, axis[2] * length)
        else:
            normal = triple(-3, 3, 2)
        far = decimal(90, 900)
        point = (pick.choice([-far, far]), pick.choice([-100.0, -far / 2, 120.0]), far)
        return Plane(colour(), point, normal if any(normal) else AXES[1], share(), share())

    spheres = tuple(sphere() for _ in range(pick.randint(1, 8)))
    planes = tuple(plane() for _ in range(pick.randint(0, 4)))
    return merge_coincident(Scene(triple(0, 255, 0), decimal(0, 0.6, 2), spheres, planes))
