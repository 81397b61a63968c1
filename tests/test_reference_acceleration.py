"""The tree finds what a loop over all spheres finds, whatever the spheres and the rays."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from reference.acceleration import LEAF, ROUNDING, Tree
from reference.device import array_types, load_drjit
from reference.tables import upload

dr = load_drjit()
TYPES = array_types("single", "cpu")
NOTHING = 0xFFFFFFFF

Spheres = tuple[NDArray[np.float64], NDArray[np.float64]]


class FilledTree(Tree):
    """A tree that hands each step the sphere's centre and radius, too, in single precision."""

    def __init__(self, types: Any, centres: NDArray[np.float64], radii: NDArray[np.float64]) -> None:
        super().__init__(types, centres, radii)
        rows = np.column_stack([centres, radii])[self.order]
        self.spheres = upload(types.Float, rows.astype(np.float32))

    def fold(
        self, origin: Any, direction: Any, margin: Any, reach: Any, step: Any, state: Any, going: Any
    ) -> tuple[Any, ...]:
        def meet(place: Any, *state: Any) -> Any:
            return step(place, dr.gather(TYPES.Vector4, self.spheres, place), *state)

        return super().fold(origin, direction, margin, reach, meet, state, going)


def cloud(random: np.random.Generator, n: int) -> Spheres:
    return random.uniform(-300, 300, (n, 3)), random.uniform(0.1, 40, n)


def cluster(random: np.random.Generator, n: int) -> Spheres:
    """Most spheres in a tiny ball, the others far around."""
    tiny = np.arange(n) % 5 > 0
    centres = np.where(tiny[:, None], random.normal([20, 10, 150], 0.5, (n, 3)), random.uniform(-300, 300, (n, 3)))
    return centres, np.where(tiny, 0.05, 8)


def one_centre(random: np.random.Generator, n: int) -> Spheres:
    return np.full((n, 3), [30.0, -20.0, 100.0]), random.uniform(1, 90, n)


def one_height(random: np.random.Generator, n: int) -> Spheres:
    return random.uniform(-300, 300, (n, 3)) * [1, 0, 1], random.uniform(1, 20, n)


def one_line(random: np.random.Generator, n: int) -> Spheres:
    return random.uniform(-300, 300, (n, 3)) * [0, 0, 1], random.uniform(0, 20, n)


def large_and_small(random: np.random.Generator, n: int) -> Spheres:
    return random.uniform(-300, 300, (n, 3)), 10 ** random.uniform(-3, 2.6, n)


def far_away(random: np.random.Generator, n: int) -> Spheres:
    return random.uniform(-1e5, 1e5, (n, 3)), random.uniform(100, 8000, n)


SCENES = (cloud, cluster, one_centre, one_height, one_line, large_and_small, far_away)


def aim(random: np.random.Generator, spheres: Spheres) -> tuple[Any, Any, Any]:
    """Rays from within and from around to somewhere near a sphere, some along an axis or in a plane of two."""
    centres, radii = spheres if len(spheres[1]) else (np.zeros((1, 3)), np.ones(1))
    n = 4096
    scale = np.abs(centres).max() + radii.max() + 1
    origin = random.uniform(-1.5, 1.5, (n, 3)) * scale
    origin[:1024] = centres[random.integers(len(centres), size=1024)]
    target = random.integers(len(centres), size=n)
    direction = centres[target] + random.normal(0, 1, (n, 3)) * radii[target, None] - origin
    flat = np.arange(n) % 4 == 1
    direction[flat, random.integers(3, size=flat.sum())] = 0.0
    along = np.arange(n) % 4 == 2
    axis = random.integers(3, size=along.sum())
    direction[along] = -0.0
    direction[along, axis] = random.choice([-1.0, 1.0], size=along.sum())
    # Along an axis through a sphere, and just beside it: the ray runs in a side of its box.
    origin[along] = np.where(np.arange(3) == axis[:, None], origin[along], centres[target[along]])
    origin[along, (axis + 1) % 3] += radii[target[along]] * random.choice([-1, -0.5, 0, 0.5, 1], size=along.sum())
    direction[np.abs(direction).max(axis=1) == 0] = [0, 0, 1]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    margin = 1e-6 * (np.abs(origin).max(axis=1) + scale)
    rays = (TYPES.Vector3(origin.T), TYPES.Vector3(direction.T), TYPES.Float(margin))
    return tuple(ray + dr.opaque(TYPES.Float, 0) for ray in rays)  # a kernel depends on where NumPy's memory lies


def loop(tree: FilledTree, *arguments: Any) -> Any:
    """What Tree.fold does, over all spheres."""
    _, _, _, _, step, state, going = arguments

    def body(place: Any, *state: Any) -> Any:
        return (place + 1, *step(place, dr.gather(TYPES.Vector4, tree.spheres, place), *state))

    end = len(tree.order)
    return dr.while_loop((TYPES.Index(0), *state), lambda place, *state: (place < end) & going(*state), body)[1:]


def distance(rays: Any, sphere: Any) -> Any:
    """A lower bound of where the ray meets the sphere, infinite where it does not."""
    origin, d, margin = rays
    p = origin - TYPES.Vector3(sphere[0], sphere[1], sphere[2])
    h = dr.dot(p, d)
    off = dr.fma(-h, d, p)
    radius = sphere[3] + margin
    left = dr.fma(radius, radius, -dr.dot(off, off))
    root = dr.sqrt(left)
    t = dr.select(-h - root >= 0, -h - root, root - h)
    return dr.select((left >= 0) & (t >= 0), t, dr.inf)


def approach(rays: Any, centres: NDArray[np.float64], radii: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Rays x spheres: where the ray is closest to the centre, negated, and the square of half its chord."""
    origin, d = (np.array(v).T.astype(float)[:, None] for v in rays[:2])
    p = origin - centres
    h = (p * d).sum(axis=2)
    return h, radii**2 - ((p - h[..., None] * d) ** 2).sum(axis=2)


def nearest(fold: Callable[..., Any], tree: FilledTree, rays: Any, leaving: Any) -> list[NDArray[Any]]:
    def step(place: Any, sphere: Any, best: Any, rival: Any, hit: Any) -> Any:
        t = dr.select(place == leaving, dr.inf, distance(rays, sphere))
        closer = t < best
        rival = dr.select(closer, best, dr.minimum(rival, t))
        return dr.select(closer, t, best), rival, dr.select(closer, place, hit)

    n = len(rays[2])
    state = (dr.full(TYPES.Float, dr.inf, n), dr.full(TYPES.Float, dr.inf, n), dr.full(TYPES.Index, NOTHING, n))
    found = fold(tree, *rays, lambda best, rival, hit: rival, step, state, lambda *_: TYPES.Mask(True))
    dr.eval(found)
    return [number.numpy() for number in found]


def blocked(fold: Callable[..., Any], tree: FilledTree, rays: Any, length: Any) -> NDArray[Any]:
    def step(place: Any, sphere: Any, dark: Any) -> Any:
        return (dark | (distance(rays, sphere) < length),)

    state = (dr.full(TYPES.Mask, False, len(rays[2])),)
    (dark,) = fold(tree, *rays, lambda dark: length, step, state, lambda dark: ~dark)
    result: NDArray[Any] = dark.numpy()
    return result


@pytest.mark.parametrize("count", [0, 1, 2, 3, 17, 1000])
@pytest.mark.parametrize("scene", SCENES)
def test_the_tree_finds_what_a_loop_finds(scene: Callable[..., Spheres], count: int) -> None:
    random = np.random.default_rng(count)
    spheres = scene(random, count)
    tree, rays = FilledTree(TYPES, *spheres), aim(random, spheres)
    left = np.where(random.uniform(size=4096) < 0.5, random.integers(max(1, count), size=4096), NOTHING)
    leaving = TYPES.Index(left.astype(np.uint32))
    found, expected = (nearest(fold, tree, rays, leaving) for fold in (FilledTree.fold, loop))
    np.testing.assert_array_equal(found[0], expected[0])
    np.testing.assert_array_equal(found[1], expected[1])
    clear = found[0] < found[1]  # of two at the same distance either may come first
    np.testing.assert_array_equal(found[2][clear], expected[2][clear])
    if count:
        assert np.isfinite(found[0]).mean() > 0.2
    length = TYPES.Float(random.uniform(0, 2e5 if scene is far_away else 600, 4096).astype(np.float32))
    np.testing.assert_array_equal(blocked(FilledTree.fold, tree, rays, length), blocked(loop, tree, rays, length))


@pytest.mark.parametrize("scene", SCENES)
def test_a_step_may_compute_in_double_precision(scene: Callable[..., Spheres]) -> None:
    random, double = np.random.default_rng(9), array_types("double", "cpu")
    centres, radii = scene(random, 300)
    tree, rays = FilledTree(TYPES, centres, radii), aim(random, (centres, radii))
    origin, d = (double.Vector3(v) for v in rays[:2])
    table = double.Float(np.column_stack([centres, radii])[tree.order].ravel().tolist())

    def step(place: Any, sphere: Any, best: Any) -> Any:
        x, y, z, radius = dr.gather(double.Vector4, table, place)
        p = origin - double.Vector3(x, y, z)
        h = dr.dot(p, d)
        off = dr.fma(-h, d, p)
        left = dr.fma(radius, radius, -dr.dot(off, off))
        t = -h - dr.sqrt(left)
        return (dr.select((left >= 0) & (t >= 0) & (t < best), t, best),)

    def reach(best: Any) -> Any:
        return TYPES.Float(best) * (1 + 1e-6)  # rounded to single precision it must not be less

    state = (dr.full(double.Float, dr.inf, 4096),)
    (best,) = tree.fold(*rays, reach, step, state, lambda best: TYPES.Mask(True))
    h, left = approach(rays, centres, radii)
    with np.errstate(invalid="ignore"):
        t = -h - np.sqrt(left)
    expected = np.where(t >= 0, t, np.inf).min(axis=1)
    # A ray that starts on a sphere or grazes one may meet it or not, as the rounding will have it.
    unclear = (np.abs(t) < 1e-9).any(axis=1) | (np.abs(left) < 1e-6).any(axis=1)
    assert (unclear | np.isclose(best.numpy(), expected, rtol=1e-9, atol=1e-9)).all()
    assert unclear.mean() < 0.5


def test_every_sphere_on_the_way_is_visited_once_and_few_others() -> None:
    random = np.random.default_rng(5)
    centres, radii = cloud(random, 1000)
    tree, rays = FilledTree(TYPES, centres, radii), aim(random, (centres, radii))

    def step(place: Any, sphere: Any, met: Any, visited: Any) -> Any:
        return met + dr.select(distance(rays, sphere) < dr.inf, 1, 0), visited + 1

    state = (dr.zeros(TYPES.Index, 4096), dr.zeros(TYPES.Index, 4096))
    everything = TYPES.Float(dr.inf)
    met, visited = tree.fold(*rays, lambda *_: everything, step, state, lambda *_: TYPES.Mask(True))
    h, left = approach(rays, centres[tree.order], radii[tree.order])
    expected = ((left > 0) & (np.sqrt(np.maximum(left, 0)) > h)).sum(axis=1)
    assert (met.numpy() >= expected).all()
    assert (met.numpy() - expected).mean() < 0.05
    assert visited.numpy().max() <= 1000
    assert visited.numpy().mean() < 250


def test_near_spheres_come_first() -> None:
    random = np.random.default_rng(6)
    centres, radii = cloud(random, 1000)
    tree, rays = FilledTree(TYPES, centres, radii), aim(random, (centres, radii))

    def step(place: Any, sphere: Any, best: Any, visited: Any) -> Any:
        return dr.minimum(best, distance(rays, sphere)), visited + 1

    state = (dr.full(TYPES.Float, dr.inf, 4096), dr.zeros(TYPES.Index, 4096))
    _, visited = tree.fold(*rays, lambda best, _: best, step, state, lambda *_: TYPES.Mask(True))
    assert visited.numpy().mean() < 20


def corners(tree: Tree) -> NDArray[Any]:
    """The boxes of all nodes' children, as rays meet them: nodes x 2 children x 2 corners x 3."""
    node = dr.arange(TYPES.Index, tree.leaves[0])
    numbers = np.array([value.numpy() for value in tree.corners(node, TYPES.Mask(True))], np.float64)
    step, start = (np.array([number[0] for number in numbers]) for numbers in (tree.step, tree.start))
    found: NDArray[Any] = numbers.T.reshape(-1, 2, 2, 3) * step + start
    return found


def test_boxes_are_as_fine_as_spheres_need() -> None:
    kinds = {scene.__name__: Tree(TYPES, *scene(np.random.default_rng(1), 777)).is_coarse for scene in SCENES}
    assert kinds == {name: name not in ("cluster", "large_and_small") for name in kinds}


@pytest.mark.parametrize("scene", SCENES)
def test_every_sphere_is_in_one_leaf_and_in_the_boxes_above_it(scene: Callable[..., Spheres]) -> None:
    centres, radii = scene(np.random.default_rng(1), 777)
    tree = FilledTree(TYPES, centres, radii)
    assert sorted(tree.order) == list(range(777))
    ends, nodes = tree.ends.numpy(), corners(tree)
    assert (ends[0], ends[-1]) == (0, 777)
    assert 0 <= np.diff(ends.astype(int)).min() <= np.diff(ends.astype(int)).max() <= LEAF
    leaves, rounding = len(nodes), tree.extent[0] * ROUNDING / 4
    for leaf in range(leaves):
        inside = tree.order[ends[leaf] : ends[leaf + 1]]
        node = leaves + leaf
        while node > 1:
            box = nodes[node // 2, node % 2]
            assert (box[0] <= centres[inside] - radii[inside, None] + rounding).all()
            assert (box[1] >= centres[inside] + radii[inside, None] - rounding).all()
            node //= 2


def test_the_same_kernel_walks_every_tree() -> None:
    kernels = set()
    for count in (0, 3, 100, 1000):
        random = np.random.default_rng(count)
        spheres = cloud(random, count)
        tree, rays = FilledTree(TYPES, *spheres), aim(random, spheres)
        dr.eval(rays)
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
            dr.kernel_history_clear()
            nearest(FilledTree.fold, tree, rays, dr.opaque(TYPES.Index, NOTHING))
            kernels |= {kernel["hash"] for kernel in dr.kernel_history([dr.KernelType.JIT])}
    assert len(kernels) == 1
