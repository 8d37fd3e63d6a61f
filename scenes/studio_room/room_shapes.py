"""Shapes of the studio room: each call links one object to the scene and returns it."""
import bpy
import numpy as np
from mathutils import Matrix, Vector


class group:
    """`with group(name, place, turn):` hangs what is made inside on one empty; groups may be nested."""

    open = []

    def __init__(self, name, place, turn=0.0):
        self.empty = bpy.data.objects.new(name, None)
        self.empty.location, self.empty.rotation_euler = place, (0, 0, turn)

    def __enter__(self):
        link(self.empty)
        group.open.append(self.empty)
        return self.empty

    def __exit__(self, *_):
        group.open.pop()


def link(thing):
    bpy.context.scene.collection.objects.link(thing)
    if group.open:
        thing.parent = group.open[-1]


def shape(name, vertices, faces, material, smooth=False, uv=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], faces)
    mesh.materials.append(material)
    if smooth:
        mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    if uv is not None:
        layer = mesh.uv_layers.new(name="UV")
        for loop in mesh.loops:
            layer.data[loop.index].uv = uv[loop.vertex_index]
    mesh.update()
    # Several things may bear one name: what hangs on a group is told from others by the group's.
    thing = bpy.data.objects.new(name if not group.open else f"{group.open[-1].name}: {name}", mesh)
    link(thing)
    return thing


def box(name, size, place, material, bevel=0.0):
    """Its texture coordinates cover the front and the top once each."""
    x, y, z = (0.5 * side for side in size)
    corners = [(i * x, j * y, k * z) for k in (-1, 1) for j in (-1, 1) for i in (-1, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    thing = shape(name, corners, faces, material)
    layer = thing.data.uv_layers.new(name="UV")
    for polygon in thing.data.polygons:
        normal = np.abs(polygon.normal)
        across, up = {0: (1, 2), 1: (0, 2), 2: (0, 1)}[int(np.argmax(normal))]
        for loop in polygon.loop_indices:
            corner = thing.data.vertices[thing.data.loops[loop].vertex_index].co
            layer.data[loop].uv = (corner[across] / size[across] + 0.5, corner[up] / size[up] + 0.5)
    thing.location = place
    if bevel > 0:
        modifier = thing.modifiers.new("Bevel", "BEVEL")
        modifier.width, modifier.segments = bevel, 4 if bevel > 0.02 else 2
        if bevel > 0.02:
            thing.data.polygons.foreach_set("use_smooth", [True] * len(thing.data.polygons))
            thing.data.use_auto_smooth = True
    return thing


def lathe(name, profile, material, segments=40):
    """A profile of (radius, height) turned around z."""
    angles = 2 * np.pi * np.arange(segments) / segments
    vertices = [(r * np.cos(a), r * np.sin(a), z) for r, z in profile for a in angles]
    faces = [(row * segments + i, row * segments + (i + 1) % segments, (row + 1) * segments + (i + 1) % segments,
              (row + 1) * segments + i) for row in range(len(profile) - 1) for i in range(segments)]
    thing = shape(name, vertices, faces, material, smooth=True)
    thing.data.use_auto_smooth, thing.data.auto_smooth_angle = True, 0.7
    return thing


def rod(name, begin, end, radius, material):
    begin, end = Vector(begin), Vector(end)
    length = (end - begin).length
    thing = lathe(name, [(0, 0), (radius, 0), (radius, length), (0, length)], material, 14)
    thing.matrix_local = Matrix.Translation(begin) @ (end - begin).to_track_quat("Z", "Y").to_matrix().to_4x4()
    return thing


def ball(name, radius, place, material, stretch=(1, 1, 1), square=1.0):
    """`square` below 1 swells it towards a box, as a cushion."""
    rows, columns = 25, 48
    v, u = np.meshgrid(np.linspace(-0.5, 0.5, rows) * np.pi, np.arange(columns) * 2 * np.pi / columns, indexing="ij")
    point = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)
    point = np.sign(point) * np.abs(point) ** [square, 1, square] * radius * np.array(stretch)
    faces = [(r * columns + c, r * columns + (c + 1) % columns, (r + 1) * columns + (c + 1) % columns, (r + 1) * columns + c)
             for r in range(rows - 1) for c in range(columns)]
    thing = shape(name, point.reshape(-1, 3), faces, material, smooth=True)
    thing.location = place
    return thing


def sheet(name, surface, size, material, thickness=0.0):
    """A surface (u, v) -> (x, y, z), u and v from 0 to 1, of size[0] x size[1] vertices."""
    u, v = np.meshgrid(np.linspace(0, 1, size[0]), np.linspace(0, 1, size[1]), indexing="ij")
    x, y, z = np.broadcast_arrays(*surface(u, v))
    faces = [(i * size[1] + j, (i + 1) * size[1] + j, (i + 1) * size[1] + j + 1, i * size[1] + j + 1)
             for i in range(size[0] - 1) for j in range(size[1] - 1)]
    thing = shape(name, np.stack([x, y, z], axis=-1).reshape(-1, 3), faces, material, smooth=True,
                  uv=np.stack([u, v], axis=-1).reshape(-1, 2))
    if thickness > 0:
        thing.modifiers.new("Solid", "SOLIDIFY").thickness = thickness
    return thing
