"""Light baking for the living room (runs inside Blender) and post-processing.

The reflected radiance of a texel is albedo * irradiance / pi.  The albedo comes
from the procedural textures, Cycles supplies direct and indirect irradiance at
half the resolution; both are denoised patch by patch and recombined.
"""
import math

import bpy
import cv2
import numpy as np

from room_geometry import ATLAS_SIZE, PAD, weld
from room_noise import encode_srgb
from room_shell import WIN, X
from room_textures import MATERIALS, Ctx

BAKE_SIZE = ATLAS_SIZE // 2
JITTER = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))


# ------------------------------------------------------------------ textures
def patch_block(patch):
    """Albedo and emission of one patch, supersampled, in atlas orientation."""
    _x, _y, w, h = patch.rect
    ns, nt = (h, w) if patch.turned else (w, h)
    total, glow = 0.0, 0.0
    for ds, dt in JITTER:
        ctx = Ctx(patch, (np.arange(ns) + 0.5 + ds) / ns,
                  (np.arange(nt) + 0.5 + dt) / nt)
        got = MATERIALS[patch.mat](ctx)
        rgb, emission = got if isinstance(got, tuple) else (got, 0.0)
        total = total + np.clip(rgb, 0.005, 0.92) / len(JITTER)
        glow = glow + np.asarray(emission) / len(JITTER)
    glow = np.broadcast_to(glow, total.shape)
    if patch.turned:
        total, glow = total.transpose(1, 0, 2), glow.transpose(1, 0, 2)
    return total.astype(np.float32), glow.astype(np.float32)


def blit(image, rect, block, pad=PAD):
    """Copy a block into the atlas with replicated margins."""
    x, y, w, h = rect
    b = cv2.copyMakeBorder(np.ascontiguousarray(block), pad, pad, pad, pad,
                           cv2.BORDER_REPLICATE)
    image[y - pad:y + h + pad, x - pad:x + w + pad] = b


# ------------------------------------------------------------- Blender scene
def float_image(name, size, pixels=None):
    img = bpy.data.images.new(name, size, size, alpha=False, float_buffer=True)
    img.colorspace_settings.name = "Non-Color"
    if pixels is not None:
        rgba = np.ones((size, size, 4), np.float32)
        rgba[..., :3] = pixels
        img.pixels.foreach_set(rgba.ravel())
    return img


def atlas_object(name, patches, albedo):
    """Mesh object of one atlas, shaded with its albedo image."""
    verts, uvs, tri_v, tri_t = weld(patches)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(verts.tolist(), [], tri_v.tolist())
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", uvs[tri_t.ravel()].astype(np.float32).ravel())
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.use_auto_smooth = True
    mesh.auto_smooth_angle = math.radians(38)
    mat = bpy.data.materials.new(name)
    mat.use_nodes = True
    nt = mat.node_tree
    nt.nodes.clear()
    tex = nt.nodes.new("ShaderNodeTexImage")
    tex.image = float_image(name + "_albedo", ATLAS_SIZE, albedo)
    diff = nt.nodes.new("ShaderNodeBsdfDiffuse")
    out = nt.nodes.new("ShaderNodeOutputMaterial")
    nt.links.new(tex.outputs["Color"], diff.inputs["Color"])
    nt.links.new(diff.outputs["BSDF"], out.inputs["Surface"])
    target = nt.nodes.new("ShaderNodeTexImage")
    target.image = float_image(name + "_bake", BAKE_SIZE)
    nt.nodes.active = target
    mesh.materials.append(mat)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj, target.image


def add_light(kind, pos, colour, energy, rotation=(0, 0, 0), **attrs):
    data = bpy.data.lights.new(kind, kind)
    data.color, data.energy = colour, energy
    for k, v in attrs.items():
        setattr(data, k, v)
    obj = bpy.data.objects.new(kind, data)
    obj.location, obj.rotation_euler = pos, rotation
    bpy.context.scene.collection.objects.link(obj)


def add_lights():
    """Low sun through the window, skylight, and three lamps."""
    from mathutils import Vector
    sun = Vector((0.80, 0.27, -0.56))
    add_light("SUN", (-6, 0, 4), (1.0, 0.86, 0.66), 13.0,
              sun.to_track_quat("-Z", "Y").to_euler(), angle=math.radians(1.2))
    y, z = 0.5 * (WIN["y0"] + WIN["y1"]), 0.5 * (WIN["z0"] + WIN["z1"])
    # skylight comes from slightly above, so it misses most of the ceiling
    add_light("AREA", (-X - WIN["depth"] - 0.35, y, z + 0.12), (0.80, 0.90, 1.0),
              230.0, (0, math.radians(-70), 0), shape="RECTANGLE",
              spread=math.radians(150), size=1.2 * (WIN["z1"] - WIN["z0"]),
              size_y=1.2 * (WIN["y1"] - WIN["y0"]))
    warm = (1.0, 0.72, 0.42)
    add_light("POINT", (0.86, 2.12, 1.55), warm, 26.0, shadow_soft_size=0.05)
    add_light("POINT", (-1.45, -2.27, 1.26), warm, 10.0, shadow_soft_size=0.04)
    add_light("POINT", (-0.5, 0.55, 2.20), (1.0, 0.80, 0.55), 30.0,
              shadow_soft_size=0.05)
    # soft fill, as from further windows behind the camera
    add_light("AREA", (0.7, -0.3, 2.58), (1.0, 0.95, 0.88), 75.0,
              shape="RECTANGLE", size=3.6, size_y=3.6)
    add_light("AREA", (2.60, -0.6, 1.5), (1.0, 0.96, 0.92), 36.0,
              (0, math.radians(90), 0), shape="RECTANGLE", size=1.8, size_y=3.2)


def bake_pass(obj, image, kind, spp):
    """Bake direct or indirect diffuse light without the surface colour."""
    sc = bpy.context.scene
    sc.render.engine = "CYCLES"
    cy = sc.cycles
    cy.device, cy.samples, cy.seed = "CPU", spp, 3
    cy.use_adaptive_sampling = cy.use_denoising = False
    cy.max_bounces = cy.diffuse_bounces = 0 if kind == "DIRECT" else 5
    cy.sample_clamp_indirect = 6.0
    for o in sc.objects:
        o.select_set(o == obj)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={kind}, margin=0,
                        use_clear=True)
    px = np.empty(BAKE_SIZE * BAKE_SIZE * 4, np.float32)
    image.pixels.foreach_get(px)
    return px.reshape(BAKE_SIZE, BAKE_SIZE, 4)[..., :3].copy()


def bake_light(atlases, albedo, spp):
    """{atlas: (direct, indirect)} at half resolution."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.world = bpy.data.worlds.new("black")
    bpy.context.scene.world.color = (0, 0, 0)
    objects = {}
    for name, patches in atlases.items():
        solid = [p for p in patches if p.mat not in ("outdoor", "bulb")]
        objects[name] = atlas_object(name, solid, albedo[name])
    add_lights()
    out = {}
    for name, (obj, image) in objects.items():
        out[name] = (bake_pass(obj, image, "DIRECT", spp[0]),
                     bake_pass(obj, image, "INDIRECT", spp[1]))
    return out


# ----------------------------------------------------------------- composing
def denoise(direct, indirect):
    """Edge-preserving filters for direct light, Gaussian for indirect light."""
    n = min(direct.shape[:2])
    d = np.sqrt(np.maximum(np.nan_to_num(direct), 0))
    if n >= 8:
        d = cv2.medianBlur(d, 3)
        d = cv2.bilateralFilter(d, 9, 0.12, 2.5, borderType=cv2.BORDER_REPLICATE)
    sigma = min(3.5, 0.25 * n)
    i = cv2.GaussianBlur(np.nan_to_num(indirect), (0, 0), sigma,
                         borderType=cv2.BORDER_REPLICATE)
    return d * d + i


def patch_light(patch, direct, indirect):
    x, y, w, h = (a // 2 for a in patch.rect)
    e = denoise(direct[y:y + h, x:x + w].copy(), indirect[y:y + h, x:x + w].copy())
    return cv2.resize(e, (2 * w, 2 * h), interpolation=cv2.INTER_LINEAR)


def shoulder(x, knee=0.55):
    """Identity up to the knee, then a smooth roll-off towards 1."""
    k = 1 - knee
    return np.where(x < knee, x, 1 - k * np.exp(-(np.maximum(x, knee) - knee) / k))


def compose(atlases, blocks, light, target):
    """Final radiance images; exposure makes the room's mean `target`."""
    lit, total, area = {}, 0.0, 0.0
    for name, patches in atlases.items():
        for p in patches:
            rgb, _glow = blocks[p]
            e = 0.0 if p.mat in ("outdoor", "bulb") else patch_light(p, *light[name])
            lit[p] = rgb * e
            if p.mat not in ("outdoor", "bulb", "ceiling"):
                a = p.width * p.height
                total, area = total + a * float(lit[p].mean()), area + a
    exposure = target * area / total
    print("exposure %.3f" % exposure)
    images = {}
    for name, patches in atlases.items():
        img = np.full((ATLAS_SIZE, ATLAS_SIZE, 3), 0.2, np.float32)
        for p in patches:
            rgb = shoulder(lit[p] * exposure) + blocks[p][1]
            blit(img, p.rect, rgb.astype(np.float32))
        images[name] = img
    return images


def write_jpeg(path, image, quality):
    """Linear image with row 0 at the bottom to an sRGB JPEG file."""
    out = np.round(255 * encode_srgb(image[::-1, :, ::-1])).astype(np.uint8)
    cv2.imwrite(path, out, [cv2.IMWRITE_JPEG_QUALITY, quality,
                            cv2.IMWRITE_JPEG_OPTIMIZE, 1])
