"""Writes binary glTF 2.0 files: textured meshes, skins and animations, with NumPy and zlib only.

Scenes are made with z up, as in esim; glTF has y up, so that (x, y, z) is written as (x, z, -y).
"""
import json
import struct
import zlib

import numpy as np

FLOAT, BYTE, SHORT, INT = 5126, 5121, 5123, 5125  # componentType
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963


def y_up(vectors):
    v = np.asarray(vectors, float)
    return np.stack([v[..., 0], v[..., 2], -v[..., 1]], -1)


def y_up_quaternions(q):
    """The same change of axes for quaternions x y z w."""
    return np.concatenate([y_up(q[..., :3]), q[..., 3:]], -1)


def png(image):
    """An image of 8 bits, (height, width, 3), as the bytes of a PNG file. Each row is stored as differences from the one above."""
    image = np.ascontiguousarray(image, np.uint8)
    height, width = image.shape[:2]
    rows = image.reshape(height, -1)
    up = np.vstack([rows[:1], rows[1:] - rows[:-1]])
    raw = np.hstack([np.full((height, 1), 2, np.uint8), up]).tobytes()

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


class Glb:
    """A glTF document under construction. Methods that add something return its index."""

    def __init__(self):
        self.document = {"asset": {"version": "2.0", "generator": "esim scenes"}, "scene": 0, "scenes": [{"nodes": []}]}
        self.binary = bytearray()

    def add(self, kind, **value):
        values = self.document.setdefault(kind, [])
        values.append(value)
        return len(values) - 1

    def view(self, data, **more):
        self.binary.extend(b"\0" * (-len(self.binary) % 4))
        offset = len(self.binary)
        self.binary.extend(data)
        return self.add("bufferViews", buffer=0, byteOffset=offset, byteLength=len(data), **more)

    def accessor(self, values, component, kind, target=None, normalized=False, bounds=False):
        dtype = {FLOAT: "<f4", BYTE: "u1", SHORT: "<u2", INT: "<u4"}[component]
        array = np.ascontiguousarray(values, dtype)
        more = {"normalized": True} if normalized else {}
        if bounds:
            rows = array.reshape(len(array), -1)
            more.update(min=[float(v) for v in rows.min(0)], max=[float(v) for v in rows.max(0)])
        view = self.view(array.tobytes(), **({"target": target} if target else {}))
        return self.add("accessors", bufferView=view, componentType=component, count=len(array), type=kind, **more)

    def material(self, name, image=None, colour=(1, 1, 1), metallic=0.0, roughness=0.8):
        """`image` is (height, width, 3) in sRGB, `colour` a linear factor."""
        pbr = {"baseColorFactor": [*map(float, colour), 1.0], "metallicFactor": metallic, "roughnessFactor": roughness}
        if image is not None:
            source = self.add("images", name=name, mimeType="image/png", bufferView=self.view(png(image)))
            pbr["baseColorTexture"] = {"index": self.add("textures", source=source)}
        return self.add("materials", name=name, pbrMetallicRoughness=pbr)

    def mesh(self, name, surfaces):
        """`surfaces`: pairs of a Surface and the index of its material."""
        return self.add("meshes", name=name, primitives=[self.primitive(s, material) for s, material in surfaces])

    def primitive(self, surface, material):
        attributes = {
            "POSITION": self.accessor(y_up(surface.points), FLOAT, "VEC3", ARRAY_BUFFER, bounds=True),
            "NORMAL": self.accessor(y_up(surface.normals), FLOAT, "VEC3", ARRAY_BUFFER),
            "TEXCOORD_0": self.accessor(surface.uv, FLOAT, "VEC2", ARRAY_BUFFER),
        }
        if surface.joints is not None:
            attributes["JOINTS_0"] = self.accessor(surface.joints, BYTE, "VEC4", ARRAY_BUFFER)
            attributes["WEIGHTS_0"] = self.accessor(surface.weights, SHORT, "VEC4", ARRAY_BUFFER, normalized=True)
        indices = self.accessor(surface.triangles.ravel(), SHORT if len(surface.points) < 65535 else INT, "SCALAR",
                                ELEMENT_ARRAY_BUFFER)
        return {"attributes": attributes, "indices": indices, "material": material}

    def node(self, root=True, **value):
        index = self.add("nodes", **value)
        if root:
            self.document["scenes"][0]["nodes"].append(index)
        return index

    def skeleton(self, joints):
        """Nodes for joints [(name, parent or None, position at rest)], all with axes along the world's at rest. Returns the skin."""
        first = len(self.document.get("nodes", []))
        positions = np.array([position for _, _, position in joints])
        for name, parent, position in joints:
            offset = np.asarray(position) - (0 if parent is None else positions[parent])
            children = [first + k for k, other in enumerate(joints) if other[1] == len(self.document.get("nodes", [])) - first]
            self.node(root=parent is None, name=name, translation=[float(v) for v in y_up(offset)],
                      **({"children": children} if children else {}))
        inverse = np.tile(np.eye(4), (len(joints), 1, 1))
        inverse[:, 3, :3] = -y_up(positions)  # columns first
        matrices = self.accessor(inverse.reshape(-1, 16), FLOAT, "MAT4")
        return self.add("skins", joints=list(range(first, first + len(joints))), skeleton=first, inverseBindMatrices=matrices)

    def animation(self, name, times, rotations, translations):
        """`rotations`: {node: (times, 4) quaternions}; `translations`: {node: (times, 3)}; between them, linear."""
        clock = self.accessor(times, FLOAT, "SCALAR", bounds=True)
        samplers, channels = [], []
        tracks = [(node, "translation", "VEC3", y_up(v)) for node, v in translations.items()]
        tracks += [(node, "rotation", "VEC4", y_up_quaternions(v)) for node, v in rotations.items()]
        for node, path, kind, values in tracks:
            channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
            samplers.append({"input": clock, "output": self.accessor(values, FLOAT, kind), "interpolation": "LINEAR"})
        return self.add("animations", name=name, samplers=samplers, channels=channels)

    def write(self, path):
        self.binary.extend(b"\0" * (-len(self.binary) % 4))
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        with open(path, "wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(self.binary)))
            file.write(struct.pack("<I4s", len(text), b"JSON") + text)
            file.write(struct.pack("<I4s", len(self.binary), b"BIN\0") + self.binary)
