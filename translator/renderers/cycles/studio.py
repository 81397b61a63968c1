import math
import sys
import time

if "bpy" not in sys.modules:  # Python runs Blender, whose sound would complain at length about a recent NumPy
    sys.modules["numpy"] = None  # type: ignore[assignment]

import bpy

UNIT = 2.0**-7  # what a length of 1 becomes
LIGHT = (500, 500, 500)
SCREEN_DISTANCE = 100  # from the eye, and the screen's width
SMALLEST, LARGEST = 2.0**7, 2.0**30  # half the sides of the first and the last square of a plane
TURN = 0.37  # radians, so that the squares' edges are along no row of pixels


def in_blender(x, y, z):
    """A point of the assignment, whose y is up and z into the scene. Blender's z is up."""
    return (x * UNIT, z * UNIT, y * UNIT)


def link(thing):
    """Put an object into the scene."""
    bpy.context.scene.collection.objects.link(thing)
    return thing


def studio(width, height, bounces, threads):
    """An empty scene with the settings, the camera, the light, and a view layer for each number of bounces."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = max(1, height / width), max(1, width / height)
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    scene.render.dither_intensity = 0
    scene.render.filepath = sys.argv[-1] if sys.argv[-1].endswith(".exr") else "scene.exr"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.color_depth = "32"
    scene.view_settings.view_transform = "Raw"

    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = 1  # at the middle of the pixel
    cycles.filter_width = 0.01
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_auto_tile = False
    cycles.max_bounces = cycles.glossy_bounces = bounces
    cycles.diffuse_bounces = cycles.transmission_bounces = 0
    cycles.min_light_bounces = 1024  # no path ends by chance
    cycles.blur_glossy = cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0

    eye = bpy.data.cameras.new("eye")
    eye.sensor_fit, eye.sensor_width, eye.lens = "HORIZONTAL", 36, 36
    eye.clip_start, eye.clip_end = SCREEN_DISTANCE * UNIT, 2 * LARGEST * UNIT
    scene.camera = link(bpy.data.objects.new("eye", eye))
    scene.camera.rotation_euler.x = math.pi / 2

    light = bpy.data.lights.new("light", "POINT")
    light.shadow_soft_size = 0
    light.energy = 4 * math.pi**2  # watts: what is diffuse and faces the light has its own colour
    light.use_nodes = True
    falloff = light.node_tree.nodes.new("ShaderNodeLightFalloff")
    falloff.inputs["Strength"].default_value = 1
    emission = light.node_tree.nodes["Emission"]
    light.node_tree.links.new(falloff.outputs["Constant"], emission.inputs["Strength"])
    link(bpy.data.objects.new("light", light)).location = in_blender(*LIGHT)

    scene.view_layers[0].name = "0 bounces"
    for count in range(1, bounces + 1):
        scene.view_layers.new(f"{count} bounces")
    for count, layer in enumerate(scene.view_layers):
        layer["bounces"] = float(count)
    scene.compositing_node_group = sum_of(scene)


def sum_of(scene):
    """A compositor that adds up the view layers."""
    tree = bpy.data.node_groups.new("sum of the view layers", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    total = None
    for layer in scene.view_layers:
        picture = tree.nodes.new("CompositorNodeRLayers")
        picture.scene, picture.layer = scene, layer.name
        if total is None:
            total = picture.outputs["Image"]
            continue
        add = tree.nodes.new("ShaderNodeMix")
        add.data_type, add.blend_type = "RGBA", "ADD"
        factor, *_, one, two = (socket for socket in add.inputs if socket.enabled)
        factor.default_value = 1
        tree.links.new(total, one)
        tree.links.new(picture.outputs["Image"], two)
        total = next(socket for socket in add.outputs if socket.enabled)
    tree.links.new(total, tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


def material(name, emitted, diffuse, reflection):
    """A mirror to rays that have fewer bounces to go than the view layer counts; then what emits and is diffuse.

    So every ray goes one way only, where a sum of both would choose one by chance. The light that reaches the side of
    the normal is seen from both sides: through it as if it were translucent.
    """
    made = bpy.data.materials.new(name)
    made.cycles.emission_sampling = "NONE"
    tree = made.node_tree
    tree.nodes.clear()

    def node(kind, *inputs, **settings):
        """The outputs of a new node; an input is a value or the output of another node."""
        created = tree.nodes.new(f"ShaderNode{kind}")
        for key, value in settings.items():
            setattr(created, key, value)
        for socket, value in zip(created.inputs, inputs, strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                tree.links.new(value, socket)
            else:
                socket.default_value = value
        return created.outputs

    done = node("LightPath")["Ray Depth"]
    bounces = node("Attribute", attribute_type="VIEW_LAYER", attribute_name="bounces")["Fac"]
    last = node("Math", done, bounces, 0.5, operation="COMPARE")[0]
    earlier = node("Math", done, bounces, operation="LESS_THAN")[0]
    behind = node("NewGeometry")["Backfacing"]
    lit = node("MixShader", behind, node("BsdfDiffuse", diffuse, 0)[0], node("BsdfTranslucent", diffuse)[0])[0]
    local = node("AddShader", node("Emission", emitted, last)[0], lit)[0]
    mirror = node("BsdfGlossy", (reflection, reflection, reflection, 1), 0, distribution="GGX")[0]
    node("OutputMaterial", node("MixShader", earlier, local, mirror)[0])
    return made


def sphere(name, centre, radius, **look):
    """A point with a radius, which Cycles draws as a true sphere."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    point, paint = tree.nodes.new("GeometryNodePoints"), tree.nodes.new("GeometryNodeSetMaterial")
    point.inputs["Radius"].default_value = radius * UNIT
    paint.inputs["Material"].default_value = material(name, **look)
    tree.links.new(point.outputs[0], paint.inputs[0])
    tree.links.new(paint.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    thing = link(bpy.data.objects.new(name, bpy.data.meshes.new(name)))
    thing.location = in_blender(*centre)
    thing.modifiers.new("sphere", "NODES").node_group = tree


def plane(name, foot, across, along, seen=True, shadow=True, **look):
    """Squares around the foot of the perpendicular from the eye, each twice as large as the one inside it.

    Each is as precise as it is large. `across`, `along` and the plane's normal are a right-handed basis. A plane that
    holds the eye or is the screen is not `seen` by the camera, one that holds the light casts no `shadow`.
    """
    turned = [
        (math.cos(TURN) * u + math.sin(TURN) * v, math.cos(TURN) * v - math.sin(TURN) * u)
        for u, v in zip(across, along, strict=True)
    ]
    corners, faces = [], [(0, 1, 2, 3)]
    size = SMALLEST
    while size <= LARGEST:
        for a, b in ((-size, -size), (-size, size), (size, size), (size, -size)):
            corners.append(in_blender(*(f + a * u + b * v for f, (u, v) in zip(foot, turned, strict=True))))
        size *= 2
    for inner in range(0, len(corners) - 4, 4):
        faces += [(inner + i, inner + 4 + i, inner + 4 + (i + 1) % 4, inner + (i + 1) % 4) for i in range(4)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(material(name, **look))
    thing = link(bpy.data.objects.new(name, mesh))
    thing.visible_camera, thing.visible_shadow = seen, shadow


def render():
    """Draw the picture, unless Blender has a window: there F12 does."""
    if bpy.app.background:
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        print(f"traced in {time.perf_counter() - start:.4f} s")
