"""The ray tree behind a pixel, as text for people."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from reference.explanation import Bounce, Certified, Crossing, Explanation

AGREE = 1e-9  # levels


def ray_tree(explanation: Explanation) -> Iterator[str]:
    """Lines that tell the rays in order, every term with its numbers, and the sum."""
    yield f"column {explanation.column}, row {explanation.row}, convention {explanation.convention}"
    for bounce in explanation.bounces:
        yield ""
        yield from _bounce(bounce)
    yield ""
    yield f"sum      {_triple(explanation.colour)}"
    yield f"clamped  {_triple(tuple(min(255.0, max(0.0, value)) for value in explanation.colour))}"
    yield f"8 bit    {' '.join(map(str, explanation.bytes))}"
    if explanation.certified:
        yield f"proof    {_proof(explanation.certified)}"


def _proof(certified: Certified) -> str:
    if certified.proven:
        return "this colour is proven"
    colours = [_triple(colour) for colour in certified.colours]
    others = "" if certified.complete else " or others that could not be found"
    return f"a knife edge, which no precision can decide: {' or '.join(colours)}{others}"


def _bounce(bounce: Bounce) -> Iterator[str]:
    kind = f"bounce {bounce.depth}" if bounce.depth else "camera ray"
    yield f"{kind}, of which {bounce.weight:.6g} reaches the eye"
    yield f"  from     {_triple(bounce.origin)}"
    yield f"  along    {_triple(bounce.direction)}"
    for crossing in bounce.crossings:
        if crossing.distances:
            yield f"  meets    {_crossing(crossing)}"
    if bounce.hit is None:
        yield "  hits     nothing: black"
        return
    yield f"  hits     {bounce.hit} at t = {bounce.t!r}"
    yield f"  point    {_triple(bounce.point)}"
    yield f"  normal   {_triple(bounce.normal)}"
    yield f"  ambient  {_triple(bounce.ambient)}"
    for blocker in bounce.blockers:
        yield f"  shadow   of {_crossing(blocker)}"
    reason = "lit" if bounce.lit else "in shadow" if bounce.cosine else "facing away from the light"
    yield f"  diffuse  {_triple(bounce.diffuse)}  {reason}, n.l = {bounce.cosine:.9g}"
    yield f"  gives    {_triple(bounce.contribution)}  = {bounce.weight:.6g} x (ambient + diffuse)"


def _crossing(crossing: Crossing) -> str:
    distances = ", ".join(f"{t!r}{'' if t in crossing.counted else ' (does not count)'}" for t in crossing.distances)
    return f"{crossing.surface} at t = {distances}"


def parting(one: Explanation, other: Explanation) -> str:
    """One line that tells at which ray two conventions part, and in what."""
    names = f"{one.convention} and {other.convention}"
    for a, b in zip(one.bounces, other.bounces, strict=False):
        if a.hit != b.hit:
            return f"{names} part at ray {a.depth}: it hits {a.hit or 'nothing'} and {b.hit or 'nothing'}"
        if a.lit != b.lit:
            lit, dark = (one, other) if a.lit else (other, one)
            return f"{names} part at ray {a.depth}: it is lit in {lit.convention} and in shadow in {dark.convention}"
        if abs(a.weight - b.weight) > AGREE:
            return f"{names} part at ray {a.depth}: {a.weight:.6g} and {b.weight:.6g} of it reach the eye"
    worst = max(abs(a - b) for a, b in zip(one.colour, other.colour, strict=True))
    return f"{names} follow the same rays; their sums differ by {worst:.3g} levels"


def _triple(values: Sequence[float] | None) -> str:
    return "(" + ", ".join(f"{value:.9g}" for value in values or ()) + ")"
