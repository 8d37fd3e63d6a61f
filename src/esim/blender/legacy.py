# When Blender opens materials of its former internal renderer (before 2.80), it drops their textures. The file still
# contains them and describes its own layout; this module reads them from the file.
import gzip
import struct

import bpy


class BlendFile:
    """The blocks of a .blend file: data[address] = (struct, bytes)."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        if data[:2] == b"\x1f\x8b":
            data = gzip.decompress(data)
        if data[:7] != b"BLENDER":
            raise ValueError("this is not a .blend file, or its compression is not supported")
        self.pointer = 8 if data[7:8] == b"-" else 4
        self.order = "<" if data[8:9] == b"v" else ">"
        self.blocks = {}
        head = struct.Struct(self.order + "4sI" + ("Q" if self.pointer == 8 else "I") + "II")
        at, dna = 12, None
        while at + head.size <= len(data):
            code, size, address, kind, _ = head.unpack_from(data, at)
            at += head.size
            code = code.rstrip(b"\0")
            if code == b"DNA1":
                dna = data[at:at + size]
            self.blocks[address] = (code.decode(), kind, data[at:at + size])
            at += size
        self._read_layout(dna)

    def _read_layout(self, dna):
        at = 4

        def texts():
            nonlocal at
            at += 4
            count, = struct.unpack_from(self.order + "I", dna, at)
            at += 4
            result = []
            for _ in range(count):
                end = dna.index(b"\0", at)
                result.append(dna[at:end].decode())
                at = end + 1
            at = (at + 3) // 4 * 4
            return result

        names, types = texts(), texts()
        at += 4
        lengths = struct.unpack_from(f"{self.order}{len(types)}H", dna, at)
        at = (at + 2 * len(types) + 3) // 4 * 4 + 4
        count, = struct.unpack_from(self.order + "I", dna, at)
        at += 4
        self.structs = []  # of (type, {member: offset})
        for _ in range(count):
            kind, members = struct.unpack_from(self.order + "HH", dna, at)
            at += 4
            offset, layout = 0, {}
            for _ in range(members):
                member_type, name = struct.unpack_from(self.order + "HH", dna, at)
                at += 4
                name = names[name]
                size = self.pointer if name[0] in "*(" else lengths[member_type]
                for part in name.split("[")[1:]:
                    size *= int(part.rstrip("]"))
                layout[name.split("[")[0]] = offset
                offset += size
            self.structs.append((types[kind], layout))

    def of_type(self, name):
        return [(kind, data) for _, kind, data in self.blocks.values()
                if kind < len(self.structs) and self.structs[kind][0] == name]

    def at(self, address):
        _, kind, data = self.blocks[address]
        return kind, data

    def pointer_at(self, kind, data, member, index=0):
        where = self.structs[kind][1][member] + index * self.pointer
        return struct.unpack_from(self.order + ("Q" if self.pointer == 8 else "I"), data, where)[0]

    def name_of(self, kind, data):
        text = data[self.structs[kind][1]["id"]:]
        id_layout = next(layout for name, layout in self.structs if name == "ID")
        return text[id_layout["name"] + 2:].split(b"\0", 1)[0].decode()


def esim_legacy_textures(path):
    """Returns image names by material name, from the texture slots of the file's materials."""
    file = BlendFile(path)
    images = {}
    for kind, data in file.of_type("Material"):
        if "*mtex" not in file.structs[kind][1]:
            continue
        for slot in range(18):
            address = file.pointer_at(kind, data, "*mtex", slot)
            if address not in file.blocks:
                continue
            texture = file.pointer_at(*file.at(address), "*tex")
            image = file.pointer_at(*file.at(texture), "*ima") if texture in file.blocks else 0
            if image in file.blocks:
                images[file.name_of(kind, data)] = file.name_of(*file.at(image))
                break
    return images


def esim_restore_legacy_materials(path):
    if not any(not material.use_nodes for material in bpy.data.materials):
        return
    try:
        images = esim_legacy_textures(path)
    except Exception as error:
        esim_warn(f"the textures of materials without nodes cannot be read: {error}")
        return
    for material in bpy.data.materials:
        image = bpy.data.images.get(images.get(material.name, ""))
        if material.use_nodes or image is None:
            continue
        colour = material.diffuse_color[:]
        material.use_nodes = True
        shader = material.node_tree.nodes["Principled BSDF"]
        shader.inputs["Base Color"].default_value = colour
        texture = material.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        material.node_tree.links.new(shader.inputs["Base Color"], texture.outputs["Color"])
