"""Compares glossy surfaces (lighting: pbr) with Blender's Cycles, on spheres under one light each, without bounces.

    python3 bench/shading_against_cycles.py [--build build/release] [--lights sun,point,area]

Prints a table: the rms of the difference over the sphere, in percent of the mean radiance that Cycles sees there. Cycles
has the equations of glTF 2.0 as a mixture of its Diffuse and Glossy BSDFs. Its GGX has the separable visibility term of
Smith, and glTF 2.0 the height-correlated one: "as it is" leaves that, "same term" corrects it with shader nodes. A second table compares the light of
an environment with the integral over its image. Needs
NumPy, `blender`, and the program render_irradiance of the benchmarks.
"""

import argparse
import base64
import json
import math
import pathlib
import subprocess
import tempfile

import numpy as np

FOLDER = pathlib.Path(__file__).resolve().parent.parent
SIZE, FOCAL, DISTANCE = 256, 450.0, 4.0  # px, px, m: of the camera, which looks along +y at the sphere
BASE = 0.6
SUN = (-0.5, 1.0, -0.6)  # its direction
LAMP = (-1.5, -2.0, 1.2)  # m
AREA = (1.0, 0.8)  # m; it faces the sphere
STRENGTH = {"sun": 0.8, "point": 4.0, "area": 4.0}
AREA_SAMPLES = 1024
ROUGHNESSES = (0.1, 0.3, 0.5, 0.7, 1.0)
COLUMNS = 512  # of the sphere


def sphere():
    """Vertices, which are also the normals, and triangles, without seams. (Blender stores given normals with 16 bits;
    those that it computes here are more exact.)"""
    columns, rows = COLUMNS, COLUMNS // 2
    latitude = (np.arange(1, rows) / rows - 0.5)[:, None] * math.pi
    longitude = np.arange(columns)[None, :] * (2 * math.pi / columns)
    rings = np.stack(np.broadcast_arrays(np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude),
                                         np.sin(latitude)), -1).reshape(-1, 3)
    vertices = np.concatenate([rings, [[0, 0, -1], [0, 0, 1]]])
    here, beside = np.arange(columns), (np.arange(columns) + 1) % columns
    triangles = [np.stack([np.full(columns, len(rings)), beside, here], -1)]
    for row in range(rows - 2):
        below, above = row * columns, (row + 1) * columns
        triangles += [np.stack([below + here, below + beside, above + beside], -1),
                      np.stack([below + here, above + beside, above + here], -1)]
    last = (rows - 2) * columns
    triangles.append(np.stack([last + here, last + beside, np.full(columns, len(rings) + 1)], -1))
    return vertices, np.concatenate(triangles)


def write_gltf(path, metallic, roughness):
    """The sphere with a material. glTF has y up."""
    vertices, triangles = sphere()
    data = (vertices[:, [0, 2, 1]] * [1, 1, -1]).astype("<f4").tobytes()
    indices = triangles.astype("<u4").tobytes()
    linear = [BASE, BASE, BASE, 1]
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": linear, "metallicFactor": metallic,
                                                "roughnessFactor": roughness}}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3",
                       "min": [-1, -1, -1], "max": [1, 1, 1]},
                      {"bufferView": 1, "componentType": 5125, "count": triangles.size, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)},
                        {"buffer": 0, "byteOffset": len(data), "byteLength": len(indices)}],
        "buffers": [{"byteLength": len(data) + len(indices),
                     "uri": "data:application/octet-stream;base64," + base64.b64encode(data + indices).decode()}]}))


def write_sky(path, height=128):
    """An equirectangular image: smooth, with a sun 9 degrees wide. Returns what the file holds, and its directions."""
    latitude = (0.5 - (np.arange(height) + 0.5) / height)[:, None] * math.pi
    longitude = (1 - (np.arange(2 * height) + 0.5) / height)[None, :] * math.pi
    d = np.stack(np.broadcast_arrays(np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude),
                                     np.sin(latitude)), -1)
    sun = np.array(LAMP) / np.linalg.norm(LAMP)
    light = 0.4 + 0.3 * d[..., 2] + 0.15 * d[..., 0] * d[..., 1] + 15 * np.exp(-(np.arccos(d @ sun) / 0.08) ** 2)
    mantissa, exponent = np.frexp(light)
    code = np.clip(np.floor(mantissa * 256), 0, 255)
    pixels = np.stack([code, code, code, exponent + 128], -1).astype(np.uint8)
    path.write_bytes(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {2 * height}\n".encode() + pixels.tobytes())
    return np.ldexp(code, exponent - 8), d, np.broadcast_to(np.cos(latitude), light.shape)


def integral(sky, n, v, metallic, roughness):
    """What a point with the normal n reflects to v, by the equations, summed over the pixels of the sky."""
    light, towards, weight = sky
    n_l, n_v = np.maximum(towards @ n, 0), n @ v
    h = towards + v
    h /= np.maximum(np.linalg.norm(h, axis=-1), 1e-9)[..., None]
    a2 = roughness ** 4
    lobe = a2 / ((h @ n) ** 2 * (a2 - 1) + 1) ** 2 * 0.5 / np.maximum(
        n_l * math.sqrt(a2 + (1 - a2) * n_v ** 2) + n_v * np.sqrt(a2 + (1 - a2) * n_l ** 2), 1e-9)
    schlick = (1 - h @ v) ** 5
    fresnel = 0.04 + 0.96 * schlick
    value = (metallic * lobe * (BASE + (1 - BASE) * schlick)
             + (1 - metallic) * (BASE * (1 - fresnel) + lobe * fresnel)) * n_l
    return np.sum(light * value * weight) * (math.pi / light.shape[0]) ** 2 / math.pi


def print_environment(program, folder):
    print("| environment: material | roughness | rms | largest |\n|---|---|---|---|")
    rows, columns = np.nonzero(on_sphere())
    chosen = np.random.default_rng(1).choice(len(rows), 300, replace=False)
    sky = write_sky(folder / "sky.hdr")
    for metallic in (0, 1):
        for roughness in ROUGHNESSES[1:]:
            seen = seen_by_esim(program, folder, "environment", metallic, roughness)
            pairs = []
            for k in chosen:
                bearing = np.array([columns[k] - (SIZE - 1) / 2, FOCAL, (SIZE - 1) / 2 - rows[k]])
                bearing /= np.linalg.norm(bearing)
                along = DISTANCE * bearing[1] - math.sqrt((DISTANCE * bearing[1]) ** 2 - DISTANCE ** 2 + 1)
                n = along * bearing - [0, DISTANCE, 0]
                pairs.append((seen[rows[k], columns[k]], integral(sky, n, -bearing, metallic, roughness)))
            ours, true = np.transpose(pairs)
            error = np.abs(ours - true) / np.mean(true) * 100
            print(f"| {'metal' if metallic else 'dielectric'} | {roughness} | {np.sqrt(np.mean(error ** 2)):.1f} % | "
                  f"{error.max():.1f} % |")


def lighting(light):
    if light == "environment":
        return "{type: pbr, environment: {image: sky.hdr, visible: false}}"
    facing = [-v for v in LAMP]
    entry = {"sun": f"suns: [{{direction: {list(SUN)}, strength: {STRENGTH['sun']}}}]",
             "point": f"points: [{{position: {list(LAMP)}, strength: {STRENGTH['point']}}}]",
             "area": f"areas: [{{position: {list(LAMP)}, direction: {facing}, size: {list(AREA)}, "
                     f"strength: {STRENGTH['area']}, samples: {AREA_SAMPLES}}}]"}[light]
    return f"{{type: pbr, ambient: 0, {entry}}}"


def seen_by_esim(program, folder, light, metallic, roughness):
    write_gltf(folder / "sphere.gltf", metallic, roughness)
    (folder / "scenario.yaml").write_text(f"""
renderer: {{type: mesh, engine: raycast, scene: sphere.gltf, samples_per_pixel: 1, background: 0,
           lighting: {lighting(light)}}}
trajectory: {{type: static, pose: {{position: [0, {-DISTANCE}, 0], look_at: [0, 0, 0]}}}}
camera: {{width: {SIZE}, height: {SIZE}, fx: {FOCAL}, sampling: {{type: uniform, rate_hz: 100}}}}
duration_s: 0.01
""")
    out = folder / "irradiance.raw"
    subprocess.run([program, folder / "scenario.yaml", out], check=True)
    return np.fromfile(out, "<f4").reshape(SIZE, SIZE)


# Runs in Blender: renders every case of a JSON file.
IN_BLENDER = '''
import json, math, sys
import bpy, mathutils
import numpy as np
job = json.load(open(sys.argv[-1]))
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.render.threads_mode, scene.render.threads = "FIXED", 2
scene.cycles.max_bounces = scene.cycles.diffuse_bounces = scene.cycles.glossy_bounces = 0
scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
scene.cycles.blur_glossy = scene.cycles.light_sampling_threshold = 0
scene.render.use_persistent_data = True
scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01  # a box is always 1 px wide
scene.render.resolution_x = scene.render.resolution_y = job["size"]
scene.render.resolution_percentage = 100
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
scene.render.image_settings.color_mode = "RGB"
scene.view_settings.view_transform = "Raw"
scene.world = bpy.data.worlds.new("dark")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0

camera = bpy.data.cameras.new("camera")
camera.sensor_width, camera.lens = 36, 36 * job["focal"] / job["size"]
seen_from = bpy.data.objects.new("camera", camera)
seen_from.location = (0, -job["distance"], 0)
seen_from.rotation_euler = (math.pi / 2, 0, 0)
scene.collection.objects.link(seen_from)
scene.camera = seen_from

mesh = bpy.data.meshes.new("sphere")
data = np.load(job["sphere"])
mesh.from_pydata(data["vertices"].tolist(), [], data["triangles"].tolist())
for polygon in mesh.polygons: polygon.use_smooth = True
ball = bpy.data.objects.new("sphere", mesh)
scene.collection.objects.link(ball)

light = None
def place(kind):
    global light
    if light is not None: bpy.data.objects.remove(light)
    lamp = bpy.data.lights.new("light", {"sun": "SUN", "point": "POINT", "area": "AREA"}[kind])
    light = bpy.data.objects.new("light", lamp)
    scene.collection.objects.link(light)
    lamp.use_shadow = False
    strength = job["strength"][kind]
    if kind == "sun":
        lamp.angle, lamp.energy = 0, math.pi * strength
        along = mathutils.Vector(job["sun"])
    else:
        light.location = job["lamp"]
        along = -mathutils.Vector(job["lamp"])
        if kind == "point":
            lamp.shadow_soft_size, lamp.energy = 0, 4 * math.pi ** 2 * strength
        else:
            lamp.shape, lamp.size, lamp.size_y = "RECTANGLE", *job["area"]
            lamp.energy = 4 * math.pi * strength  # of a radiance of energy / (4 area)
    light.rotation_mode = "QUATERNION"
    light.rotation_quaternion = along.to_track_quat("-Z", "Y")
    scene.cycles.samples = job["samples"] if kind == "area" else 16

def material(kind, metallic, roughness, same_term):
    made = bpy.data.materials.new("surface")
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    def connect(socket, value):
        if isinstance(value, (int, float)): socket.default_value = value
        elif isinstance(value, tuple): socket.default_value = value
        else: links.new(value, socket)
    def scalar(operation, a, b=0.0):
        node = nodes.new("ShaderNodeMath")
        node.operation = operation
        connect(node.inputs[0], a), connect(node.inputs[1], b)
        return node.outputs[0]
    def vector(operation, a, b=(0.0, 0.0, 0.0)):
        node = nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        connect(node.inputs[0], a), connect(node.inputs[1], b)
        return node.outputs[1 if operation == "DOT_PRODUCT" else 0]
    geometry = nodes.new("ShaderNodeNewGeometry")
    n, v = geometry.outputs["Normal"], geometry.outputs["Incoming"]
    if kind == "sun": l = tuple(-mathutils.Vector(job["sun"]).normalized())
    else: l = vector("NORMALIZE", vector("SUBTRACT", tuple(job["lamp"]), geometry.outputs["Position"]))
    h = vector("NORMALIZE", vector("ADD", v, l))
    schlick = scalar("POWER", scalar("SUBTRACT", 1.0, vector("DOT_PRODUCT", v, h)), 5.0)
    def fresnel(f0): return scalar("ADD", f0, scalar("MULTIPLY", 1.0 - f0, schlick))
    correction = 1.0
    if same_term:  # (1 + a)(1 + b) / (1 + a + b), with Smith's functions a and b of the light and of the view
        def smith(direction):
            cosine = scalar("MAXIMUM", vector("DOT_PRODUCT", n, direction), 1e-4)
            squared = scalar("MULTIPLY", cosine, cosine)
            tangent2 = scalar("DIVIDE", scalar("SUBTRACT", 1.0, squared), squared)
            root = scalar("SQRT", scalar("ADD", 1.0, scalar("MULTIPLY", roughness ** 4, tangent2)))
            return scalar("MULTIPLY", scalar("SUBTRACT", root, 1.0), 0.5)
        a, b = smith(l), smith(v)
        both = scalar("ADD", 1.0, scalar("ADD", a, b))
        correction = scalar("ADD", 1.0, scalar("DIVIDE", scalar("MULTIPLY", a, b), both))
    def shader(name, factor):
        node = nodes.new(name)
        grey = nodes.new("ShaderNodeCombineXYZ")
        for socket in grey.inputs: connect(socket, factor)
        links.new(grey.outputs[0], node.inputs["Color"])
        return node
    metal, dielectric = fresnel(job["base"]), fresnel(0.04)
    specular = scalar("ADD", scalar("MULTIPLY", metallic, metal), scalar("MULTIPLY", 1.0 - metallic, dielectric))
    glossy = shader("ShaderNodeBsdfGlossy", scalar("MULTIPLY", specular, correction))
    glossy.distribution = "GGX"
    glossy.inputs["Roughness"].default_value = roughness
    matte = (1.0 - metallic) * job["base"]
    diffuse = shader("ShaderNodeBsdfDiffuse", scalar("MULTIPLY", matte, scalar("SUBTRACT", 1.0, dielectric)))
    diffuse.inputs["Roughness"].default_value = 0
    both, out = nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeOutputMaterial")
    links.new(glossy.outputs[0], both.inputs[0])
    links.new(diffuse.outputs[0], both.inputs[1])
    links.new(both.outputs[0], out.inputs["Surface"])
    mesh.materials.clear()
    mesh.materials.append(made)

for case in job["cases"]:
    place(case["light"])
    material(case["light"], case["metallic"], case["roughness"], case["same_term"])
    scene.render.filepath = case["out"]
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(case["out"])
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(4 * job["size"] ** 2, np.float32)
    image.pixels.foreach_get(values)  # from the lowest row on
    np.save(case["out"] + ".npy", values.reshape(job["size"], job["size"], 4)[::-1, :, 1])
    bpy.data.images.remove(image)
'''


def seen_by_cycles(folder, cases, samples):
    vertices, triangles = sphere()
    np.savez(folder / "sphere.npz", vertices=vertices, triangles=triangles)
    job = {"size": SIZE, "focal": FOCAL, "distance": DISTANCE, "base": BASE, "sun": SUN, "lamp": LAMP, "area": AREA,
           "strength": STRENGTH, "samples": samples, "sphere": str(folder / "sphere.npz"), "cases": cases}
    for i, case in enumerate(cases):
        case["out"] = str(folder / f"{i}.exr")
    (folder / "job.json").write_text(json.dumps(job))
    (folder / "job.py").write_text(IN_BLENDER)
    subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", folder / "job.py", "--",
                    folder / "job.json"], check=True, stdout=subprocess.DEVNULL)
    return [np.load(case["out"] + ".npy") for case in cases]


def on_sphere():
    """Pixels whose rays hit the sphere, up to 98 % of its apparent radius: not its outline."""
    offset = (np.arange(SIZE) - (SIZE - 1) / 2) / FOCAL
    tangent = np.hypot(*np.meshgrid(offset, offset))
    return tangent < 0.98 * math.tan(math.asin(1 / DISTANCE))


def main():
    global COLUMNS
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, default=FOLDER / "build/release")
    parser.add_argument("--lights", default="sun,point,area,environment")
    parser.add_argument("--samples", type=int, default=2048, help="of Cycles for the area light")
    parser.add_argument("--roughness", type=float, nargs="+", default=ROUGHNESSES)
    parser.add_argument("--columns", type=int, default=COLUMNS)
    arguments = parser.parse_args()
    COLUMNS = arguments.columns
    lights = arguments.lights.split(",")
    cases = [{"light": light, "metallic": metallic, "roughness": roughness, "same_term": same_term}
             for light in lights if light != "environment" for metallic in (0, 1) for roughness in arguments.roughness
             for same_term in (False, True)]
    seen = on_sphere()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if "environment" in lights:
            print_environment(arguments.build / "bench/render_irradiance", folder)
        if not cases:
            return
        references = seen_by_cycles(folder, cases, arguments.samples)
        print("| light | material | roughness | as it is | same term | same term, of the rms radiance | mean radiance, esim / Cycles |")
        print("|---|---|---|---|---|---|---|")
        for i in range(0, len(cases), 2):
            case = cases[i]
            ours = seen_by_esim(arguments.build / "bench/render_irradiance", folder, case["light"], case["metallic"],
                                case["roughness"])[seen]
            errors = [math.sqrt(np.mean((ours - other[seen]) ** 2)) / np.mean(other[seen]) * 100
                      for other in references[i:i + 2]]
            relative = np.linalg.norm(ours - references[i + 1][seen]) / np.linalg.norm(references[i + 1][seen]) * 100
            ratio = np.mean(ours) / np.mean(references[i + 1][seen])
            kind = "metal" if case["metallic"] else "dielectric"
            print(f"| {case['light']} | {kind} | {case['roughness']} | {errors[0]:.2f} % | {errors[1]:.2f} % | "
                  f"{relative:.2f} % | {ratio:.4f} |")


if __name__ == "__main__":
    main()
