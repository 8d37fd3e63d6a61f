"""Makes scenes that deform in Blender, exports them as GLB, and writes the vertices of Blender's own evaluation.

    blender -b --python make_deforming.py -- FOLDER

For each CASE: CASE.glb; CASE.npy, vertices in the world at each of the frames FRAMES (frames x vertices x 3); and
CASE_imported.npy, the same of the GLB after its import. For each MODIFIED, scenes with modifiers: MODIFIED.blend and
MODIFIED.npy. For cloth, as Blender's exporters write it: cloth.obj, at the first frame; cloth_y_up.pc2, cloth_z_up.pc2 and
cloth.mdd; the numbered cloth_*.obj; and cloth.npy.
"""

import math
import os
import struct
import sys

import addon_utils
import bpy
import numpy as np

np.bool = bool  # which the importer of Blender 3.4 uses, and NumPy 1.24 has no more
FOLDER = sys.argv[sys.argv.index("--") + 1]
FRAMES = range(101)
KEYS = (0, 25, 60, 100)
BONES = 5


def empty_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = FRAMES[0], FRAMES[-1]
    return scene


def tube(scene):
    """A tube along z, of height BONES, without texture coordinates and with smooth normals: its vertices stay whole."""
    around, along = 12, 41
    vertices = [(0.4 * math.cos(2 * math.pi * i / around), 0.3 * math.sin(2 * math.pi * i / around), BONES * j / (along - 1))
                for j in range(along) for i in range(around)]
    faces = [(j * around + i, j * around + (i + 1) % around, (j + 1) * around + (i + 1) % around, (j + 1) * around + i)
             for j in range(along - 1) for i in range(around)]
    mesh = bpy.data.meshes.new("tube")
    mesh.from_pydata(vertices, [], faces)
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    thing = bpy.data.objects.new("Tube", mesh)
    scene.collection.objects.link(thing)
    return thing


def interpolate(action, mode):
    for curve in action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = mode


def skinned(mode):
    scene = empty_scene()
    thing = tube(scene)
    armature = bpy.data.objects.new("Armature", bpy.data.armatures.new("armature"))
    scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for i in range(BONES):
        bone = armature.data.edit_bones.new(f"bone{i}")
        bone.head, bone.tail, bone.roll = (0, 0, i), (0.1 * i, 0, i + 1), 0.3 * i
        bone.parent, parent = parent, bone
    bpy.ops.object.mode_set(mode="OBJECT")
    for i in range(BONES):
        group = thing.vertex_groups.new(name=f"bone{i}")
        for vertex in thing.data.vertices:
            weight = math.exp(-2 * (vertex.co.z - i - 0.5) ** 2)
            if weight > 0.01:  # the exporter leaves out small weights
                group.add([vertex.index], weight, "REPLACE")
    modifier = thing.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    thing.parent = armature
    armature.location = (0.5, -0.2, 0.1)
    armature.rotation_euler = (0.2, 0.1, 0.4)
    random = np.random.default_rng(1)
    for frame in KEYS:
        for i, bone in enumerate(armature.pose.bones):
            bone.rotation_mode = "QUATERNION"
            axis = random.normal(size=3)
            axis *= math.sin(0.3) / np.linalg.norm(axis)
            bone.rotation_quaternion = (math.cos(0.3), *axis)
            bone.keyframe_insert("rotation_quaternion", frame=frame)
            if i == 0:
                bone.location = random.normal(size=3) * 0.5
                bone.scale = 1 + 0.1 * random.normal(size=3)
                bone.keyframe_insert("location", frame=frame)
                bone.keyframe_insert("scale", frame=frame)
    interpolate(armature.animation_data.action, mode)


def morphing(mode):
    scene = empty_scene()
    thing = tube(scene)
    thing.location = (0.3, 0.2, 0.1)
    thing.shape_key_add(name="Basis")
    random = np.random.default_rng(2)
    for i in range(3):
        key = thing.shape_key_add(name=f"key{i}")
        for point in key.data:
            point.co = np.array(point.co) + random.normal(size=3) * 0.1 * (point.co.z > i)
        for frame in KEYS:
            key.value = random.uniform(0, 1)
            key.keyframe_insert("value", frame=frame)
    interpolate(thing.data.shape_keys.animation_data.action, mode)


def evaluated():
    """Vertices of the tube in the world at each frame."""
    scene = bpy.context.scene
    result = []
    for frame in FRAMES:
        scene.frame_set(frame)
        thing = scene.objects["Tube"].evaluated_get(bpy.context.evaluated_depsgraph_get())
        matrix = np.array(thing.matrix_world)
        vertices = np.array([tuple(vertex.co) for vertex in thing.to_mesh().vertices])
        result.append(vertices @ matrix[:3, :3].T + matrix[:3, 3])
    return np.array(result)


for case, make, mode, sampled in (("skinned_linear", skinned, "LINEAR", True), ("skinned_cubic", skinned, "BEZIER", False),
                                  ("morphing_linear", morphing, "LINEAR", False), ("morphing_cubic", morphing, "BEZIER", False),
                                  ("morphing_step", morphing, "CONSTANT", False), ("skinned_sampled", skinned, "BEZIER", True)):
    make(mode)
    path = os.path.join(FOLDER, case)
    np.save(path + ".npy", evaluated())
    bpy.context.scene.frame_set(0)
    bpy.ops.export_scene.gltf(filepath=path + ".glb", export_format="GLB", export_force_sampling=sampled,
                              export_all_influences=True, export_nla_strips=False, export_optimize_animation_size=False)
    scene = empty_scene()
    bpy.ops.import_scene.gltf(filepath=path + ".glb")
    np.save(path + "_imported.npy", evaluated())


def waving():
    """A modifier that depends on time, on a mesh with shape keys."""
    morphing("LINEAR")
    thing = bpy.context.scene.objects["Tube"]
    wave = thing.modifiers.new("Wave", "WAVE")
    wave.height, wave.width, wave.speed = 0.2, 0.5, 0.1


def subdivided():
    """A skeleton with a modifier that does not depend on time."""
    skinned("LINEAR")
    modifiers = bpy.context.scene.objects["Tube"].modifiers
    modifiers.new("Subdivision", "SUBSURF").levels = 1
    bpy.context.view_layer.objects.active = bpy.context.scene.objects["Tube"]
    bpy.ops.object.modifier_move_up(modifier="Subdivision")


def write_pc2(path, frames):
    """Vertices at frames (frames x vertices x 3) as a point cache."""
    with open(path, "wb") as out:
        out.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, frames.shape[1], 0.0, 1.0, len(frames)))
        out.write(frames.astype("<f4").tobytes())


def write_mdd(path, frames):
    with open(path, "wb") as out:
        out.write(struct.pack(">ii", *frames.shape[:2]))
        out.write((np.arange(len(frames)) / 24).astype(">f4").tobytes() + frames.astype(">f4").tobytes())


def cached(kind):
    """Vertices from a point cache, which moves them at random."""
    thing = tube(empty_scene())
    rest = np.array([tuple(vertex.co) for vertex in thing.data.vertices])
    steps = np.random.default_rng(3).normal(size=(101, *rest.shape)) * 0.01
    path = os.path.join(FOLDER, "cache." + kind)
    {"pc2": write_pc2, "mdd": write_mdd}[kind](path, rest + np.cumsum(steps, axis=0))
    modifier = thing.modifiers.new("Cache", "MESH_CACHE")
    modifier.cache_format, modifier.filepath = kind.upper(), path


def pc2_cache():
    cached("pc2")


def mdd_cache():
    cached("mdd")


def skinned_keys():
    """Shape keys and a skeleton."""
    skinned("LINEAR")
    thing = bpy.context.scene.objects["Tube"]
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="wide")
    for point in key.data:
        point.co = (1.5 * point.co.x, 1.2 * point.co.y, point.co.z)
    for frame, value in ((0, 0.2), (50, 1), (100, 0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)


for make in (waving, subdivided, skinned_keys, pc2_cache, mdd_cache):
    make()
    path = os.path.join(FOLDER, make.__name__)
    np.save(path + ".npy", evaluated())
    bpy.context.scene.frame_set(0)
    bpy.ops.wm.save_as_mainfile(filepath=path + ".blend")


def export_cloth():
    """A mesh with shape keys and a modifier that depends on time, away from the origin."""
    waving()
    scene, path = bpy.context.scene, os.path.join(FOLDER, "cloth")
    thing = scene.objects["Tube"]
    np.save(path + ".npy", evaluated())
    scene.frame_set(0)
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)
    options = {"forward_axis": "Y", "up_axis": "Z", "export_materials": False}
    bpy.ops.wm.obj_export(filepath=path + ".obj", **options)
    bpy.ops.wm.obj_export(filepath=path + "_.obj", export_animation=True, start_frame=FRAMES[0], end_frame=FRAMES[-1],
                          **options)
    for addon in ("io_export_pc2", "io_shape_mdd"):
        addon_utils.enable(addon)
    for name, y_up in (("_y_up", True), ("_z_up", False)):
        bpy.ops.export_shape.pc2(filepath=f"{path}{name}.pc2", rot_x90=y_up, world_space=True, range_start=FRAMES[0],
                                 range_end=FRAMES[-1])
    bpy.ops.export_shape.mdd(filepath=path + ".mdd", fps=24, frame_start=FRAMES[0], frame_end=FRAMES[-1])


export_cloth()
