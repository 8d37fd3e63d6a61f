# Bakes the radiance of a scene's surfaces into textures, and writes the scene as GLB with unlit materials.
# Arguments: the scene, the GLB, light paths per texel, largest side of a texture.
import sys
import tempfile

import numpy as np

LARGEST_AREA = 64.0  # m²; a surface of this area, or the largest of a smaller scene, gets a texture of the maximum size


def area_of(thing):
    scale = np.abs(thing.matrix_world.determinant()) ** (2 / 3)
    return sum(polygon.area for polygon in thing.data.polygons) * scale


def make_real(thing):
    """Gives an object its own mesh with modifiers applied, and at least one material slot."""
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(thing.evaluated_get(graph), preserve_all_data_layers=True, depsgraph=graph)
    thing.modifiers.clear()
    thing.data = mesh
    if not mesh.materials:
        mesh.materials.append(bpy.data.materials.new("grey"))
    for slot in range(len(mesh.materials)):
        if mesh.materials[slot] is None:
            mesh.materials[slot] = bpy.data.materials.new("grey")
        # A separate copy, so that baking can add a node to it.
        mesh.materials[slot] = mesh.materials[slot].copy()
        mesh.materials[slot].use_nodes = True


def select(thing):
    for other in bpy.context.view_layer.objects:
        other.select_set(other is thing)
    bpy.context.view_layer.objects.active = thing


def unwrap(thing):
    """Adds texture coordinates with which no two triangles share a texel; the materials keep using the old ones."""
    for material in thing.data.materials:
        pin_coordinates(material, thing.data)
    layer = thing.data.uv_layers.new(name="esim_bake", do_init=False)
    if layer is None:
        raise RuntimeError(f"Error: object {thing.name}: has too many UV maps; remove some")
    thing.data.uv_layers.active = layer
    layer.active_render = True
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(angle_limit=1.15, island_margin=0.005)
    bpy.ops.object.mode_set(mode="OBJECT")


def pin_coordinates(material, mesh):
    """Textures without explicit coordinates use the layer that is active for rendering; this keeps the current one."""
    before = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
    if before is None:
        return
    tree = material.node_tree
    for node in list(tree.nodes):
        if node.bl_idname == "ShaderNodeTexImage" and not node.inputs["Vector"].is_linked:
            coordinates = tree.nodes.new("ShaderNodeUVMap")
            coordinates.uv_map = before
            tree.links.new(node.inputs["Vector"], coordinates.outputs["UV"])
        if node.bl_idname == "ShaderNodeTexCoord":
            for link in list(node.outputs["UV"].links):
                coordinates = tree.nodes.new("ShaderNodeUVMap")
                coordinates.uv_map = before
                tree.links.new(link.to_socket, coordinates.outputs["UV"])


def bake(thing, size, samples):
    """Returns the radiance of the surface's front as size x size texels, rows from the top."""
    image = bpy.data.images.new("bake_" + thing.name, size, size, alpha=False, float_buffer=True)
    nodes = []
    for material in thing.data.materials:
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.nodes.active = node
        nodes.append((material.node_tree.nodes, node))
    select(thing)
    bpy.context.scene.cycles.samples = samples
    bpy.ops.object.bake(type="COMBINED", margin=max(4, size // 64), use_clear=True)
    pixels = np.empty(size * size * 4, np.float32)
    image.pixels.foreach_get(pixels)
    for owner, node in nodes:
        owner.remove(node)
    bpy.data.images.remove(image)
    return np.nan_to_num(pixels.reshape(size, size, 4)[::-1, :, :3], posinf=0, neginf=0)


def radiance_of_faces(thing, radiance):
    """Returns the radiance at the centre of each face."""
    uv = thing.data.uv_layers["esim_bake"].data
    size = radiance.shape[0]
    result = []
    for polygon in thing.data.polygons:
        u, v = np.mean([uv[loop].uv for loop in polygon.loop_indices], axis=0)
        row, column = (1 - v) * size, u * size
        result.append(radiance[int(np.clip(row, 0, size - 1)), int(np.clip(column, 0, size - 1))].mean())
    return np.array(result)


def turn_to_light(thing):
    """Flips faces whose back is much brighter: only fronts are baked, but rooms often show the backs of their faces."""
    size, samples = 128, 4
    front = radiance_of_faces(thing, bake(thing, size, samples))
    thing.data.flip_normals()
    back = radiance_of_faces(thing, bake(thing, size, samples))
    thing.data.flip_normals()
    turn = back > 2 * front + 1e-4
    if not turn.any():
        return
    select(thing)
    if thing.data.has_custom_normals:
        bpy.ops.mesh.customdata_custom_splitnormals_clear()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    thing.data.polygons.foreach_set("select", turn)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.flip_normals()
    bpy.ops.object.mode_set(mode="OBJECT")


def radiance_scale(radiance):
    """Returns the radiance of the texture's white: 1, or more if the surface is brighter (except for a few sparks)."""
    bright = float(np.quantile(radiance.max(axis=2), 0.9995))
    return max(1.0, bright)


def show_baked(thing, radiance, folder, number):
    """Replaces the materials by an unlit one, which is a texture's colour without a shader."""
    scale = radiance_scale(radiance)
    path = f"{folder}/{number}.png"
    with open(path, "wb") as file:
        file.write(esim_png(np.round(esim_srgb(radiance / scale) * 65535).astype(np.uint16)))
    image = bpy.data.images.load(path)
    image.pack()
    material = bpy.data.materials.new("baked_" + thing.name)
    material.use_nodes = True
    material["esim_radiance_scale"] = scale
    tree = material.node_tree
    tree.nodes.clear()
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(output.inputs["Surface"], texture.outputs["Color"])
    mesh = thing.data
    mesh.materials.clear()
    mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), np.int32))
    for layer in [layer.name for layer in mesh.uv_layers if layer.name != "esim_bake"]:
        mesh.uv_layers.remove(mesh.uv_layers[layer])


source, target, samples, largest = sys.argv[sys.argv.index("--") + 1:][:4]
samples, largest = int(samples), int(largest)
esim_progress(0.0, "opening the scene")
esim_open(source)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.use_denoising = False
scene.cycles.bake_type = "COMBINED"
scene.render.bake.use_selected_to_active = False

for instance in [thing for thing in scene.objects if thing.instance_type != "NONE"]:
    esim_warn(f"object {instance.name}: its instances are not baked")
things = [thing for thing in scene.objects
          if thing.type == "MESH" and not thing.hide_render and thing.visible_get() and len(thing.data.polygons) > 0]
if not things:
    raise RuntimeError("Error: the scene has no meshes to bake")
lights = any(thing.type == "LIGHT" for thing in scene.objects)
world = scene.world is not None
if not lights and not world:
    esim_warn("the scene has no light: only surfaces that emit light will be visible")

for thing in things:
    make_real(thing)
for thing in things:
    select(thing)
    unwrap(thing)
areas = [area_of(thing) for thing in things]
reference = min(LARGEST_AREA, max(areas)) or 1.0
baked = []
for number, thing in enumerate(things):
    # Texels of about the same size everywhere; sizes are powers of two, at least 64.
    wanted = largest * min(1.0, areas[number] / reference) ** 0.5
    size = max(min(64, largest), 2 ** int(np.ceil(np.log2(max(wanted, 1)))))
    esim_progress(0.02 + 0.93 * sum(areas[:number]) / (sum(areas) or 1), f"baking {thing.name} ({size} px)")
    turn_to_light(thing)
    baked.append(bake(thing, min(size, largest), samples))

with tempfile.TemporaryDirectory() as folder:
    for number, thing in enumerate(things):
        show_baked(thing, baked[number], folder, number)
    esim_progress(0.97, "exporting")
    for light in [thing for thing in scene.objects if thing.type == "LIGHT"]:
        bpy.data.objects.remove(light)
    esim_export(target)
