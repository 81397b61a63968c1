"""In what a tracer departs from the `exact` convention."""

from __future__ import annotations

from dataclasses import dataclass

from reference.scene import Triple


@dataclass(frozen=True)
class Rules:
    """In what a tracer departs from the `exact` convention; as they are by default, in nothing.

    `shadow`: blockers count from this share of the way to the light. `reflection`: what mirrors show counts from this
    distance. `grazing`: planes with |d.n| up to this are missed. `ahead`: shadow and mirrored rays start off their
    surface, along its normal, by this times 1 + the largest coordinate of the point as seen from `origin`. `short`:
    blockers that are nearer to the light than this share of the way do not count.

    The others are leeway, within which every outcome is admissible: `precision`: relative error of each point and
    direction. `gap`: what is nearer than this to the start of a secondary ray may count or not. `far`, unless 0: what
    is met at this distance or farther may be missed.
    """

    shadow: float = 0.0
    reflection: float = 0.0
    grazing: float = 0.0
    precision: float = 0.0
    gap: float = 0.0
    far: float = 0.0
    ahead: float = 0.0
    origin: Triple = (0.0, 0.0, 0.0)
    short: float = 0.0

    @property
    def has_leeway(self) -> bool:
        """Whether a pixel's colours are ranges."""
        return bool(self.precision or self.gap or self.far)


EXACT_RULES = Rules()
DOCUMENT_RULES = Rules(shadow=1e-4, reflection=1e-4, grazing=1e-6)
