"""Writes small glTF files: buffers, views and accessors by hand, so that every way to spell geometry can be had."""
import base64
import json
import os
import pathlib
import struct
import subprocess
import tempfile

BYTE, UBYTE, SHORT, USHORT, UINT, FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
CODES = {BYTE: "b", UBYTE: "B", SHORT: "h", USHORT: "H", UINT: "I", FLOAT: "f"}
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def packed(component, rows):
    """Numbers, or rows of numbers, as little-endian bytes."""
    flat = [n for row in rows for n in (row if isinstance(row, (tuple, list)) else (row,))]
    return struct.pack(f"<{len(flat)}{CODES[component]}", *flat)


class File:
    def __init__(self, *extensions, required=False):
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}
        if extensions:
            self.json["extensionsUsed"] = list(extensions)
        if extensions and required:
            self.json["extensionsRequired"] = list(extensions)
        self.buffers = [b""]

    def add(self, key, value):
        self.json.setdefault(key, []).append(value)
        return len(self.json[key]) - 1

    def view(self, data, stride=None, buffer=0, target=None):
        self.buffers[buffer] += bytes(-len(self.buffers[buffer]) % 4)
        view = {"buffer": buffer, "byteOffset": len(self.buffers[buffer]), "byteLength": len(data)}
        if stride:
            view["byteStride"] = stride
        if target:
            view["target"] = target
        self.buffers[buffer] += data
        return self.add("bufferViews", view)

    def accessor(self, kind, component, rows, **more):
        """An accessor with a view of its own; rows are padded to four bytes each where they must be."""
        size = len(packed(component, rows[:1]))
        padding = -size % 4 if kind != "SCALAR" else 0
        data = b"".join(packed(component, [row]) + bytes(padding) for row in rows)
        view = self.view(data, stride=size + padding if padding else None)
        accessor = {"bufferView": view, "componentType": component, "type": kind, "count": len(rows), **more}
        if more.get("bounds"):
            del accessor["bounds"]
            accessor["min"] = [min(row[i] for row in rows) for i in range(SIZES[kind])]
            accessor["max"] = [max(row[i] for row in rows) for i in range(SIZES[kind])]
        return self.add("accessors", accessor)

    def positions(self, rows, component=FLOAT, **more):
        return self.accessor("VEC3", component, rows, bounds=True, **more)

    def indices(self, numbers, component=USHORT):
        return self.accessor("SCALAR", component, numbers)

    def material(self, name="grey", color=(0.5, 0.5, 0.5, 1), **more):
        pbr = {"baseColorFactor": list(color), "metallicFactor": 0, **more.pop("pbr", {})}
        return self.add("materials", {"name": name, "pbrMetallicRoughness": pbr, **more})

    def mesh(self, *primitives, **more):
        return self.add("meshes", {"primitives": list(primitives), **more})

    def root(self, **node):
        index = self.add("nodes", node)
        self.json["scenes"][0]["nodes"].append(index)
        return index

    def texture(self, png):
        image = self.add("images", {"bufferView": self.view(png), "mimeType": "image/png"})
        sampler = self.add("samplers", {"magFilter": 9728, "minFilter": 9728})
        return self.add("textures", {"source": image, "sampler": sampler})

    def write(self, path, external=(), binary=False):
        """Buffers go into data URIs, into files where `external` names them, or the first into the .glb's chunk."""
        path = pathlib.Path(path)
        self.json["buffers"] = []
        for i, data in enumerate(self.buffers):
            buffer = {"byteLength": len(data)}
            if i < len(external):
                buffer["uri"] = external[i]
                (path.parent / external[i]).write_bytes(data)
            elif not binary or i > 0:
                buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
            self.json["buffers"].append(buffer)
        text = json.dumps(self.json, separators=(",", ":"))
        if not binary:
            path.write_text(text + "\n")
            return
        text = text.encode() + b" " * (-len(text) % 4)
        data = self.buffers[0] + bytes(-len(self.buffers[0]) % 4)
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)) +
                         struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data)


def draco(positions, triangles, texcoords=None, position_bits=0, texcoord_bits=0, level=7):
    """A mesh compressed by Draco's own program (Debian: draco; DRACO_ENCODER names another); 0 bits: not quantised.

    Level 0 keeps the order of vertices and triangles. Unique ids: 0 POSITION, 1 texture coordinate.
    """
    corner = "{0}/{0}" if texcoords else "{0}"
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in positions]
    lines += [f"vt {u!r} {v!r}" for u, v in texcoords or []]
    lines += ["f " + " ".join(corner.format(v + 1) for v in t) for t in triangles]
    with tempfile.TemporaryDirectory() as folder:
        obj, drc = f"{folder}/mesh.obj", f"{folder}/mesh.drc"
        pathlib.Path(obj).write_text("\n".join(lines) + "\n")
        subprocess.run([os.environ.get("DRACO_ENCODER", "draco_encoder"), "-i", obj, "-o", drc, "-qp",
                        str(position_bits), "-qt", str(texcoord_bits), "-cl", str(level)],
                       check=True, stdout=subprocess.DEVNULL)
        return pathlib.Path(drc).read_bytes()
