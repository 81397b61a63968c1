"""Prove the gate: harmless pictures pass, mistakes are caught and named. Writes docs/power.md: `make prove`.

    python tests/benchmarks/prove.py [SCENE ...] [--side 400] [--pairs 10] [--docs docs]

Every known mistake is planted in every scene that shows it; the same pictures are judged by the rules that people use.
"""

from __future__ import annotations

import argparse
import io
import multiprocessing
import random
import sys
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from reference import Scene
from reference.device import load_drjit
from reference.image import quantise
from reference.mistakes import MISTAKES, Mistake, combine
from reference.model import DOCUMENT
from reference.slips import draw
from reference.world import View
from reports.diagnosis import diagnose
from reports.envelope import envelope
from reports.gradebook import usable_cores
from reports.lookalike import look_again
from reports.submission import Facts, Submission
from reports.suspects import Suspects
from reports.verdict import judge

ROOT = Path(__file__).resolve().parent.parent.parent
SHOWN = 5e-4  # of the pixels that must be off by more than 8 levels for a mistake to be asked for
VISIBLE = 8  # levels
SPECKLED = 0.25  # of the pixels that a mistake which comes and goes may spoil are spoilt
PNG = Facts("PNG", 8, "RGB")
DEEP = Facts("PNG", 16, "RGB")
QUALITIES = (60, 75, 85, 95)
SUBSAMPLINGS = {"4:4:4": 0, "4:2:0": 2}
SIDES = (500, 2000)  # pixels, of harmless pictures of other sizes
TITLES = {
    "harmless": "harmless: should pass",
    "sizes": "harmless, of other sizes: should pass",
    "mistakes": "one mistake, PNG: should not",
    "mistakes, JPEG": "one mistake, JPEG 85 4:2:0: should not",
    "rounding": "at most one level off: should, as rounding",
    "pairs": "two mistakes, PNG: should not; both named",
    "pairs, JPEG": "two mistakes, JPEG 85 4:2:0: should not; both named",
}
Pixels = NDArray[np.uint8]


@dataclass
class Tally:
    """What became of the pictures of one kind: how many passed, were caught, named first and among the first three."""

    pictures: int = 0
    passed: int = 0
    first: int = 0
    three: int = 0
    failed: list[str] = field(default_factory=list)
    rules: dict[str, int] = field(default_factory=dict)  # how many passed by other rules

    def add(self, other: Tally) -> None:
        """Count another's pictures, too."""
        self.pictures, self.passed = self.pictures + other.pictures, self.passed + other.passed
        self.first, self.three = self.first + other.first, self.three + other.three
        self.failed += other.failed
        for rule, good in other.rules.items():
            self.rules[rule] = self.rules.get(rule, 0) + good


def scenes() -> dict[str, Scene]:
    """The examples and the diagnostic scenes by name."""
    paths = [*sorted((ROOT / "scenes").glob("example?.txt")), *sorted((ROOT / "scenes/diagnostic").glob("*.txt"))]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return {path.stem: Scene.load(path) for path in paths}


def png(pixels: Pixels) -> Submission:
    """As from a PNG of 8 bits."""
    return Submission(pixels.astype(np.float32), PNG)


def jpeg(pixels: Pixels, quality: int, subsampling: str) -> Submission:
    """Once through a JPEG."""
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "JPEG", quality=quality, subsampling=SUBSAMPLINGS[subsampling])
    image = Image.open(data)
    tables: Any = getattr(image, "quantization", {})
    facts = Facts("JPEG", 8, "RGB", tuple(tuple(tables[key]) for key in sorted(tables)), subsampling)
    return Submission(np.asarray(image.convert("RGB"), np.float32), facts)


def harmless(scene: Scene, view: View, *, few: bool = False) -> Iterator[tuple[str, Submission]]:
    """Right pictures as other programs make them; or a `few` of them."""
    side = view.width
    samples = np.clip(draw(scene, DOCUMENT, View(4 * side, 4 * view.height, view.depth)), 0, 255)
    samples = samples.reshape(view.height, 4, side, 4, 3)
    pick = np.random.default_rng(7)
    at = pick.integers(0, 4, (2, view.height, side))
    rows, columns = np.indices((view.height, side))
    centre = np.clip(draw(scene, DOCUMENT, view), 0, 255)
    some = [samples[rows, pick.integers(0, 4, rows.shape), columns, pick.integers(0, 4, rows.shape)] for _ in range(16)]
    kinds = {
        "truncated": centre,
        "rounded": np.rint(centre),
        "4 x 4 samples": samples.mean(axis=(1, 3)),
        "16 random samples": np.mean(some, axis=0),
        "jittered": samples[rows, at[0], columns, at[1]],
        "single precision": centre * np.float32(1 + 2e-7),
    }
    for kind, levels in kinds.items():
        yield kind, png(quantise(levels))
        for quality in QUALITIES[:1] if few else QUALITIES:
            for subsampling in ("4:2:0",) if few else SUBSAMPLINGS:
                yield f"{kind}, JPEG {quality} {subsampling}", jpeg(quantise(levels), quality, subsampling)
    yield "16 bit", Submission((np.floor(centre * 257) / 257).astype(np.float32), DEEP)


def other_rules(right: Pixels, found: NDArray[Any]) -> dict[str, bool]:
    """Whether SSIM, FLIP and idiff let a picture pass, with usual limits."""
    import flip_evaluator
    from skimage.metrics import structural_similarity

    a, b = right.astype(np.float32) / 255, np.asarray(found, np.float32) / 255
    ssim = structural_similarity(
        a, b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1.0, channel_axis=-1
    )
    flip = flip_evaluator.evaluate(np.ascontiguousarray(a), np.ascontiguousarray(b), "LDR", applyMagma=False)[1]
    error = np.abs(a - b).max(axis=-1)
    idiff = np.mean(error > 0.004) <= 0.1 and error.max() <= 0.1  # of Open Shading Language's tests
    return {"SSIM >= .99": ssim >= 0.99, "FLIP <= .02": flip <= 0.02, "idiff": bool(idiff)}


def other_sizes(scene: Scene, depth: int, side: int, tally: Tally, name: str) -> None:
    """Judge right pictures of one scene at another size."""
    view = View(side, side, depth)
    bounds, suspects = envelope(scene, side, side, depth), cache(lambda: Suspects(scene, view))
    for kind, picture in harmless(scene, view, few=True):
        tally.pictures += 1
        if look_again(judge(bounds, picture), suspects, picture).right:
            tally.passed += 1
        else:
            tally.failed.append(f"{name}: {side} x {side}, {kind}")


def prove(
    names: list[str],
    side: int,
    pairs: int,
    say: Callable[[str], None] = lambda text: None,
    sides: tuple[int, ...] = SIDES,
) -> dict[str, Tally]:
    """The tally of harmless pictures, of mistakes, of those of rounding, and of pairs, over some scenes.

    Scenes are shared among processes, one for each core.
    """
    tallies = {kind: Tally() for kind in TITLES}
    spawn = multiprocessing.get_context("spawn")  # Dr.Jit does not survive a fork
    with ProcessPoolExecutor(min(usable_cores(), len(names)), spawn, load_alone) as pool:
        of_scenes = pool.map(prove_scene, names, repeat(side), repeat(pairs), repeat(sides))
        for name, found in zip(names, of_scenes, strict=True):
            say(name)
            for kind, tally in found.items():
                tallies[kind].add(tally)
    return tallies


def load_alone() -> None:
    """Each process computes on one core."""
    load_drjit().set_thread_count(1)


def prove_scene(name: str, side: int, pairs: int, sides: tuple[int, ...]) -> dict[str, Tally]:
    """The tallies of one scene."""
    tallies = {kind: Tally() for kind in TITLES}
    scene, view = scenes()[name], View(side, side, 3)
    bounds, suspects = envelope(scene, side, side), Suspects(scene, view)
    right = quantise(draw(scene, DOCUMENT, view))

    def passes(kind: str, title: str, picture: Submission) -> bool:
        tally = tallies[kind]
        tally.pictures += 1
        for rule, good in other_rules(right, picture.levels).items():
            tally.rules[rule] = tally.rules.get(rule, 0) + good
        good = look_again(judge(bounds, picture), lambda: suspects, picture).right
        tally.passed += good
        if good != kind.startswith(("harmless", "rounding")):
            tally.failed.append(f"{name}: {title} {'passed' if good else 'failed'}")
        return good

    def name_causes(kind: str, keys: list[str], pixels: Pixels) -> None:
        for form, picture in ((kind, png(pixels)), (f"{kind}, JPEG", jpeg(pixels, 85, "4:2:0"))):
            if not passes(form, " and ".join(keys), picture):
                _count(tallies[form], name, keys, suspects, picture)

    for kind, picture in harmless(scene, view):
        passes("harmless", kind, picture)
    for length in sides:
        other_sizes(scene, view.depth, length, tallies["sizes"], name)
    seen = []
    for key, mistake in MISTAKES.items():
        pixels = quantise(planted(scene, view, mistake))
        off = np.abs(pixels.astype(int) - right).max(axis=-1)
        if mistake.rounding and off.max() == 1:
            passes("rounding", key, png(pixels))
        if np.mean(off > VISIBLE) > SHOWN:
            seen.append(key)
            name_causes("mistakes", [key], pixels)
    for one, other, pixels in planted_pairs(scene, view, seen, right, pairs, name):
        name_causes("pairs", [one, other], pixels)
    return tallies


def planted(scene: Scene, view: View, mistake: Mistake) -> NDArray[Any]:
    """The picture of a mistake; one that comes and goes spoils a pixel in four."""
    made = mistake.draw(scene, view)
    if not mistake.speckled:
        return made
    by_chance = np.random.default_rng(11).random((view.height, view.width, 1)) < SPECKLED
    return np.where(by_chance, made, draw(scene, DOCUMENT, view))


def planted_pairs(
    scene: Scene, view: View, keys: list[str], right: Pixels, number: int, name: str
) -> Iterator[tuple[str, str, Pixels]]:
    """Pictures of two mistakes, each of which shows beside the other."""
    pick, found = random.Random(name), 0
    for _ in range(20 * number):
        if found == number or len(keys) < 2:
            return
        one, other = pick.sample(keys, 2)
        both = combine(MISTAKES[one], MISTAKES[other])
        if both is None or both.speckled or one.partition("/")[0] == other.partition("/")[0]:
            continue
        pixels = quantise(both.draw(scene, view))
        alone = [quantise(MISTAKES[key].draw(scene, view)).astype(int) for key in (one, other)]
        if all(np.mean(np.abs(pixels - single).max(axis=-1) > VISIBLE) > 0.005 for single in alone):
            found += 1
            yield one, other, pixels


def _count(tally: Tally, name: str, keys: list[str], suspects: Suspects, picture: Submission) -> None:
    causes = diagnose(suspects, picture.levels, picture.facts)
    true = {key.partition("/")[0] for key in keys}
    ids = [set(cause.id.split("+")) for cause in causes]
    tally.first += bool(ids) and true <= ids[0] and len(ids[0]) == len(true)
    within = true <= set().union(*ids[:3]) if len(true) > 1 else any(true == one for one in ids[:3])
    tally.three += within
    if not within:
        tally.failed.append(f"{name}: {' and '.join(keys)}: {', '.join(cause.id for cause in causes[:3]) or 'nothing'}")


def page(tallies: dict[str, Tally], names: list[str], side: int, sides: tuple[int, ...] = SIDES) -> str:
    """docs/power.md."""

    def share(part: int, whole: int) -> str:
        return f"{part} of {whole} ({part / whole:.1%})".replace("%", " %") if whole else "none"

    rules = list(next(iter(tallies.values())).rules)
    lines = [
        "# How well wrong pictures are told from right ones\n",
        f"Written by `make prove`: {len(names)} scenes ({', '.join(names)}) at {side} x {side}."
        " Every mistake of the bank is planted in every scene in which it puts more than 0.05 % of the pixels off by"
        f" more than {VISIBLE} levels. The pictures are made by crossray's own tracer. Other sizes are"
        f" {' and '.join(map(str, sides))} pixels a side.\n",
        "| pictures | pass | " + " | ".join(rules) + " | cause first | in the first three |",
        "|---|---|" + "---|" * (len(rules) + 2),
    ]
    for kind, tally in tallies.items():
        named = kind.startswith(("mistakes", "pairs"))
        cells = [TITLES[kind], share(tally.passed, tally.pictures)]
        cells += [share(tally.rules[rule], tally.pictures) if tally.rules else "" for rule in rules]
        cells += [share(part, tally.pictures) if named else "" for part in (tally.first, tally.three)]
        lines.append(f"| {' | '.join(cells)} |")
    for kind, tally in tallies.items():
        if tally.failed:
            lines += ["", f"## Not as it should be: {TITLES[kind].partition(': should')[0]}", ""]
            lines += [f"- {text}" for text in tally.failed]
    lines += [
        "",
        "SSIM after Wang (Gaussian, sigma 1.5), its mean; FLIP at 67 pixels a degree, its mean; idiff as in Open"
        " Shading Language's tests: 10 % of pixels over .004, none over .1.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="names; all by default")
    parser.add_argument("--side", type=int, default=250, help="pixels")
    parser.add_argument("--pairs", type=int, default=6, help="pairs of mistakes a scene")
    parser.add_argument("--docs", type=Path, default=ROOT / "docs")
    options = parser.parse_args()
    names = options.scenes or list(scenes())
    tallies = prove(names, options.side, options.pairs, lambda text: print(text, file=sys.stderr, flush=True))
    text = page(tallies, names, options.side)
    (options.docs / "power.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
