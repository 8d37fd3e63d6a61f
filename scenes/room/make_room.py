"""Generate the living-room demo scene: room.obj, room.mtl and three JPEGs.

Run (Blender 3.4, NumPy and OpenCV for Blender's Python; about 10 min on one core):

    blender -b --factory-startup -t 1 --python make_room.py -- [options]

    --out DIR     where to write (default: the folder of this script)
    --quick       few light samples, for trying things out
    --cache FILE  keep the baked light in FILE (.npz) and reuse it if present

World frame: metres, z up, origin on the floor at the centre of the room.
Texture colour is outgoing radiance, sRGB encoded.  Everything is procedural
and seeded, so the result does not depend on any downloaded asset.
"""
import argparse
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
sys.dont_write_bytecode = True

import numpy as np  # noqa: E402

import room_bake as bake  # noqa: E402
import room_prints  # noqa: E402,F401  (registers materials)
from room_furniture import build_furniture  # noqa: E402
from room_geometry import Scene, pack_atlas, weld  # noqa: E402
from room_shell import build_shell  # noqa: E402

ATLASES = ("floor", "walls", "furniture")
JPEG_QUALITY = {"floor": 90, "walls": 90, "furniture": 90}
SEED = 7
MEAN_RADIANCE = 0.24          # area-weighted mean of the room's surfaces
SAMPLES = (72, 40)            # direct, indirect
QUICK_SAMPLES = (16, 12)


def parse_args():
    argv = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    ap = argparse.ArgumentParser()
    ap.add_argument("--out", default=HERE)
    ap.add_argument("--quick", action="store_true")
    ap.add_argument("--cache")
    return ap.parse_args(argv)


def write_obj(path, atlases):
    """Triangles as v/vt only, one usemtl group per atlas."""
    nv = nt = tris = 0
    with open(path, "w") as f:
        f.write("# living room, metres, z up, made by make_room.py\n"
                "mtllib room.mtl\n")
        for name, patches in atlases.items():
            verts, uvs, tv, tt = weld(patches)
            uvs, inverse = np.unique(np.round(uvs, 5), axis=0,
                                     return_inverse=True)
            tt = inverse.ravel()[tt]
            f.write("o %s\nusemtl %s\n" % (name, name))
            f.writelines("v %.4f %.4f %.4f\n" % tuple(v) for v in verts)
            f.writelines("vt %.5f %.5f\n" % tuple(t) for t in uvs)
            for a, b in zip(tv + nv + 1, tt + nt + 1):
                f.write("f %d/%d %d/%d %d/%d\n"
                        % (a[0], b[0], a[1], b[1], a[2], b[2]))
            nv, nt, tris = nv + len(verts), nt + len(uvs), tris + len(tv)
    print("%d triangles" % tris)


def write_mtl(path):
    with open(path, "w") as f:
        f.write("# baked light: texture colour is outgoing radiance (sRGB)\n")
        for name in ATLASES:
            f.write("\nnewmtl %s\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 0\n"
                    "map_Kd room_%s.jpg\n" % (name, name))


def paint(atlases):
    """Procedural albedo and emission: per patch, and as albedo atlases."""
    blocks, albedo = {}, {}
    for name, patches in atlases.items():
        img = np.zeros((bake.ATLAS_SIZE, bake.ATLAS_SIZE, 3), np.float32)
        for p in patches:
            blocks[p] = bake.patch_block(p)
            bake.blit(img, p.rect, blocks[p][0])
        albedo[name] = img
    return blocks, albedo


def baked_light(args, atlases, albedo):
    if args.cache and os.path.exists(args.cache):
        z = np.load(args.cache)
        return {n: (z[n + "_direct"], z[n + "_indirect"]) for n in ATLASES}
    light = bake.bake_light(atlases, albedo,
                            QUICK_SAMPLES if args.quick else SAMPLES)
    if args.cache:
        np.savez(args.cache, **{n + k: light[n][i] for n in ATLASES
                                for i, k in enumerate(("_direct", "_indirect"))})
    return light


def main():
    args = parse_args()
    scene = Scene()
    build_shell(scene)
    build_furniture(scene, np.random.default_rng(SEED))
    atlases = {n: [p for p in scene.patches if p.atlas == n] for n in ATLASES}
    for name, patches in atlases.items():
        print("%s: %d patches, %.0f texels/m"
              % (name, len(patches), pack_atlas(patches)))
    os.makedirs(args.out, exist_ok=True)
    write_obj(os.path.join(args.out, "room.obj"), atlases)
    write_mtl(os.path.join(args.out, "room.mtl"))
    blocks, albedo = paint(atlases)
    print("textures painted")
    light = baked_light(args, atlases, albedo)
    images = bake.compose(atlases, blocks, light, MEAN_RADIANCE)
    for name, img in images.items():
        path = os.path.join(args.out, "room_%s.jpg" % name)
        bake.write_jpeg(path, img, JPEG_QUALITY[name])
        print("%s: %d bytes" % (path, os.path.getsize(path)))


main()
