# Renders the open scene of Blender, from poses in Unreal's units and frames; common.py precedes it.
import math
import mmap
import os
import struct
import time

import bpy
import numpy as np
from mathutils import Matrix, Vector


class CommandError(Exception):
    """A client's command cannot be executed."""


# --- frames -----------------------------------------------------------------------------------------------------------
# Unreal's world is left-handed, in centimetres: x forward, y right, z up. Blender's world has y reversed, in metres.
# Angles are in degrees: positive pitch is nose up, positive yaw is nose right, positive roll is right wing down, applied
# in the order roll, pitch, yaw about the world's axes.

def unreal_axes(pitch, yaw, roll):
    """Returns the rotated x, y and z axes as columns, in Unreal's world."""
    p, y, r = (math.radians(angle) for angle in (pitch, yaw, roll))
    cp, sp, cy, sy, cr, sr = math.cos(p), math.sin(p), math.cos(y), math.sin(y), math.cos(r), math.sin(r)
    return Matrix(((cp * cy, sr * sp * cy - cr * sy, -(cr * sp * cy + sr * sy)),
                   (cp * sy, sr * sp * sy + cr * cy, cy * sr - cr * sp * sy),
                   (sp, -sr * cp, cr * cp)))


def unreal_angles(axes):
    """Returns pitch, yaw and roll of such axes; roll is 0 if only its sum with the yaw is known."""
    pitch = math.atan2(axes[2][0], math.hypot(axes[0][0], axes[1][0]))
    if math.hypot(axes[0][0], axes[1][0]) < 1e-7:
        return math.degrees(pitch), math.degrees(math.atan2(-axes[0][1], axes[1][1])), 0.0
    return tuple(math.degrees(angle) for angle in (
        pitch, math.atan2(axes[1][0], axes[0][0]), math.atan2(-axes[2][1], axes[2][2])))


MIRROR = Matrix.Diagonal((1, -1, 1))
CAMERA_AXES = Matrix(((0, 0, -1), (1, 0, 0), (0, 1, 0)))  # Blender's camera (right, up, back) as forward, right, up


def position_from_unreal(location):
    return Vector((location[0] / 100, -location[1] / 100, location[2] / 100))


def position_to_unreal(position):
    return position[0] * 100, -position[1] * 100, position[2] * 100


def camera_matrix(location, rotation):
    turn = MIRROR @ unreal_axes(*rotation) @ CAMERA_AXES
    return Matrix.Translation(position_from_unreal(location)) @ turn.to_4x4()


def object_matrix(location, rotation, scale):
    turn = MIRROR @ unreal_axes(*rotation) @ MIRROR
    return Matrix.LocRotScale(position_from_unreal(location), turn.to_quaternion(), scale)


def pose_of(thing):
    """Returns location and rotation of an object, for Unreal."""
    position, turn, _ = thing.matrix_world.decompose()
    return position_to_unreal(position), unreal_angles(MIRROR @ turn.to_matrix() @ MIRROR)


# --- OpenEXR ----------------------------------------------------------------------------------------------------------

class ExrLayout:
    """The layout of an OpenEXR file without compression."""

    def __init__(self, data):
        self.channels, at = [], 8
        head = bytes(data[:65536])

        def text(begin):
            end = head.index(b"\0", begin)
            return head[begin:end].decode(), end + 1

        while head[at] != 0:
            name, at = text(at)
            _, at = text(at)
            size, = struct.unpack_from("<i", head, at)
            at += 4
            if name == "channels":
                inner = at
                while head[inner] != 0:
                    channel, inner = text(inner)
                    kind, = struct.unpack_from("<i", head, inner)
                    if kind != 2:
                        raise RuntimeError("a channel of the rendered image does not have 32-bit floats")
                    self.channels.append(channel.split(".", 1)[1])  # without the layer's name
                    inner += 16
            elif name == "dataWindow":
                left, top, right, bottom = struct.unpack_from("<4i", head, at)
            at += size
        self.width, self.height = right - left + 1, bottom - top + 1
        self.start, = struct.unpack_from("<Q", head, at + 1)  # offset of the first row; all rows have the same layout

    def read(self, data):
        """Returns a view of height x channels x width."""
        count, stride = len(self.channels), 2 + self.width * len(self.channels)
        rows = np.frombuffer(data, "<f4", stride * self.height, self.start).reshape(self.height, stride)
        return rows[:, 2:].reshape(self.height, count, self.width)


# --- the scene --------------------------------------------------------------------------------------------------------

def has_light(scene):
    def emits(tree):
        for node in tree.nodes if tree is not None else ():
            if node.type in ("EMISSION", "BACKGROUND", "GROUP") or (
                    node.type == "BSDF_PRINCIPLED" and (node.inputs["Emission Strength"].default_value > 0 and (
                        node.inputs["Emission"].is_linked or max(node.inputs["Emission"].default_value[:3]) > 0))):
                return True
        return False

    def has_emitting_material(thing):
        return any(slot.material is not None and emits(slot.material.node_tree) for slot in thing.material_slots)

    if any((thing.type == "LIGHT" or has_emitting_material(thing)) and not thing.hide_render for thing in scene.objects):
        return True
    world = scene.world
    return world is not None and (emits(world.node_tree) if world.use_nodes else max(world.color) > 0)


def spoken_name(name):
    """Replaces spaces, with which the protocol separates names."""
    return name.replace(" ", "_")


class View:
    """One camera of the protocol."""

    def __init__(self):
        self.location, self.rotation, self.field_of_view = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 90.0

    def key(self):
        return self.location, self.rotation, self.field_of_view


class Engine:
    """Renders the open scene. The last result is kept until something changes."""

    def __init__(self, options):
        self.scene = bpy.context.scene
        self.size, self.samples, self.seed = options.size, options.samples, options.seed
        self.cached_key, self.cached = None, None
        self.seconds_rendering = 0.0  # by Blender, including writing its file
        self.renders = 0
        # Blender writes floats to files only. This file has no name, and vanishes with the process.
        self.file = os.memfd_create("esim frame")
        self.settings = self.layout_key = self.layout = None
        self._own_camera()
        self._settings(options)
        self._name_objects()

    def _own_camera(self):
        """Adds a plain camera for rendering; the scene's camera gives its first pose and field of view."""
        self.first = View()
        if self.scene.camera is not None and self.scene.camera.type == "CAMERA":
            matrix = self.scene.camera.matrix_world
            self.first.location = position_to_unreal(matrix.translation)
            axes = MIRROR @ matrix.to_quaternion().to_matrix() @ CAMERA_AXES.transposed()
            self.first.rotation = unreal_angles(axes)
            if self.scene.camera.data.type == "PERSP":
                self.first.field_of_view = math.degrees(self.scene.camera.data.angle_x)
        data = bpy.data.cameras.new("esim")
        data.sensor_fit, data.lens_unit, data.clip_start, data.clip_end = "HORIZONTAL", "FOV", 1e-3, 1e4
        self.camera = bpy.data.objects.new("esim camera", data)
        self.scene.collection.objects.link(self.camera)
        self.scene.camera = self.camera

    def _settings(self, options):
        scene, render = self.scene, self.scene.render
        for layer in scene.view_layers:
            layer.use = layer == bpy.context.view_layer
        layer = bpy.context.view_layer
        layer.use_pass_combined = layer.use_pass_z = True
        layer.use_pass_object_index = options.engine == "cycles"
        render.engine = {"cycles": "CYCLES", "eevee": "BLENDER_EEVEE"}[options.engine]
        # A pixel is the mean of samples within it, with a fixed seed, so that the same requests give the same bytes.
        # Blender's denoiser, if it has one, would blur details.
        scene.cycles.device, scene.cycles.pixel_filter_type = "CPU", "BOX"
        scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = scene.cycles.use_auto_tile = False
        scene.cycles.use_animated_seed = False
        scene.cycles.time_limit = 0
        render.filter_size = 1.0  # of Eevee, px
        render.threads_mode = "FIXED" if options.threads > 0 else "AUTO"
        if options.threads > 0:
            render.threads = options.threads
        render.use_persistent_data = options.persistent
        render.use_motion_blur = render.use_border = render.use_compositing = render.use_sequencer = False
        render.use_multiview = render.film_transparent = render.use_freestyle = False
        render.resolution_percentage, render.pixel_aspect_x, render.pixel_aspect_y = 100, 1, 1
        image = render.image_settings
        image.file_format, image.color_depth, image.exr_codec, image.color_mode = (
            "OPEN_EXR_MULTILAYER", "32", "NONE", "RGBA")
        image.color_management = "FOLLOW_SCENE"
        render.filepath, render.use_file_extension = f"/proc/self/fd/{self.file}", False
        render.use_overwrite, render.use_placeholder = True, False

    def _name_objects(self):
        """Lists the objects that can be moved: those without a parent, each with its children. Ids start at 1."""
        def root_of(thing):
            return root_of(thing.parent) if thing.parent is not None else thing

        roots = [thing for thing in self.scene.objects if thing.parent is None and thing.type != "CAMERA"]
        roots.sort(key=lambda thing: thing.name)
        self.objects = {spoken_name(thing.name): thing for thing in roots}
        self.ids = {name: number for number, name in enumerate(self.objects, 1)}
        self.moved = {}
        for thing in self.scene.objects:
            thing.pass_index = self.ids.get(spoken_name(root_of(thing).name), 0)

    def object(self, name):
        thing = self.objects.get(name)
        if thing is None:
            raise CommandError(f"object {name} does not exist or has a parent; objects without a parent are: "
                               f"{' '.join(self.objects)}")
        return thing

    def move(self, name, location=None, rotation=None):
        thing = self.object(name)
        if name not in self.moved:
            self.moved[name] = (*pose_of(thing), thing.matrix_world.to_scale())
            thing.animation_data_clear()  # nothing else may move it
            thing.constraints.clear()
        old_location, old_rotation, scale = self.moved[name]
        location, rotation = location or old_location, rotation or old_rotation
        self.moved[name] = (location, rotation, scale)
        thing.matrix_world = object_matrix(location, rotation, scale)

    def render(self, view):
        """Returns the passes of the current state, as 32-bit floats: light (height x B, G, R x width), depth (planar, m),
        and with Cycles ids. They are valid until the next call."""
        moved = tuple((name, *pose[:2]) for name, pose in sorted(self.moved.items()))
        key = view.key(), self.size, self.samples, self.seed, moved
        if key == self.cached_key:
            return self.cached
        self.cached_key = None
        self.camera.matrix_world = camera_matrix(view.location, view.rotation)
        settings = view.field_of_view, self.size, self.samples, self.seed
        if settings != self.settings:
            self.settings = settings
            self.camera.data.angle = math.radians(view.field_of_view)
            self.scene.render.resolution_x, self.scene.render.resolution_y = self.size
            self.scene.cycles.samples = self.scene.eevee.taa_render_samples = self.samples
            self.scene.cycles.seed = self.seed
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        self.seconds_rendering += time.perf_counter() - start
        self.renders += 1
        self.cached = self._passes()
        self.cached_key = key
        return self.cached

    def _passes(self):
        """Returns views of the file that Blender has written, which the next rendering overwrites."""
        data = mmap.mmap(self.file, 0, flags=mmap.MAP_SHARED | mmap.MAP_POPULATE, prot=mmap.PROT_READ)
        key = len(data), self.size  # the header contains the date, so its length may change
        if key != self.layout_key:
            self.layout_key, self.layout = key, ExrLayout(data)
        layout = self.layout
        if (layout.width, layout.height) != self.size:
            raise RuntimeError("Blender rendered an image of a different size than requested")
        rows, at = layout.read(data), layout.channels.index
        first = at("Combined.B")  # channels are sorted by name
        passes = {"light": rows[:, first:first + 3], "depth": rows[:, at("Depth.Z")]}
        if "IndexOB.X" in layout.channels:
            passes["ids"] = rows[:, at("IndexOB.X")]
        return passes
