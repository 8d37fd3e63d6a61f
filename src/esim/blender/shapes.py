# Shapes that change. The exporter of glTF writes armatures as skins, and shape keys; but it applies modifiers only to meshes
# without shape keys, and only as they are at one time. What else deforms becomes shape keys here, one per frame.
import bpy
import numpy as np

# Modifiers whose result does not depend on time if their mesh does not: an armature may be applied after them.
ESIM_STATIC_MODIFIERS = {"ARRAY", "BEVEL", "DECIMATE", "EDGE_SPLIT", "MIRROR", "MULTIRES", "REMESH", "SCREW", "SKIN", "SOLIDIFY",
                         "SUBSURF", "TRIANGULATE", "WEIGHTED_NORMAL", "WELD", "WIREFRAME"}
ESIM_MAX_MORPHED = 2 ** 26  # frames times vertices of a thing


def esim_modifiers(thing):
    return [modifier for modifier in thing.modifiers if modifier.show_viewport and modifier.type != "ARMATURE"]


def esim_has_keys(thing):
    return thing.data.shape_keys is not None and len(thing.data.shape_keys.key_blocks) > 1


def esim_vertices(thing):
    """The vertices of a thing in its own frame, after its modifiers."""
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    triangles = (len(mesh.loops), len(mesh.polygons))
    evaluated.to_mesh_clear()
    return vertices, triangles


def esim_record(things):
    """The vertices of things at each frame of the scene, by name; None if their topology changes."""
    scene = bpy.context.scene
    recorded, counts = {}, {}
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        for thing in things:
            if frame == scene.frame_start:
                vertices, counts[thing.name] = esim_vertices(thing)
                recorded[thing.name] = [vertices]
            elif recorded[thing.name] is not None:
                shapes = recorded[thing.name]
                vertices, count = esim_vertices(thing)
                if count != counts[thing.name] or len(vertices) != len(shapes[0]):
                    recorded[thing.name] = None
                else:
                    shapes.append(shapes[-1] if np.array_equal(vertices, shapes[-1]) else vertices)
    scene.frame_set(scene.frame_start)
    return recorded


def esim_add_keys(thing, shapes):
    """Turns a sequence of shapes into shape keys, between which the mesh is interpolated."""
    first = bpy.context.scene.frame_start
    thing.shape_key_add(name="Basis")
    keys = thing.data.shape_keys
    keys.animation_data_create().action = action = bpy.data.actions.new(thing.name + " shapes")
    for i, vertices in enumerate(shapes):
        if i == 0 or np.array_equal(vertices, shapes[0]):
            continue
        key = thing.shape_key_add(name=f"frame{first + i}", from_mix=False)
        key.data.foreach_set("co", vertices)
        curve = action.fcurves.new(f'key_blocks["{key.name}"].value')
        curve.keyframe_points.add(3)
        for point, (at, value) in zip(curve.keyframe_points, ((i - 1, 0), (i, 1), (i + 1, 0))):
            point.co, point.interpolation = (first + at, value), "LINEAR"


def esim_apply(thing, keeps_armature):
    """Replaces the mesh of a thing by that after its modifiers."""
    armatures = [modifier for modifier in thing.modifiers if modifier.type == "ARMATURE"]
    shown = [modifier.show_viewport for modifier in armatures]
    for modifier in armatures if keeps_armature else ():
        modifier.show_viewport = False
    depsgraph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(thing.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph)
    for modifier, show in zip(armatures, shown):
        modifier.show_viewport = show
    thing.data = mesh
    for modifier in list(thing.modifiers):
        if modifier.type != "ARMATURE" or not keeps_armature:
            thing.modifiers.remove(modifier)
    if not keeps_armature and thing.parent_type == "ARMATURE":
        thing.parent_type = "OBJECT"


def esim_prepare_shapes():
    """Applies modifiers to meshes. Returns whether the exporter may apply those of other things."""
    things = [thing for thing in bpy.context.scene.objects
              if thing.type == "MESH" and thing.library is None and esim_modifiers(thing)]
    skinned = {thing.name for thing in things if not esim_has_keys(thing) and
               all(modifier.type in ESIM_STATIC_MODIFIERS for modifier in esim_modifiers(thing))}
    frames = bpy.context.scene.frame_end - bpy.context.scene.frame_start + 1
    varying = [thing for thing in things if thing.name not in skinned]
    recorded = esim_record(varying) if varying else {}
    for thing in things:
        shapes = recorded.get(thing.name, [])
        moves = shapes is None or any(shape is not shapes[0] for shape in shapes)
        esim_apply(thing, keeps_armature=thing.name in skinned or not moves)
        if shapes is None:
            esim_warn(f"object {thing.name}: its number of vertices changes over time, which is not supported; it keeps its first shape")
        elif moves and frames * len(shapes[0]) // 3 > ESIM_MAX_MORPHED:
            esim_warn(f"object {thing.name}: changes its shape in {frames} frames, which is too much; it keeps its first shape")
        elif moves:
            esim_add_keys(thing, shapes)
    # With its option to apply modifiers, the exporter leaves out the shape keys of things that have modifiers.
    conflict = any(thing.type == "MESH" and esim_has_keys(thing) and thing.modifiers for thing in bpy.context.scene.objects)
    for thing in bpy.context.scene.objects if conflict else ():
        if thing.type in ("CURVE", "SURFACE", "FONT") and thing.modifiers:
            esim_warn(f"object {thing.name}: its modifiers are left out; convert it to a mesh")
    return not conflict


