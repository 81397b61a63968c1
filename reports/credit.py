"""Points by feature, so that one mistake costs what it concerns and no more."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

POINTS = {
    "geometry": 25.0,
    "occlusion": 10.0,
    "ambient": 10.0,
    "diffuse": 15.0,
    "shadows": 15.0,
    "reflections": 20.0,
    "quantisation": 5.0,
}
MEANING = {
    "geometry": "camera, spheres and planes are where they should be",
    "occlusion": "the nearest surface is the one that is seen",
    "ambient": "the ambient term",
    "diffuse": "the diffuse term",
    "shadows": "shadows are where they should be",
    "reflections": "mirrors, up to the depth limit",
    "quantisation": "sums are clamped once, truncated, and saved as they are",
}


@dataclass(frozen=True)
class Credit:
    """What one feature earns over all scenes; `reasons` has a line for each scene that costs points."""

    feature: str
    points: float
    most: float
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class Mark:
    """All credits of a student. `review` says why a person should look, or is empty."""

    credits: tuple[Credit, ...]
    review: str

    @property
    def points(self) -> float:
        """The sum."""
        return round(sum(credit.points for credit in self.credits), 2)

    @property
    def most(self) -> float:
        """What could have been earned."""
        return round(sum(credit.most for credit in self.credits), 2)


def mark(pictures: Sequence[Mapping[str, Any]]) -> Mark:
    """The points for a student's pictures, one a scene, each a record as in grade.json.

    Every feature's points are shared equally by the scenes. In a right picture no feature loses; in a wrong one those
    lose that the named causes concern, or without a cause those where the difference lies; where neither can be told,
    or the picture cannot be read, all lose theirs.
    """
    told = [(picture["scene"], _loses(picture), _why(picture)) for picture in pictures]
    credits_ = []
    for feature, most in POINTS.items():
        reasons = [f"{scene}: {why}" for scene, lost, why in told if feature in lost]
        kept = len(told) - len(reasons)
        credits_.append(Credit(feature, round(most * kept / max(1, len(told)), 2), most, tuple(reasons)))
    return Mark(tuple(credits_), "; ".join(_reviews(pictures)))


def _loses(picture: Mapping[str, Any]) -> tuple[str, ...]:
    """The features that a picture gets no points for."""
    if picture["verdict"] == "right":
        return ()
    if picture["verdict"] != "wrong":
        return tuple(POINTS)
    return tuple(picture["features"]) or tuple(POINTS)


def named(picture: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The likeliest cause of what is wrong with a picture, if there is one that is good enough to be named."""
    return next((cause for cause in picture["causes"] if cause["named"]), None)


def _why(picture: Mapping[str, Any]) -> str:
    if picture["verdict"] == "wrong" and (cause := named(picture)):
        return f"{cause['title']} ({cause['id']}). {cause['hint']}"
    if picture["verdict"] == "wrong" and picture["features"]:
        return f"none of the known mistakes, but the difference lies in its {' and '.join(picture['features'])}"
    return str(picture["reason"])


def _reviews(pictures: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for picture in pictures:
        if picture["status"] == "failed":
            yield f"{picture['scene']} was not graded"
        elif picture["verdict"] == "wrong" and not picture["features"]:
            yield f"{picture['scene']}: what is wrong could not be told, so that no feature has points for it"
