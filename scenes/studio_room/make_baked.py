"""Make baked.glb and ball.glb: the studio room with the light of Cycles in its textures, for renderers that know none.

    blender --background studio_room.blend --python make_baked.py

Needs some five minutes on two processors. What reflects light diffusely is baked: colours finely, the light that falls on
them in fewer texels with many paths each, so that little of its noise is left. The ball, which moves, has its colours
only; esim lights it.
"""
import os
import sys
import tempfile

import bmesh
import bpy
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
HALF_X, HALF_Y, HEIGHT = 2.6, 2.2, 2.7  # as in make_room.py
BEHIND = 0.02  # m: outer faces of the walls, this far behind the inner ones, are invisible

# Names of things begin like this; the last is all that is left. Texels of colour along a side, colour's per light's,
# light paths per texel.
PARTS = {"Shell": (("Floor", "Ceiling", "Wall", "Back wall", "Front wall", "Right wall", "Skirting"), 2048, 4, 96),
         "Carpet": (("Carpet",), 1024, 4, 96),
         "Garden": (("Garden",), 512, 4, 4),
         "Books": (("Bookcase",), 1024, 2, 32),
         "Furniture": (("",), 2048, 4, 64)}


def meshes():
    return [thing for thing in bpy.context.scene.objects if thing.type == "MESH"]


def select(things):
    bpy.ops.object.select_all(action="DESELECT")
    for thing in things:
        thing.select_set(True)
    bpy.context.view_layer.objects.active = things[0]


def unwrap(thing, margin):
    """A layer of texture coordinates of which no two faces share a texel, with such a part of its side between them."""
    layer = thing.data.uv_layers.new(name="baked")
    layer.active = layer.active_render = True
    select([thing])
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(angle_limit=1.15, island_margin=margin)
    bpy.ops.object.mode_set(mode="OBJECT")


def bake(thing, size, samples, **what):
    """size x size x 3, rows from the bottom."""
    image = bpy.data.images.new("bake", size, size, alpha=False, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    nodes = []
    for tree in {material.node_tree for material in thing.data.materials}:
        tree.nodes.active = node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        nodes.append((tree, node))
    select([thing])
    bpy.context.scene.cycles.samples = samples
    # Around a face there is more of the same: not its neighbours, which may be outdoors.
    bpy.ops.object.bake(margin=max(8, size // 64), margin_type="EXTEND", **what)
    pixels = np.empty(size * size * 4, np.float32)
    image.pixels.foreach_get(pixels)
    for tree, node in nodes:
        tree.nodes.remove(node)
    bpy.data.images.remove(image)
    return np.nan_to_num(pixels.reshape(size, size, 4)[:, :, :3], posinf=0, neginf=0)


def softened(light):
    """The mean of a texel and those around, by binomial weights over five."""
    for axis in (0, 1, 0, 1):
        light = 0.25 * np.roll(light, 1, axis) + 0.5 * light + 0.25 * np.roll(light, -1, axis)
    return light


def enlarged(image, times):
    for axis in (0, 1):
        size = image.shape[axis]
        at = (np.arange(size * times) + 0.5) / times - 0.5
        low = np.clip(np.floor(at).astype(int), 0, size - 2)
        share = np.clip(at - low, 0, 1).astype(np.float32)
        share = share[:, None, None] if axis == 0 else share[None, :, None]
        image = (1 - share) * np.take(image, low, axis) + share * np.take(image, low + 1, axis)
    return image


def save_jpeg(pixels, path):
    """Of sRGB values, rows from the bottom."""
    image = bpy.data.images.new("jpeg", pixels.shape[1], pixels.shape[0], alpha=False)
    image.pixels.foreach_set(np.dstack([pixels, np.ones(pixels.shape[:2])]).astype(np.float32).ravel())
    image.file_format, image.filepath_raw = "JPEG", path
    image.save()
    bpy.data.images.remove(image)
    loaded = bpy.data.images.load(path)
    loaded.pack()
    return loaded


def srgb(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(np.maximum(linear, 1e-6), 1 / 2.4) - 0.055)


def export(things, path, normals):
    select(things)
    bpy.ops.export_scene.gltf(filepath=path, export_format="GLB", use_selection=True, export_animations=False, export_extras=True,
                              export_normals=normals)


def export_ball(thing, folder):
    """Its colours without light; its own origin is the file's."""
    thing.parent.location = (0, 0, 0)
    for layer in list(thing.data.uv_layers):
        thing.data.uv_layers.remove(layer)
    unwrap(thing, 0.01)
    colours = bake(thing, 512, 16, type="DIFFUSE", pass_filter={"COLOR"})
    tree = thing.data.materials[0].node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = save_jpeg(srgb(colours), os.path.join(folder, "ball.jpg"))
    tree.links.new(tree.nodes["Principled BSDF"].inputs["Base Color"], texture.outputs["Color"])
    export([thing], os.path.join(HERE, "ball.glb"), normals=True)


def remove_unseen(thing):
    """Faces of the walls that look away from the room."""
    mesh = bmesh.new()
    mesh.from_mesh(thing.data)
    def is_unseen(face):
        x, y, z = thing.matrix_world @ face.calc_center_median()
        return (x > HALF_X + BEHIND or x < -HALF_X - 0.2 + BEHIND / 4 or abs(y) > HALF_Y + BEHIND or z > HEIGHT + BEHIND or
                z < -BEHIND)
    bmesh.ops.delete(mesh, geom=[face for face in mesh.faces if is_unseen(face)], context="FACES")
    mesh.to_mesh(thing.data)
    mesh.free()


def make_plain(thing, graph):
    """Its modifiers applied, and its own coordinates kept as attributes, in which its materials are drawn."""
    if thing.name.startswith(("Bowl: Fruit", "Vase: Bloom")):
        thing.modifiers.new("Fewer", "DECIMATE").ratio = 0.2
    graph.update()
    thing.data = bpy.data.meshes.new_from_object(thing.evaluated_get(graph), preserve_all_data_layers=True, depsgraph=graph)
    thing.modifiers.clear()
    place = np.empty(3 * len(thing.data.vertices), np.float32)
    thing.data.vertices.foreach_get("co", place)
    place = place.reshape(-1, 3)
    low, high = place.min(axis=0), place.max(axis=0)
    for name, values in (("own", place), ("within", (place - low) / np.maximum(high - low, 1e-6))):
        thing.data.attributes.new(name, "FLOAT_VECTOR", "POINT").data.foreach_set("vector", values.ravel())
    thing.data.transform(thing.matrix_world)
    thing.parent = None
    thing.matrix_world.identity()


def draw_in_attributes(material):
    """Instead of in coordinates that joining changes."""
    tree = material.node_tree
    for node in [node for node in tree.nodes if node.bl_idname == "ShaderNodeTexCoord"]:
        for output, name in (("Object", "own"), ("Generated", "within"), ("UV", "UV")):
            for link in list(node.outputs[output].links):
                attribute = tree.nodes.new("ShaderNodeAttribute")
                attribute.attribute_name = name
                tree.links.new(link.to_socket, attribute.outputs["Vector"])


def join(name, things):
    select(things)
    if len(things) > 1:
        bpy.ops.object.join()
    joined = bpy.context.view_layer.objects.active
    joined.name = name
    return joined


def show(thing, radiance, path):
    """Its material is that texture, in whatever light: a colour without a shader is unlit."""
    scale = max(1.0, float(np.quantile(radiance.max(axis=2), 0.9995)))
    material = bpy.data.materials.new("baked_" + thing.name)
    material.use_nodes = True
    material["esim_radiance_scale"] = scale
    tree = material.node_tree
    tree.nodes.clear()
    texture, output = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeOutputMaterial")
    texture.image = save_jpeg(srgb(np.clip(radiance / scale, 0, 1)), path)
    tree.links.new(output.inputs["Surface"], texture.outputs["Color"])
    mesh = thing.data
    mesh.materials.clear()
    mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), np.int32))
    for layer in [layer.name for layer in mesh.uv_layers if layer.name != "baked"]:
        mesh.uv_layers.remove(mesh.uv_layers[layer])
    for attribute in ("own", "within"):
        mesh.attributes.remove(mesh.attributes[attribute])


def main():
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.seed = "CYCLES", "CPU", 1
    quick = "quick" in sys.argv  # to see whether all is well
    ball = bpy.data.objects["Ball"]
    with tempfile.TemporaryDirectory() as folder:
        export_ball(ball.children[0], folder)
        for thing in (*ball.children, ball):
            bpy.data.objects.remove(thing)
        for thing in meshes():
            if thing.name.startswith(PARTS["Shell"][0]):
                remove_unseen(thing)
        graph = bpy.context.evaluated_depsgraph_get()
        for thing in meshes():
            make_plain(thing, graph)
        for material in bpy.data.materials:
            draw_in_attributes(material)
        parts = []
        for name, (beginnings, *_) in PARTS.items():
            joined = {part for part, _, _ in parts}
            parts.append((join(name, [thing for thing in meshes() if thing not in joined and thing.name.startswith(beginnings)]),
                          name, PARTS[name]))
        radiances = []
        for thing, name, (_, size, times, samples) in parts:
            if quick:
                size, samples = size // 4, 4
            unwrap(thing, 0.01 if name == "Shell" else 0.003)  # what is far away, wide apart: its texels are averaged
            colours = bake(thing, size, 4, type="DIFFUSE", pass_filter={"COLOR"})
            light = bake(thing, size // times, samples, type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"})
            glow = bake(thing, size, 1, type="EMIT")
            radiances.append(colours * enlarged(softened(light), times) + glow)
            print("esim baked", name, len(thing.data.polygons), radiances[-1].mean(), flush=True)
        for (thing, name, _), radiance in zip(parts, radiances):
            show(thing, radiance, os.path.join(folder, name + ".jpg"))
        export([thing for thing, _, _ in parts], os.path.join(HERE, "baked.glb"), normals=False)


main()
