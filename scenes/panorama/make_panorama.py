"""Render the demo panorama panorama.jpg from the living-room scene.

Run (Blender 3.4, NumPy and OpenCV for Blender's Python; about 2 min on one core):

    blender -b --factory-startup -t 1 --python make_panorama.py -- [options]

    --out FILE     image to write (default: panorama.jpg beside this script)
    --room FILE    scene to render (default: ../room/room.obj)
    --height N     image height in pixels, the width is 2 N (default: 2048)
    --samples N    rays per pixel (default: 16)

The camera stands in the middle of the room at 1.3 m.  The picture is an sRGB
equirectangular panorama; the direction (dx, dy, dz), z up, is seen at

    u = 1/2 - atan2(dy, dx) / 2 pi           v = 1/2 - atan2(dz, hypot(dx, dy)) / pi

with (u, v) in [0, 1] from the upper left corner: the centre looks along +x, a
quarter of the width from the left edge is +y, the upper edge is the zenith.
The scene's textures already hold radiance, so no light is simulated here.
"""
import argparse
import math
import os
import sys
import tempfile

import bpy
import cv2

HERE = os.path.dirname(os.path.abspath(__file__))
EYE = (0.0, 0.0, 1.3)
LAMP = (-0.5, 0.55)          # the pendant lamp of the room
JPEG_QUALITY = 88


def parse_args():
    argv = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    p = argparse.ArgumentParser(prog="make_panorama.py")
    p.add_argument("--out", default=os.path.join(HERE, "panorama.jpg"))
    p.add_argument("--room", default=os.path.join(HERE, "..", "room", "room.obj"))
    p.add_argument("--height", type=int, default=2048)
    p.add_argument("--samples", type=int, default=16)
    return p.parse_args(argv)


def load_room(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.obj(filepath=os.path.abspath(path),
                             axis_forward="Y", axis_up="Z")
    for material in bpy.data.materials:
        if material.use_nodes:
            emit_texture(material)


def emit_texture(material):
    """Replace the material by pure emission of its image texture."""
    tree = material.node_tree
    images = [n.image for n in tree.nodes if n.type == "TEX_IMAGE"]
    if not images or images[0] is None:
        sys.exit(f"material {material.name} has no texture")
    tree.nodes.clear()
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = images[0], "Cubic"
    emission = tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(texture.outputs["Color"], emission.inputs["Color"])
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])


def close_pendant_lamp():
    """Two discs over openings of the lamp that only this view, from below, shows."""
    for name, z, radius, colour in (("canopy", 2.668, 0.061, (0.38, 0.25, 0.09)),
                                    ("socket", 2.386, 0.045, (0.80, 0.68, 0.48))):
        bpy.ops.mesh.primitive_circle_add(vertices=48, radius=radius, fill_type="NGON",
                                          location=(LAMP[0], LAMP[1], z))
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        emission = tree.nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = (*colour, 1.0)
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
        bpy.context.object.data.materials.append(material)


def add_camera(scene):
    """Equirectangular camera looking along +x, z up."""
    data = bpy.data.cameras.new("panorama")
    data.type, data.clip_start = "PANO", 0.01
    data.cycles.panorama_type = "EQUIRECTANGULAR"
    camera = bpy.data.objects.new("panorama", data)
    camera.location = EYE
    camera.rotation_euler = (math.pi / 2, 0.0, -math.pi / 2)
    scene.collection.objects.link(camera)
    scene.camera = camera


def set_up_render(scene, height, samples):
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = 2 * height, height
    render.resolution_percentage = 100
    render.dither_intensity = 0.0
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGB"
    cycles.device, cycles.seed = "CPU", 1
    cycles.samples, cycles.max_bounces = samples, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.filter_width = 1.2
    scene.view_settings.view_transform = "Standard"   # sRGB, as in the textures
    scene.view_settings.look = "None"


def main():
    args = parse_args()
    load_room(args.room)
    close_pendant_lamp()
    scene = bpy.context.scene
    add_camera(scene)
    set_up_render(scene, args.height, args.samples)
    with tempfile.TemporaryDirectory() as folder:
        # by way of a PNG: Blender would write time stamps into a JPEG
        scene.render.filepath = os.path.join(folder, "panorama.png")
        bpy.ops.render.render(write_still=True)
        image = cv2.imread(scene.render.filepath)
    cv2.imwrite(args.out, image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY,
                                  cv2.IMWRITE_JPEG_OPTIMIZE, 1])
    print(f"{args.out}: {os.path.getsize(args.out)} bytes")


main()
