"""Surfaces, as they glow in the picture of ambient light and as the lamp lights them."""

from __future__ import annotations

from reference.scene import Plane, Sphere
from translator.contract import number, spaced
from translator.renderers.mitsuba_stock.elements import constant, matrix, moved
from translator.renderers.mitsuba_stock.falloff import undo_falloff
from translator.renderers.mitsuba_stock.limits import ORIGIN, PLANE_RADIUS, is_lit, is_seen_from_back

MIRROR_SHARE = 1 - 2.0**-23  # of the blended BSDF: the rest is the smallest share that float32 keeps apart
DIMMED = 2.0**-60  # the diffuse reflectance, and the lamp is as much brighter: mirrored light then finds it black

GLOWING = """
  <shape type="{shape}" id="{name}">
    {geometry}
    {mirror}
    <emitter type="area">{ambient}</emitter>
  </shape>
"""

LIT = """
  <shape type="{shape}" id="{name}">
    {geometry}
    <bsdf type="blendbsdf">
      <float name="weight" value="{share}"/>
      {diffuse}
      {mirror}
    </bsdf>
  </shape>
"""


def glowing_shape(name: str, surface: Sphere | Plane, ambient: list[float]) -> str:
    """A surface for the picture of ambient light."""
    light = [value / 255 * share for value, share in zip(surface.colour, ambient, strict=True)]
    return GLOWING.format(
        shape=_shape(surface),
        name=name.replace(" ", "-"),
        geometry=_geometry(surface),
        mirror=_mirror(surface.reflection),
        ambient=constant("radiance", light),
    )


def lit_shape(name: str, surface: Sphere | Plane) -> str:
    """A surface for the picture of the lamp's light."""
    scale = surface.diffuse / 255 * DIMMED / (1 - MIRROR_SHARE) if is_lit(surface) else 0.0
    colour = [value * scale for value in surface.colour]
    return LIT.format(
        shape=_shape(surface),
        name=name.replace(" ", "-"),
        geometry=_geometry(surface),
        share=MIRROR_SHARE,
        diffuse="\n      ".join(undo_falloff(surface, colour)),
        mirror=_mirror(surface.reflection / MIRROR_SHARE),
    )


def _mirror(reflection: float) -> str:
    reflectance = constant("specular_reflectance", [reflection] * 3)
    return f'<bsdf type="conductor"><string name="material" value="none"/>{reflectance}</bsdf>'


def _shape(surface: Sphere | Plane) -> str:
    return "sphere" if isinstance(surface, Sphere) else "disk"


def _geometry(surface: Sphere | Plane) -> str:
    flipped = "true" if is_seen_from_back(surface) else "false"
    flip = f'<boolean name="flip_normals" value="{flipped}"/>'
    if isinstance(surface, Sphere):
        centre = f'<point name="center" value="{spaced(moved(surface.centre))}"/>'
        return f'{centre}\n    <float name="radius" value="{number(surface.radius)}"/>\n    {flip}'
    normal, offset = surface.unit_normal, surface.distance_from(ORIGIN)
    widened = [[PLANE_RADIUS * value for value in axis] for axis in surface.tangents]
    return f"{matrix([*widened, normal], [value * offset + 0.0 for value in normal])}\n    {flip}"  # never -0.0
