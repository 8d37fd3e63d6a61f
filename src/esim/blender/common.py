# Shared by all scripts; legacy.py precedes it.
import os
import struct
import zlib

import bpy
import numpy as np


def esim_warn(text):
    print("esim warning " + text.replace("\n", " "), flush=True)


def esim_progress(fraction, what):
    print(f"esim progress {fraction:.4f} {what}", flush=True)


def esim_png(pixels):
    """Encodes an array as PNG, rows from the top: height x width x 3 (RGB) or 4 (RGBA), of uint8 or uint16."""
    height, width, channels = pixels.shape
    bits = 8 * pixels.dtype.itemsize
    rows = np.zeros((height, 1 + width * channels * bits // 8), np.uint8)  # each row begins with its filter, 0
    rows[:, 1:] = np.ascontiguousarray(pixels.astype(pixels.dtype.newbyteorder(">"))).reshape(height, -1).view(np.uint8)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, {3: 2, 4: 6}[channels], 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows.tobytes(), 1 if bits == 8 else 6)) + chunk(b"IEND", b""))


def esim_srgb(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(linear, 1 / 2.4) - 0.055)


def esim_find_images(folder):
    """Looks for missing image files in the scene's own folder. Prints the files that the scene uses."""
    for image in bpy.data.images:
        if image.source != "FILE" or image.packed_file is not None:
            continue
        path = os.path.abspath(bpy.path.abspath(image.filepath, library=image.library))
        if not os.path.isfile(path):
            beside = os.path.join(folder, os.path.basename(image.filepath.replace("\\", "/")))
            print("esim warning file " + path, flush=True)
            if os.path.isfile(beside):
                image.filepath = path = beside
                image.reload()
            else:
                esim_warn(f"image {image.name}: the file {image.filepath} does not exist")
        print("esim warning file " + path, flush=True)
    for library in bpy.data.libraries:
        print("esim warning file " + os.path.abspath(bpy.path.abspath(library.filepath)), flush=True)


def esim_list_other_files():
    """Prints all other files to which the scene refers, such as volumes and fonts. Where Blender chooses among files, as in
    image sequences, it prints the folder."""
    sequences = {os.path.abspath(bpy.path.abspath(data.filepath, library=data.library))
                 for data in (*bpy.data.images, *bpy.data.movieclips) if data.source in ("SEQUENCE", "TILED")}
    sequences |= {os.path.abspath(bpy.path.abspath(data.filepath, library=data.library))
                  for data in (*bpy.data.volumes, *bpy.data.cache_files) if data.is_sequence}
    paths = {os.path.dirname(path) for path in sequences}
    for path in map(os.path.abspath, bpy.utils.blend_paths(absolute=True)):
        paths.update((folder for folder, _, _ in os.walk(path)) if os.path.isdir(path) else (path,))
    for path in sorted(paths):
        print("esim warning file " + path, flush=True)


def esim_open(path):
    """Opens the scene of a file in any supported format."""
    extension = os.path.splitext(path)[1].lower()
    if extension == ".blend":
        bpy.ops.wm.open_mainfile(filepath=path, load_ui=False, use_scripts=False)
        esim_restore_legacy_materials(path)
        esim_find_images(os.path.dirname(path))
        esim_list_other_files()
        return
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if extension in (".glb", ".gltf"):
        bpy.ops.import_scene.gltf(filepath=path)
    elif extension == ".obj":
        bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
    elif extension == ".ply":
        bpy.ops.import_mesh.ply(filepath=path)
    elif extension == ".fbx":
        bpy.ops.import_scene.fbx(filepath=path)
    elif extension == ".dae":
        bpy.ops.wm.collada_import(filepath=path)
    else:
        raise RuntimeError("Error: Blender does not support the format " + extension)
    esim_list_other_files()


def esim_export(path):
    bpy.ops.export_scene.gltf(
        filepath=path, export_format="GLB", export_yup=True, export_apply=True, export_cameras=True,
        export_extras=True, export_animations=True, export_force_sampling=True, export_nla_strips=False,
        export_skins=True, export_all_influences=True, export_morph=True)
