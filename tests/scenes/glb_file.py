"""Reads a binary glTF file and poses its skin, independently of the scripts that write such files: as the specification says."""

import json
import struct

import numpy as np

COMPONENTS = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class GlbFile:
    def __init__(self, data):
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data)), "header of the file"
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON", kind
        self.document = json.loads(data[20:20 + size])
        self.binary = data[20 + size + 8:]

    def array(self, index):
        accessor = self.document["accessors"][index]
        view = self.document["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        width = WIDTHS[accessor["type"]]
        values = np.frombuffer(self.binary, COMPONENTS[accessor["componentType"]], accessor["count"] * width, start).reshape(-1, width)
        if "min" in accessor:
            np.testing.assert_allclose(values.min(0), accessor["min"], atol=1e-6)
            np.testing.assert_allclose(values.max(0), accessor["max"], atol=1e-6)
        if accessor.get("normalized"):
            values = values / np.iinfo(values.dtype).max
        return values

    def skinned(self):
        """Pairs of the name of a material and the primitive, of the meshes that have a skin."""
        for node in self.document["nodes"]:
            if "skin" in node:
                for primitive in self.document["meshes"][node["mesh"]]["primitives"]:
                    yield self.document["materials"][primitive["material"]]["name"], primitive

    def pose(self, t):
        """Matrices of the nodes in the world at a time of the first animation."""
        nodes = self.document["nodes"]
        local = [{"translation": np.array(n.get("translation", (0, 0, 0)), float), "rotation": np.array(n.get("rotation", (0, 0, 0, 1)), float)} for n in nodes]
        for channel in self.document["animations"][0]["channels"]:
            sampler = self.document["animations"][0]["samplers"][channel["sampler"]]
            times, values = self.array(sampler["input"])[:, 0], self.array(sampler["output"]).astype(float)
            t_in = np.clip(t, times[0], times[-1])
            k = min(np.searchsorted(times, t_in, "right") - 1, len(times) - 2)
            f = (t_in - times[k]) / (times[k + 1] - times[k])
            a, b, path = values[k], values[k + 1], channel["target"]["path"]
            if path == "rotation":
                cosine = a @ b
                b, cosine = (b, cosine) if cosine >= 0 else (-b, -cosine)
                angle = np.arccos(min(cosine, 1.0))
                value = a if angle < 1e-9 else (np.sin((1 - f) * angle) * a + np.sin(f * angle) * b) / np.sin(angle)
            else:
                value = (1 - f) * a + f * b
            local[channel["target"]["node"]][path] = value
        world = [None] * len(nodes)
        parents = {child: parent for parent, node in enumerate(nodes) for child in node.get("children", ())}

        def resolve(k):
            if world[k] is None:
                x, y, z, w = local[k]["rotation"]
                m = np.eye(4)
                m[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                             [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                             [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
                m[:3, 3] = local[k]["translation"]
                world[k] = resolve(parents[k]) @ m if k in parents else m
            return world[k]

        return [resolve(k) for k in range(len(nodes))]

    def inverse_bind(self):
        return self.array(self.document["skins"][0]["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1).astype(float)

    def vertices(self, primitive, t):
        """Positions of a skinned primitive in esim's world (z up)."""
        attributes = primitive["attributes"]
        rest = self.array(attributes["POSITION"]).astype(float)
        world = self.pose(t)
        joints = [world[node] @ inverse for node, inverse in zip(self.document["skins"][0]["joints"], self.inverse_bind())]
        matrices = np.array(joints)[self.array(attributes["JOINTS_0"])]
        weights = self.array(attributes["WEIGHTS_0"])
        at = np.einsum("nk,nkij,nj->ni", weights, matrices, np.hstack([rest, np.ones((len(rest), 1))]))
        return np.stack([at[:, 0], -at[:, 2], at[:, 1]], -1)
