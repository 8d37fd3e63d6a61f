"""Make studio_room.blend: a furnished room in daylight, for the renderer `blender`.

    blender --background --factory-startup --python make_room.py [-- OUT.blend]

World: metres, z up, the origin on the floor in the middle of the room, the window at -x. Everything is computed here:
shapes in `room_shapes.py`, materials and images in `room_materials.py`. `Ball` is there to be moved.
"""
import math
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
sys.dont_write_bytecode = True

import bpy  # noqa: E402
import numpy as np  # noqa: E402

bpy.ops.wm.read_factory_settings(use_empty=True)

import room_materials as materials  # noqa: E402
from room_shapes import ball, box, group, lathe, rod, sheet  # noqa: E402

HALF_X, HALF_Y, HEIGHT = 2.6, 2.2, 2.7
WINDOW_Y, WINDOW_Z = (-0.95, 1.05), (0.85, 2.3)
random = np.random.default_rng(5)


def shell(wall, accent, white, floor):
    box("Floor", (2 * HALF_X, 2 * HALF_Y, 0.1), (0, 0, -0.05), floor)
    box("Ceiling", (2 * HALF_X, 2 * HALF_Y, 0.1), (0, 0, HEIGHT + 0.05), white)
    box("Back wall", (2 * HALF_X, 0.1, HEIGHT), (0, HALF_Y + 0.05, HEIGHT / 2), accent)
    box("Front wall", (2 * HALF_X, 0.1, HEIGHT), (0, -HALF_Y - 0.05, HEIGHT / 2), wall)
    box("Right wall", (0.1, 2 * HALF_Y, HEIGHT), (HALF_X + 0.05, 0, HEIGHT / 2), wall)
    (y0, y1), (z0, z1), x = WINDOW_Y, WINDOW_Z, -HALF_X - 0.1
    for name, (low, high, bottom, top) in {
            "below": (-HALF_Y, HALF_Y, 0, z0), "above": (-HALF_Y, HALF_Y, z1, HEIGHT),
            "before": (-HALF_Y, y0, z0, z1), "behind": (y1, HALF_Y, z0, z1)}.items():
        box("Wall " + name, (0.2, high - low, top - bottom), (x, (low + high) / 2, (bottom + top) / 2), wall)
    for side in (-1, 1):
        box("Skirting", (2 * HALF_X, 0.018, 0.09), (0, side * (HALF_Y - 0.009), 0.045), white, 0.004)
        box("Skirting", (0.018, 2 * HALF_Y, 0.09), (side * (HALF_X - 0.009), 0, 0.045), white, 0.004)


def window(white, metal, cloth):
    (y0, y1), (z0, z1) = WINDOW_Y, WINDOW_Z
    x = -HALF_X - 0.13
    for y in (y0 + 0.03, (y0 + y1) / 2, y1 - 0.03):
        box("Sash", (0.06, 0.06, z1 - z0), (x, y, (z0 + z1) / 2), white, 0.006)
    for z in (z0 + 0.03, z0 + 0.95, z1 - 0.03):
        box("Sash", (0.05, y1 - y0, 0.05), (x, (y0 + y1) / 2, z), white, 0.006)
    box("Sill", (0.32, y1 - y0 + 0.2, 0.04), (-HALF_X + 0.04, (y0 + y1) / 2, z0 - 0.02), white, 0.008)
    rod("Curtain rod", (-HALF_X + 0.09, y0 - 0.55, 2.45), (-HALF_X + 0.09, y1 + 0.55, 2.45), 0.012, metal)
    for low, high, phase in ((y0 - 0.5, y0 + 0.02, 0.4), (y1 - 0.02, y1 + 0.5, 1.9)):
        def fold(u, v, low=low, high=high, phase=phase):
            depth = (0.030 + 0.02 * (1 - v)) * np.sin(2 * np.pi * 6 * u + phase + 0.7 * np.sin(3 * v + phase))
            return -HALF_X + 0.09 + depth, low + (high - low) * u + 0.012 * np.sin(11 * u + 4 * v), 0.06 + 2.38 * v
        sheet("Curtain", fold, (121, 21), cloth, thickness=0.002)


def table(wood, dark, white):
    with group("Table", (-0.85, 0.05, 0)):
        box("Top", (0.85, 1.5, 0.035), (0, 0, 0.735), wood, 0.008)
        box("Apron", (0.7, 1.3, 0.07), (0, 0, 0.68), dark, 0.004)
        for x in (-0.35, 0.35):
            for y in (-0.66, 0.66):
                rod("Leg", (x, y, 0), (x * 0.94, y * 0.94, 0.72), 0.024, dark)
    with group("Cup", (-0.72, -0.28, 0.753)):
        lathe("Cup", [(0.0, 0.004), (0.03, 0.0), (0.034, 0.01), (0.042, 0.05), (0.043, 0.09), (0.039, 0.09), (0.037, 0.05),
                      (0.03, 0.012), (0.0, 0.01)], materials.paint("Glaze", (0.05, 0.16, 0.24), 0.15))
        lathe("Coffee", [(0.0, 0.07), (0.0385, 0.07)], materials.paint("Coffee", (0.03, 0.012, 0.005), 0.1))
        lathe("Saucer", [(0.0, 0.001), (0.05, 0.002), (0.075, 0.012), (0.072, 0.014), (0.05, 0.006), (0, 0.005)], white)
    with group("Bowl", (-0.95, 0.28, 0.753)):
        lathe("Bowl", [(0.0, 0.002), (0.06, 0.0), (0.11, 0.04), (0.15, 0.085), (0.146, 0.087), (0.105, 0.045), (0.055, 0.008),
                       (0.0, 0.008)], materials.paint("Stoneware", (0.62, 0.58, 0.5), 0.35))
        for i, (x, y, z, colour) in enumerate(((0.05, 0.0, 0.062, (0.75, 0.24, 0.02)), (-0.04, 0.045, 0.062, (0.45, 0.03, 0.02)),
                                               (-0.035, -0.045, 0.062, (0.72, 0.26, 0.02)), (0.01, 0.0, 0.125, (0.35, 0.42, 0.05)))):
            ball(f"Fruit {i}", 0.041, (x, y, z), materials.skin(f"Fruit {i}", colour))
    with group("Reading", (-0.78, -0.02, 0.753), 0.45):
        box("Magazine", (0.21, 0.28, 0.008), (0, 0, 0.004), materials.picture("Magazine", materials.landscape(11, 0.62)), 0.001)
        box("Notebook", (0.15, 0.21, 0.014), (0.01, 0.02, 0.015), materials.paint("Notebook", (0.35, 0.05, 0.04), 0.6), 0.003)
        rod("Pencil", (-0.07, -0.12, 0.012), (0.06, -0.09, 0.012), 0.0035, materials.paint("Pencil", (0.8, 0.5, 0.03), 0.4))
    with group("Vase", (-0.95, 0.58, 0.753)):
        lathe("Vase", [(0, 0), (0.045, 0), (0.065, 0.06), (0.06, 0.12), (0.03, 0.19), (0.034, 0.22), (0.030, 0.22), (0.026, 0.19),
                       (0.02, 0.15)], materials.paint("Clay", (0.55, 0.22, 0.12), 0.5))
        for i in range(9):
            angle, lean, length = random.uniform(0, 6.28), random.uniform(0.05, 0.16), random.uniform(0.28, 0.42)
            tip = (lean * math.cos(angle), lean * math.sin(angle), 0.15 + length)
            rod(f"Stalk {i}", (0, 0, 0.16), tip, 0.0022, materials.paint("Stalk", (0.12, 0.2, 0.05), 0.7))
            ball(f"Bloom {i}", 0.022, tip, materials.paint(f"Bloom {i % 3}", ((0.8, 0.7, 0.3), (0.75, 0.35, 0.3), (0.8, 0.78, 0.7))[i % 3], 0.8),
                 (1, 1, 0.8))


def chair(name, place, turn, wood, seat):
    with group(name, place, turn):
        box("Seat", (0.42, 0.42, 0.03), (0, 0, 0.45), seat, 0.012)
        for x, y in ((-0.18, -0.18), (0.18, -0.18)):
            rod("Leg", (1.1 * x, 1.1 * y, 0), (x, y, 0.45), 0.016, wood)
        for x in (-0.18, 0.18):
            rod("Post", (1.1 * x, 0.22, 0), (x, 0.18, 0.45), 0.016, wood)
            rod("Post", (x, 0.18, 0.45), (x, 0.24, 0.88), 0.014, wood)
        for z, y in ((0.60, 0.201), (0.84, 0.234)):
            box("Rail", (0.38, 0.02, 0.07 if z > 0.8 else 0.035), (0, y, z), wood, 0.006)
        for x in np.linspace(-0.12, 0.12, 4):
            rod("Spindle", (x, 0.185, 0.46), (x, 0.231, 0.82), 0.007, wood)
        for side in (-1, 1):
            rod("Stretcher", (side * 0.19, -0.19, 0.2), (side * 0.19, 0.2, 0.2), 0.009, wood)


def bookcase(wood, white):
    width, depth, height, boards = 1.3, 0.28, 2.0, 5
    with group("Bookcase", (-0.75, HALF_Y - depth / 2 - 0.005, 0)):
        for x in (-width / 2, 0, width / 2):
            box("Side", (0.025, depth, height), (x, 0, height / 2), wood, 0.002)
        box("Back", (width, 0.01, height), (0, depth / 2 - 0.005, height / 2), wood)
        levels = np.linspace(0.06, height - 0.0125, boards + 1)
        for z in levels:
            box("Board", (width, depth, 0.025), (0, 0, z), wood, 0.002)
        colours = [(0.35, 0.05, 0.04), (0.03, 0.09, 0.2), (0.07, 0.16, 0.09), (0.6, 0.5, 0.34), (0.5, 0.27, 0.06), (0.7, 0.67, 0.6),
                   (0.03, 0.03, 0.035), (0.12, 0.05, 0.12), (0.6, 0.12, 0.04), (0.15, 0.27, 0.33)]
        covers = [materials.book(f"Cover {i}", colour) for i, colour in enumerate(colours)]
        for level in range(boards):
            for half in (0, 1):
                fill_shelf(-width / 2 + 0.02 + half * width / 2, width / 2 - 0.045, levels[level] + 0.0125,
                           levels[level + 1] - levels[level] - 0.03, depth, covers, bare=(level + 2 * half) % 5 == 3)
        with group("Pot", (0.3, -0.02, levels[3] + 0.0125)):
            lathe("Jar", [(0, 0), (0.06, 0), (0.095, 0.07), (0.085, 0.15), (0.045, 0.19), (0.05, 0.21), (0.044, 0.21), (0.04, 0.19)], white)
        ball("Globe", 0.09, (-0.4, -0.02, levels[2] + 0.105), materials.skin("Globe", (0.09, 0.2, 0.3)))


def fill_shelf(x, length, z, room, depth, covers, bare):
    end = x + length
    x += 0.26 if bare else 0.0
    while True:
        width, tall, deep = random.uniform(0.014, 0.048), room * random.uniform(0.62, 0.95), random.uniform(0.15, 0.21)
        if x + width > end - (0.12 if random.random() < 0.1 else 0):
            return
        cover = covers[random.integers(len(covers))]
        lean = random.choice([0, 0, 0, 0, 0, 0.06])
        book = box("Book", (width, deep, tall), (x + width / 2 + lean * tall / 2, -depth / 2 + 0.02 + deep / 2, z + tall / 2), cover, 0.003)
        book.rotation_euler = (0, lean, 0)
        x += width + 0.0015 + lean * tall


def sofa(cloth, cushion, wood):
    with group("Sofa", (2.1, 0.15, 0), -math.pi / 2):
        box("Base", (1.9, 0.85, 0.2), (0, 0, 0.25), cloth, 0.04)
        box("Back", (1.9, 0.22, 0.5), (0, 0.33, 0.55), cloth, 0.08)
        for side in (-1, 1):
            box("Arm", (0.2, 0.85, 0.42), (side * 0.86, 0, 0.42), cloth, 0.07)
            box("Seat", (0.74, 0.62, 0.17), (side * 0.375, -0.1, 0.42), cloth, 0.06)
            for y in (-0.36, 0.36):
                rod("Foot", (side * 0.86, y, 0), (side * 0.84, y * 0.95, 0.16), 0.02, wood)
        for x, turn, material in ((-0.52, 0.15, cushion), (0.5, -0.2, materials.stripes("Striped"))):
            pillow = ball("Cushion", 0.24, (x, 0.12, 0.66), material, (1, 0.36, 0.92), square=0.55)
            pillow.rotation_euler = (-0.35, 0.1, turn)


def lamp(metal):
    shade = materials.glow("Shade", (1.0, 0.72, 0.42), 1.3)
    with group("Lamp", (2.2, 1.6, 0)):
        lathe("Foot", [(0, 0.025), (0.12, 0.022), (0.14, 0.008), (0.14, 0), (0, 0)], metal)
        rod("Stem", (0, 0, 0.02), (0, 0, 1.45), 0.010, metal)
        lathe("Lampshade", [(0.2, 1.36), (0.13, 1.68), (0.128, 1.68), (0.198, 1.36)], shade)


def plant():
    pot, soil = materials.paint("Pot", (0.66, 0.64, 0.6), 0.45), materials.paint("Soil", (0.03, 0.02, 0.012), 0.95)
    leaf, stalk = materials.leaf(), materials.paint("Stem", (0.07, 0.13, 0.03), 0.6)
    with group("Plant", (1.25, 1.75, 0)):
        lathe("Pot", [(0, 0), (0.13, 0), (0.17, 0.3), (0.155, 0.3), (0.15, 0.27), (0, 0.27)], pot)
        lathe("Soil", [(0, 0.262), (0.149, 0.262)], soil)
        for i in range(22):
            angle, rise = i * 2.39996 + random.uniform(-0.3, 0.3), 0.45 + 0.045 * i + random.uniform(-0.05, 0.05)
            reach = 0.2 + 0.22 * math.sin(math.pi * (0.25 + 0.7 * i / 22))
            base = np.array([0.05 * math.cos(angle), 0.05 * math.sin(angle), 0.26])
            out = np.array([math.cos(angle), math.sin(angle), 0])
            tip = base * [1, 1, 0] + out * reach * 0.55 + [0, 0, rise]
            rod(f"Stem {i}", base, tip, 0.005, stalk)
            side = np.array([-out[1], out[0], 0])
            length, wide = random.uniform(0.26, 0.36), random.uniform(0.055, 0.085)

            def blade(u, v, tip=tip, out=out, side=side, length=length, wide=wide):
                half = wide * np.sin(np.pi * np.clip(v * 0.97 + 0.03, 0, 1)) ** 0.7
                across, along = (2 * u - 1) * half, length * v
                drop = 0.10 * v - 0.9 * length * v ** 2 + 0.5 * np.abs(across)
                point = tip[:, None, None] + out[:, None, None] * along + side[:, None, None] * across
                return point[0], point[1], point[2] + drop
            sheet(f"Leaf {i}", blade, (9, 15), leaf)


def pictures(frame, mat):
    def hang(name, middle, width, height, image, along_y=False):
        # Built against the back wall, turned onto the right one.
        with group(name, middle, -math.pi / 2 if along_y else 0):
            box("Canvas", (width, 0.004, height), (0, -0.012, 0), materials.picture(name, image), 0)
            box("Mat", (width + 0.09, 0.006, height + 0.09), (0, -0.006, 0), mat)
            for side in (-1, 1):
                box("Frame", (width + 0.13, 0.03, 0.025), (0, -0.015, side * (height / 2 + 0.052)), frame, 0.003)
                box("Frame", (0.025, 0.03, height + 0.13), (side * (width / 2 + 0.052), -0.015, 0), frame, 0.003)
    hang("Mountains", (0.42, HALF_Y, 1.65), 0.62, 0.42, materials.landscape(3))
    hang("Circles", (1.12, HALF_Y, 1.78), 0.36, 0.46, materials.circles(8))
    hang("Evening", (HALF_X, 0.5, 1.62), 0.8, 0.5, materials.landscape(17, 0.45), True)
    hang("Shapes", (HALF_X, -0.45, 1.62), 0.38, 0.5, materials.circles(21), True)


def add_light(name, kind, energy, colour, place, turn, bounces, size=None):
    """Not seen itself. `bounces`: how often its light is followed from wall to wall."""
    light = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
    light.data.energy, light.data.color, light.data.cycles.max_bounces = energy, colour, bounces
    light.location, light.rotation_euler, light.visible_camera = place, turn, False
    if size is not None:
        light.data.shape, (light.data.size, light.data.size_y) = "RECTANGLE", size
    bpy.context.scene.collection.objects.link(light)
    return light


def lights():
    """Sun and sky through the window. What they would throw back from floor and ceiling comes from two wide panels that
    are not seen: they cost a path tracer less noise than the bounces they stand for."""
    (y0, y1), (z0, z1) = WINDOW_Y, WINDOW_Z
    add_light("Sky", "AREA", 150, (0.90, 0.95, 1.0), (-HALF_X - 0.21, (y0 + y1) / 2, (z0 + z1) / 2), (0, -math.pi / 2 + 0.12, 0), 1,
              (z1 - z0, y1 - y0))
    sun = add_light("Sun", "SUN", 6.5, (1.0, 0.87, 0.68), (0, 0, 3), (0, math.radians(-52), math.radians(-17)), 0)
    sun.data.angle = math.radians(1.2)
    for name, energy, colour, height, turn in (("From ceiling", 90, (1.0, 0.98, 0.95), HEIGHT - 0.03, 0),
                                               ("From floor", 50, (1.0, 0.93, 0.82), 0.03, math.pi)):
        panel = add_light(name, "AREA", energy, colour, (0, 0, height), (turn, 0, 0), 0, (2 * HALF_X - 0.4, 2 * HALF_Y - 0.4))
        panel.visible_glossy = False
    garden = box("Garden", (0.02, 12, 7), (-7.5, 0, 1.6), materials.garden())
    garden.visible_shadow = garden.visible_diffuse = False
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.93, 0.95, 1, 1)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.75
    world.cycles.sampling_method = "NONE"
    bpy.context.scene.world = world


def build():
    wood, dark = materials.wood("Oak", (0.42, 0.24, 0.11)), materials.wood("Walnut", (0.14, 0.065, 0.03))
    white = materials.paint("White", (0.8, 0.79, 0.76), 0.45)
    metal = materials.paint("Iron", (0.03, 0.03, 0.032), 0.35)
    cloth = materials.cloth("Linen", (0.70, 0.66, 0.58), 700)
    shell(materials.plaster("Plaster", (0.74, 0.71, 0.65)), materials.plaster("Sage", (0.30, 0.37, 0.31)), white, materials.planks())
    window(white, metal, cloth)
    table(wood, dark, white)
    chair("Chair", (-0.12, 0.1, 0), -math.pi / 2 - 0.35, dark, wood)
    chair("Other chair", (-0.85, -0.98, 0), math.pi + 0.15, dark, wood)
    bookcase(dark, white)
    sofa(materials.cloth("Wool", (0.13, 0.17, 0.20), 500), materials.cloth("Mustard", (0.62, 0.36, 0.06), 600), dark)
    lamp(metal)
    plant()
    pictures(metal, white)
    box("Carpet", (1.7, 2.3, 0.014), (0.55, -0.05, 0.008), materials.picture("Carpet", materials.carpet(), rough=0.95, weave=True), 0.004)
    with group("Ball", (0.75, 0.35, 0.145)):
        ball("Ball", 0.13, (0, 0, 0), materials.beach_ball())
    lights()


def camera():
    eye = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    eye.data.angle, eye.data.clip_start = math.radians(72), 0.01
    eye.location, eye.rotation_euler = (1.55, -2.0, 1.5), (math.radians(81), 0, math.radians(27))
    bpy.context.scene.collection.objects.link(eye)
    bpy.context.scene.camera = eye


def settings():
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 640, 480
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = 64, False, False
    # What costs little light and much noise is left out: long paths, caustics, and sparks.
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 3, 2, 2
    cycles.use_fast_gi, cycles.fast_gi_method, cycles.ao_bounces_render = True, "REPLACE", 1
    scene.world.light_settings.distance, scene.world.light_settings.ao_factor = 0.8, 1.0
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.sample_clamp_indirect, cycles.blur_glossy = 3.0, 1.0
    scene.view_settings.view_transform = "Standard"


build()
camera()
settings()
arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
target = os.path.abspath(arguments[0]) if arguments else os.path.join(HERE, "studio_room.blend")
bpy.context.preferences.filepaths.save_version = 0
bpy.ops.wm.save_as_mainfile(filepath=target, compress=True)
