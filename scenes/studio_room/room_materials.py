"""Materials of the studio room, and the images that hang and lie in it."""
import bpy
import numpy as np


def principled(name, roughness, specular=0.35):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Specular"].default_value = specular
    return material, shader


class Graph:
    """Adds nodes to a material, with their inputs as numbers, colours or other nodes' outputs."""

    def __init__(self, material):
        self.tree = material.node_tree

    def set(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(socket, value)
        elif value is not None:
            socket.default_value = value

    def node(self, kind, inputs=None, **properties):
        node = self.tree.nodes.new("ShaderNode" + kind)
        for key, value in properties.items():
            setattr(node, key, value)
        for key, value in (inputs or {}).items():
            self.set(node.inputs[key], value)
        return node

    def coordinates(self, which="Object", scale=(1, 1, 1), turn=(0, 0, 0)):
        source = self.node("TexCoord").outputs[which]
        return self.node("Mapping", {"Vector": source, "Scale": scale, "Rotation": turn}).outputs["Vector"]

    def noise(self, vector, scale, detail=4.0, distortion=0.0):
        return self.node("TexNoise", {"Vector": vector, "Scale": scale, "Detail": detail, "Distortion": distortion}).outputs["Fac"]

    def ramp(self, value, *stops):
        node = self.node("ValToRGB", {"Fac": value})
        elements = node.color_ramp.elements
        while len(elements) < len(stops):
            elements.new(1.0)
        for element, (place, colour) in zip(elements, stops):
            element.position, element.color = place, (*colour, 1)
        return node.outputs["Color"]

    def mix(self, factor, one, other, how="MIX"):
        def rgba(value):
            return (*value, 1) if isinstance(value, tuple) and len(value) == 3 else value
        return self.node("MixRGB", {"Fac": factor, "Color1": rgba(one), "Color2": rgba(other)}, blend_type=how).outputs["Color"]

    def bump(self, shader, height, strength, distance=0.01):
        self.set(shader.inputs["Normal"], self.node("Bump", {"Height": height, "Strength": strength, "Distance": distance}).outputs["Normal"])


def shade(colour, factor):
    return tuple(min(1.0, factor * part) for part in colour)


def paint(name, colour, roughness):
    if name in bpy.data.materials:
        return bpy.data.materials[name]
    material, shader = principled(name, roughness)
    shader.inputs["Base Color"].default_value = (*colour, 1)
    return material


def plaster(name, colour):
    material, shader = principled(name, 0.85, 0.15)
    graph = Graph(material)
    where = graph.coordinates()
    blotches = graph.noise(where, 1.7, 6)
    graph.set(shader.inputs["Base Color"], graph.ramp(blotches, (0.3, shade(colour, 0.93)), (0.7, shade(colour, 1.04))))
    graph.bump(shader, graph.noise(where, 160, 3), 0.12, 0.004)
    return material


def wood(name, colour):
    material, shader = principled(name, 0.42)
    graph = Graph(material)
    where = graph.coordinates(scale=(9, 0.9, 9))
    grain = graph.noise(where, 2.2, 9, 1.6)
    graph.set(shader.inputs["Base Color"], graph.ramp(grain, (0.3, shade(colour, 0.5)), (0.5, colour), (0.68, shade(colour, 1.35))))
    graph.bump(shader, grain, 0.08, 0.004)
    return material


def planks():
    """Boards along x, 14 cm wide, each of its own tone, with grain, seams, and a satin varnish."""
    material, shader = principled("Planks", 0.38)
    graph = Graph(material)
    where = graph.coordinates()
    boards = graph.node("TexBrick", {"Vector": where, "Color1": (0, 0, 0, 1), "Color2": (1, 1, 1, 1), "Mortar": (0.5, 0.5, 0.5, 1),
                                     "Scale": 1.0, "Mortar Size": 0.0022, "Mortar Smooth": 0.2, "Bias": 0.0, "Brick Width": 1.3,
                                     "Row Height": 0.14}, offset=0.37, offset_frequency=2, squash=1.0)
    tone = boards.outputs["Color"]
    shifted = graph.node("VectorMath", {0: where, 1: graph.node("VectorMath", {0: tone, 1: (3.1, 7.7, 1.3)}, operation="MULTIPLY").outputs[0]},
                         operation="ADD").outputs[0]
    grain = graph.noise(graph.node("Mapping", {"Vector": shifted, "Scale": (1.1, 14, 1)}).outputs[0], 2.6, 9, 1.3)
    veins = graph.ramp(grain, (0.3, (0.20, 0.105, 0.047)), (0.5, (0.37, 0.21, 0.10)), (0.7, (0.46, 0.28, 0.145)))
    toned = graph.mix(0.55, veins, graph.ramp(tone, (0, (0.55, 0.50, 0.46)), (1, (1.0, 0.98, 0.95))), "MULTIPLY")
    graph.set(shader.inputs["Base Color"], graph.mix(boards.outputs["Fac"], toned, (0.04, 0.02, 0.01)))
    graph.set(shader.inputs["Roughness"], graph.ramp(grain, (0.3, (0.45,) * 3), (0.7, (0.3,) * 3)))
    graph.bump(shader, graph.mix(boards.outputs["Fac"], grain, (0.0, 0.0, 0.0)), 0.15, 0.004)
    return material


def cloth(name, colour, threads):
    material, shader = principled(name, 0.95, 0.1)
    shader.inputs["Sheen"].default_value = 0.3
    graph = Graph(material)
    where = graph.coordinates()
    weave = graph.noise(where, threads / 4, 2)
    wide = graph.noise(where, 5, 5)
    tone = graph.ramp(wide, (0.3, shade(colour, 0.85)), (0.7, shade(colour, 1.1)))
    graph.set(shader.inputs["Base Color"], graph.mix(0.5, tone, graph.ramp(weave, (0.3, (0.6,) * 3), (0.7, (1.0,) * 3)), "MULTIPLY"))
    graph.bump(shader, weave, 0.5, 0.003)
    return material


def stripes(name):
    material, shader = principled(name, 0.95, 0.1)
    graph = Graph(material)
    wave = graph.node("TexWave", {"Vector": graph.coordinates(), "Scale": 9.0, "Distortion": 0.3}, bands_direction="X").outputs["Fac"]
    graph.set(shader.inputs["Base Color"], graph.ramp(wave, (0.42, (0.72, 0.68, 0.6)), (0.5, (0.12, 0.19, 0.24))))
    return material


def skin(name, colour):
    """Of fruit, and of a globe's seas and lands."""
    material, shader = principled(name, 0.35)
    graph = Graph(material)
    spots = graph.noise(graph.coordinates(), 28, 5)
    graph.set(shader.inputs["Base Color"], graph.ramp(spots, (0.42, colour), (0.62, tuple(0.6 * part + 0.22 for part in colour))))
    return material


def book(name, colour):
    """Bands across the back, in gold."""
    material, shader = principled(name, 0.55)
    graph = Graph(material)
    height = graph.node("SeparateXYZ", {"Vector": graph.node("TexCoord").outputs["Generated"]}).outputs["Z"]
    bands = graph.ramp(height, (0.0, (0, 0, 0)), (0.74, (1, 1, 1)), (0.77, (0, 0, 0)), (0.80, (1, 1, 1)), (0.86, (0, 0, 0)), (0.13, (1, 1, 1)),
                       (0.16, (0, 0, 0)))
    bands.node.color_ramp.interpolation = "CONSTANT"
    worn = graph.ramp(graph.noise(graph.coordinates(), 14, 6), (0.35, shade(colour, 0.75)), (0.7, shade(colour, 1.2)))
    graph.set(shader.inputs["Base Color"], graph.mix(bands, worn, (0.62, 0.5, 0.26)))
    return material


def leaf():
    material, shader = principled("Leaf", 0.4)
    graph = Graph(material)
    across = graph.node("SeparateXYZ", {"Vector": graph.node("TexCoord").outputs["UV"]}).outputs["X"]
    middle = graph.node("Math", {0: graph.node("Math", {0: across, 1: 0.5}, operation="SUBTRACT").outputs[0]}, operation="ABSOLUTE").outputs[0]
    green = graph.ramp(graph.noise(graph.coordinates(), 9, 4), (0.3, (0.035, 0.10, 0.02)), (0.7, (0.09, 0.2, 0.04)))
    graph.set(shader.inputs["Base Color"], graph.mix(graph.ramp(middle, (0.02, (1, 1, 1)), (0.06, (0, 0, 0))), green, (0.2, 0.3, 0.1)))
    return material


def glow(name, colour, strength):
    material, shader = principled(name, 0.9)
    shader.inputs["Base Color"].default_value = (0.7, 0.65, 0.55, 1)
    shader.inputs["Emission"].default_value = (*colour, 1)
    shader.inputs["Emission Strength"].default_value = strength
    material.cycles.sample_as_light = False
    return material


def beach_ball():
    material, shader = principled("Beach ball", 0.3)
    graph = Graph(material)
    parts = graph.node("SeparateXYZ", {"Vector": graph.coordinates()}).outputs
    angle = graph.node("Math", {0: parts["Y"], 1: parts["X"]}, operation="ARCTAN2").outputs[0]
    turn = graph.node("Math", {0: angle, 1: 6 / (2 * np.pi)}, operation="MULTIPLY").outputs[0]
    place = graph.node("Math", {0: turn, 1: 6}, operation="ADD").outputs[0]
    part = graph.node("Math", {0: graph.node("Math", {0: place, 1: 1 / 3}, operation="MULTIPLY").outputs[0]}, operation="FRACT").outputs[0]
    colours = graph.ramp(part, (0.0, (0.62, 0.03, 0.02)), (1 / 3, (0.75, 0.74, 0.7)), (2 / 3, (0.02, 0.12, 0.42)))
    colours.node.color_ramp.interpolation = "CONSTANT"
    pole = graph.node("Math", {0: graph.node("Math", {0: parts["Z"]}, operation="ABSOLUTE").outputs[0], 1: 0.115}, operation="GREATER_THAN").outputs[0]
    graph.set(shader.inputs["Base Color"], graph.mix(pole, colours, (0.75, 0.6, 0.1)))
    return material


# --- images -----------------------------------------------------------------------------------------------------------

def picture(name, pixels, rough=0.6, weave=False):
    """An image, rows from the top, of sRGB values from 0 to 1, over a thing's texture coordinates."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new(name, width, height)
    image.pixels.foreach_set(np.dstack([pixels, np.ones((height, width))])[::-1].astype(np.float32).ravel())
    image.pack()
    material, shader = principled(name, rough, 0.1 if weave else 0.3)
    graph = Graph(material)
    texture = graph.node("TexImage", {"Vector": graph.node("TexCoord").outputs["UV"]}, image=image).outputs["Color"]
    if weave:
        pile = graph.noise(graph.coordinates(), 260, 2)
        texture = graph.mix(0.6, texture, graph.ramp(pile, (0.3, (0.55,) * 3), (0.7, (1.0,) * 3)), "MULTIPLY")
        graph.bump(shader, pile, 0.8, 0.004)
    graph.set(shader.inputs["Base Color"], texture)
    return material


def ridge(random, width, roughness=0.55):
    """A line of hills: sines of falling height, between -1 and 1 or so."""
    x = np.linspace(0, 2 * np.pi, width)
    line = sum(roughness ** k * np.sin(2 ** k * 0.7 * x + random.uniform(0, 6.28)) for k in range(7))
    return line / 1.6


def landscape(seed, warmth=0.0):
    """Ranges of hills that fade into the distance, under a low sun."""
    random = np.random.default_rng(seed)
    height, width = 200, 300
    y, x = np.mgrid[0:height, 0:width] / height
    sky, horizon = np.array([0.42 + 0.3 * warmth, 0.56, 0.70 - 0.25 * warmth]), np.array([0.95, 0.85 - 0.15 * warmth, 0.70 - 0.35 * warmth])
    image = sky + (horizon - sky) * np.clip(y / 0.6, 0, 1)[..., None]
    sun = np.hypot(x - random.uniform(0.4, 1.1), y - 0.36)
    image = image + np.clip(0.06 - sun, 0, 0.012)[..., None] / 0.012 * np.array([0.25, 0.2, 0.1])
    near = np.array([0.10 + 0.12 * warmth, 0.16, 0.17])
    for k in range(5):
        line = 0.42 + 0.11 * k + 0.07 * ridge(random, width)
        tone = horizon * 0.8 * (1 - (k + 1) / 5) + near * (k + 1) / 5
        inside = np.clip((y - line[None, :]) * height, 0, 1)[..., None]
        image = image * (1 - inside) + (tone * (1 + 0.12 * random.standard_normal((height, width, 1)) * 0.4)) * inside
    return np.clip(image, 0, 1)


def circles(seed):
    """Discs and bars that overlap, on paper."""
    random = np.random.default_rng(seed)
    height, width = 240, 190
    y, x = np.mgrid[0:height, 0:width] / width
    image = np.ones((height, width, 3)) * [0.9, 0.87, 0.8] + 0.015 * random.standard_normal((height, width, 1))
    inks = np.array([[0.82, 0.33, 0.22], [0.13, 0.27, 0.38], [0.9, 0.68, 0.28], [0.2, 0.45, 0.42], [0.12, 0.12, 0.13]])
    for k in range(9):
        ink, centre = inks[k % len(inks)], random.uniform((0.15, 0.2), (0.85, 1.05))
        if k % 3 == 2:
            slope = random.uniform(-0.6, 0.6)
            inside = np.abs(y - centre[1] - slope * (x - 0.5)) < 0.018
        else:
            inside = np.hypot(x - centre[0], y - centre[1]) < random.uniform(0.07, 0.22)
        image = np.where(inside[..., None], image * (0.15 + 0.85 * ink), image)
    return np.clip(image, 0, 1)


def carpet():
    """Borders and rows of lozenges in faded wool."""
    random = np.random.default_rng(2)
    height, width = 368, 272
    y, x = np.mgrid[0:height, 0:width]
    edge = np.minimum.reduce([x, y, width - 1 - x, height - 1 - y])
    red, cream, blue, ochre = np.array([[0.50, 0.17, 0.14], [0.80, 0.72, 0.58], [0.14, 0.20, 0.30], [0.72, 0.50, 0.22]])
    u, v = (x - width / 2) / 44.0, (y - height / 2) / 44.0
    lozenge = np.abs(((u + 0.5) % 1) - 0.5) + np.abs(((v + 0.5) % 1) - 0.5)
    step = np.floor(lozenge * 8)
    pattern = np.where((step == 6)[..., None], cream, np.where((step == 3)[..., None], ochre, np.where((step < 2)[..., None], blue, red)))
    zigzag = np.abs(((np.where(edge == np.minimum(x, width - 1 - x), y, x) / 16.0) % 1) - 0.5) * 20
    border = np.where((edge - 12 < zigzag)[..., None], blue, cream)
    image = np.where((edge < 34)[..., None], border, pattern)
    image = np.where(((edge < 7) | ((edge > 32) & (edge < 37)))[..., None], red * 0.8, image)
    return np.clip(image * (1 + 0.10 * random.standard_normal((height, width, 1))), 0, 1)


def garden():
    """What the window shows: bright sky, trees and a hedge, out of focus."""
    random = np.random.default_rng(4)
    height, width = 150, 260
    y, _x = np.mgrid[0:height, 0:width] / height
    image = np.array([0.75, 0.86, 0.98]) + (np.array([0.97, 0.97, 0.93]) - [0.75, 0.86, 0.98]) * np.clip(y / 0.6, 0, 1)[..., None]
    for base, tone in ((0.42, (0.55, 0.66, 0.52)), (0.52, (0.38, 0.52, 0.31)), (0.66, (0.26, 0.40, 0.20))):
        line = base + 0.10 * ridge(random, width, 0.72)
        inside = np.clip((y - line[None, :]) * 25, 0, 1)[..., None]
        image = image * (1 - inside) + np.array(tone) * (1 + 0.10 * random.standard_normal((height, width, 1))) * inside
    for _ in range(2):
        image = (image + np.roll(image, 1, 0) + np.roll(image, 1, 1) + np.roll(image, -1, 0) + np.roll(image, -1, 1)) / 5
    material = picture("Garden", np.clip(image, 0, 1))
    graph = Graph(material)
    texture = next(node for node in material.node_tree.nodes if node.type == "TEX_IMAGE").outputs["Color"]
    light = graph.node("Emission", {"Color": texture, "Strength": 2.2}).outputs["Emission"]
    graph.set(material.node_tree.nodes["Material Output"].inputs["Surface"], light)
    material.cycles.sample_as_light = False
    return material
