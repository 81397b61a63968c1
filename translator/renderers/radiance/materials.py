"""The layers of the picture: each has the surfaces' materials under one light, and the lamp if that is its light."""

from __future__ import annotations

from reference.scene import LIGHT, Scene
from translator.contract import number, single
from translator.renderers.radiance.faces import Face, spaced
from translator.renderers.radiance.limits import Surfaces, height_of_light, lamp_radius

LIGHT_LAYER = """\
# What the lamp adds. Diffuse colours are the surface's / 255 * its diffuse coefficient: by reflection on the side of
# the given normal, by transmission on the other one; black where the lamp is not on the side of the given normal.
"""

LAMP = """
# A point light without falloff. Only shadow rays see an illum, so that its radius does not matter: they go Ts to its
# surface, and (Ts + radius)^2 undoes the falloff.
void brightfunc nofall
2 (Ts+{radius})*(Ts+{radius}) .
0
0

nofall illum light
1 void
0
3 {radiance} {radiance} {radiance}

light sphere lamp
0
0
4 {centre}  {radius}
"""

AMBIENT_LAYER = """\
# What ambient light adds, with -av 1 1 1. Diffuse colours are the surface's / 255 * the ambient colour * the ambient
# coefficient / 256.
"""

NEGATIVE = """\
# To be subtracted: the colours are the surfaces' negative ones, without the sign.
"""

MATERIALS = """
# A BRTDfunc has what it mirrors (3), what it lets pass (3), its highlights (3), the file of its functions; then diffuse
# reflection of the front, of the back, diffuse transmission. A side that cannot be seen has no material: a ray from
# there (Rdot < 0) has met the surface that it leaves, by rounding, and passes. Of surfaces that tie, Radiance shows the
# one whose material is defined last: the first in the scene file comes last.
"""

MATERIAL = """
void BRTDfunc {name}
10 {mirror} {mirror} {mirror}
   {passes} {passes} {passes}
   0 0 0  .
0
9 {front}
  {back}
  {through}
"""

Colours = dict[str, list[float]]  # diffuse, linear, by the name of the surface


def layers_of(scene: Scene, surfaces: Surfaces) -> dict[str, Colours]:
    """The colours for each picture that is added, without negative ones, which make pictures that are subtracted."""
    ambient = [value * scene.ambient_coefficient / 256 for value in scene.ambient]
    layers: dict[str, Colours] = {"light": {}, "ambient": {}}
    for name, surface in surfaces.items():
        diffuse = surface.diffuse if height_of_light(surface) > 0 else 0.0
        layers["light"][name] = [level / 255 * diffuse for level in surface.colour]
        layers["ambient"][name] = [level / 255 * a for level, a in zip(surface.colour, ambient, strict=True)]
    for layer, colours in list(layers.items()):
        negative = {name: [max(0.0, -value) for value in colour] for name, colour in colours.items()}
        layers[layer] = {name: [max(0.0, value) for value in colour] for name, colour in colours.items()}
        if any(map(any, negative.values())):
            layers[f"{layer}-negative"] = negative
    return layers


def lamp(surfaces: Surfaces, unit: float) -> str:
    """The light, as large as the surfaces allow; `unit` is what a length of 1 becomes."""
    radius = unit * lamp_radius(surfaces)
    return LAMP.format(radius=number(radius), radiance=number(1 / radius**2), centre=spaced(LIGHT, unit))


def layer_file(layer: str, colours: Colours, faces: list[Face], light: str, mirrors: bool) -> str:
    """What comes before the surfaces; `light` is the lamp, `mirrors` whether surfaces mirror at all."""
    is_light = layer.startswith("light")
    start = [LIGHT_LAYER if is_light else AMBIENT_LAYER, NEGATIVE * is_subtracted(layer), light * is_light]
    materials = [_material(face, colours[face.name], is_light, mirrors) for face in reversed(faces)]
    return "".join([*start, MATERIALS, *materials])


def is_subtracted(layer: str) -> bool:
    """Whether the layer of that name is that of negative colours."""
    return layer.endswith("-negative")


def _material(face: Face, colour: list[float], is_light: bool, mirrors: bool) -> str:
    diffuse, nothing = " ".join(map(single, colour)), "0 0 0"
    mirror = single(face.surface.reflection) if mirrors else "0"
    return MATERIAL.format(
        name=face.material,
        mirror=mirror if face.is_double else f"if(Rdot,{mirror},0)",
        passes="0" if face.is_double else "if(Rdot,0,1)",
        front=diffuse if face.is_given or not is_light else nothing,
        back=diffuse if face.is_double and not is_light else nothing,
        through=diffuse if is_light and (face.is_double or not face.is_given) else nothing,
    )
