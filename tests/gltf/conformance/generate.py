#!/usr/bin/env python3
"""Writes the conformance set beside itself: one small file for each feature of core glTF geometry that is read.

usage: generate.py     (needs Draco's encoder: Debian's package draco)

What each file shows is written out by hand in tests/unit/gltf/conformance_test.cpp, not here.
"""
import pathlib
import struct
import zlib

from gltf_file import BYTE, FLOAT, SHORT, UBYTE, UINT, USHORT, File, draco, packed

PLACE = pathlib.Path(__file__).resolve().parent

# A floor and the wall behind it, six vertices:  4 --- 5     the wall faces +Z
#                                                |     |
#                                                2 --- 3     the floor faces +Y
#                                               /     /
#                                              0 --- 1
STEP = [(0, 0, 1), (1, 0, 1), (0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]
TRIANGLES = [(0, 1, 2), (1, 3, 2), (2, 3, 4), (3, 5, 4)]
LIST = [v for t in TRIANGLES for v in t]
STRIP = [0, 1, 2, 3, 4, 5]
# The floor alone, around its middle.
FAN = [(0.5, 0, 0.5), (0, 0, 1), (1, 0, 1), (1, 0, 0), (0, 0, 0), (0, 0, 1)]


def simple(name, write=None, mode=None, positions=STEP, indices=LIST, component=USHORT, **primitive):
    """A file of one node and one primitive; `write(file)` changes it before it is written."""
    file = File()
    primitive = {"attributes": {"POSITION": file.positions(positions)}, "material": file.material(), **primitive}
    if indices is not None:
        primitive["indices"] = file.indices(indices, component)
    if mode is not None:
        primitive["mode"] = mode
    file.root(mesh=file.mesh(primitive))
    if write:
        write(file, file.json["meshes"][0]["primitives"][0])
    file.write(PLACE / f"{name}.gltf")


def bounds(rows):
    """What glTF asks of every POSITION."""
    return {"min": [min(column) for column in zip(*rows)], "max": [max(column) for column in zip(*rows)]}


def topologies():
    simple("list_uint16")
    simple("list_uint8", component=UBYTE)
    simple("list_uint32", component=UINT)
    simple("list_without_indices", positions=[STEP[v] for v in LIST], indices=None)
    simple("strip", mode=5, indices=STRIP)
    simple("strip_without_indices", mode=5, indices=None)
    # Floor and wall apart, stitched by triangles without area; six of them keep the parity of the second part.
    simple("strip_stitched", mode=5, indices=[0, 1, 2, 3, 3, 2, 2, 3, 4, 5])
    simple("fan", mode=6, positions=FAN[:5], indices=[0, 1, 2, 3, 4, 1])
    simple("fan_without_indices", mode=6, positions=FAN, indices=None)


def accessors():
    def strided(file, primitive):
        rows = [(*p, 9, 9, x, y) for p, (x, y) in zip(STEP, [(i / 8, 1 - i / 8) for i in range(6)])]
        view = file.view(packed(FLOAT, rows), stride=28)
        for name, kind, offset, more in (("POSITION", "VEC3", 0, bounds(STEP)), ("TEXCOORD_0", "VEC2", 20, {})):
            primitive["attributes"][name] = file.add("accessors", {
                "bufferView": view, "byteOffset": offset, "componentType": FLOAT, "type": kind, "count": 6, **more})
    simple("strided", strided)

    def offsets(file, primitive):
        vertices, numbers = file.view(packed(FLOAT, [(7, 7, 7)] + STEP)), file.view(packed(USHORT, [9, 9] + LIST))
        primitive["attributes"]["POSITION"] = file.add("accessors", {
            "bufferView": vertices, "byteOffset": 12, "componentType": FLOAT, "type": "VEC3", "count": 6,
            **bounds(STEP)})
        primitive["indices"] = file.add("accessors", {
            "bufferView": numbers, "byteOffset": 4, "componentType": USHORT, "type": "SCALAR", "count": 12})
    simple("byte_offsets", offsets)

    def sparse(accessor, file, component, numbers, values):
        accessor["sparse"] = {"count": len(numbers),
                              "indices": {"bufferView": file.view(packed(component, numbers)), "componentType": component},
                              "values": {"bufferView": file.view(values)}}

    def sparse_positions(file, primitive):
        file.json["accessors"][0].update(bounds(STEP))
        sparse(file.json["accessors"][0], file, UBYTE, [1, 5], packed(FLOAT, [STEP[1], STEP[5]]))
    wrong = list(STEP)
    wrong[1], wrong[5] = (8, 8, 8), (9, 9, 9)
    simple("sparse", sparse_positions, positions=wrong)

    def sparse_without_view(file, primitive):
        accessor = file.json["accessors"][0]
        del accessor["bufferView"]
        # All but vertex 2, which is at zero.
        sparse(accessor, file, USHORT, [0, 1, 3, 4, 5], packed(FLOAT, [STEP[v] for v in (0, 1, 3, 4, 5)]))
    simple("sparse_without_view", sparse_without_view)

    def sparse_indices(file, primitive):
        sparse(file.json["accessors"][1], file, UINT, [0, 4, 11], packed(USHORT, [LIST[0], LIST[4], LIST[11]]))
    simple("sparse_indices", sparse_indices, indices=[5 if i in (0, 4, 11) else v for i, v in enumerate(LIST)])

    def texcoords(component, rows):
        def write(file, primitive):
            primitive["attributes"]["TEXCOORD_0"] = file.accessor("VEC2", component, rows, normalized=True)
        return write
    simple("texcoord_uint8", texcoords(UBYTE, [(0, 0), (255, 0), (0, 51), (255, 51), (0, 255), (255, 255)]))
    simple("texcoord_uint16", texcoords(USHORT, [(0, 0), (65535, 0), (0, 13107), (65535, 13107), (0, 65535),
                                                 (65535, 65535)]))


def containers():
    file = File()
    file.root(mesh=file.mesh({"attributes": {"POSITION": file.positions(STEP)}, "indices": file.indices(LIST)}))
    file.write(PLACE / "external_buffer.gltf", external=["external_buffer.bin"])
    file.write(PLACE / "binary_chunk.glb", binary=True)

    file = File()
    file.buffers.append(b"")
    positions = file.positions(STEP)
    indices = file.add("accessors", {"bufferView": file.view(packed(USHORT, LIST), buffer=1), "componentType": USHORT,
                                     "type": "SCALAR", "count": 12})
    file.root(mesh=file.mesh({"attributes": {"POSITION": positions}, "indices": indices}))
    file.write(PLACE / "two_buffers.gltf", external=["two_buffers.bin"])


def extensions():
    def quantised(name, component, rows, node, normalized=False, **attributes):
        file = File("KHR_mesh_quantization", required=True)
        primitive = {"attributes": {"POSITION": file.positions(rows, component, normalized=normalized)},
                     "indices": file.indices(LIST)}
        for key, (kind, other, values, is_normalized) in attributes.items():
            primitive["attributes"][key] = file.accessor(kind, other, values, normalized=is_normalized)
        file.root(mesh=file.mesh(primitive), **node)
        file.write(PLACE / f"{name}.gltf")
    # Scales that are powers of two undo the quantisation without rounding.
    quantised("quantised_int16", SHORT, [tuple(256 * c for c in p) for p in STEP], {"scale": [1 / 256] * 3},
              NORMAL=("VEC3", BYTE, [(0, 127, 0)] * 2 + [(0, 90, 90)] * 2 + [(0, 0, 127)] * 2, True),
              TEXCOORD_0=("VEC2", SHORT, [(-4, 0), (4, 0), (-4, 2), (4, 2), (-4, 8), (4, 8)], False))
    quantised("quantised_uint16_normalised", USHORT, [tuple(65535 * c for c in p) for p in STEP], {}, True,
              TEXCOORD_0=("VEC2", USHORT, [(0, 0), (2, 0), (0, 4), (2, 4), (0, 8), (2, 8)], False))
    quantised("quantised_int8", BYTE, [tuple(64 * c - 32 for c in p) for p in STEP],
              {"scale": [1 / 64] * 3, "translation": [0.5] * 3})
    quantised("quantised_uint8_normalised", UBYTE, [tuple(255 * c for c in p) for p in STEP], {}, True,
              NORMAL=("VEC3", SHORT, [(0, 32767, 0)] * 6, True))

    for name, level in (("draco", 7), ("draco_sequential", 0)):
        file = File("KHR_draco_mesh_compression", required=True)
        texcoords = [(i / 8, 1 - i / 8) for i in range(6)]
        view = file.view(draco(STEP, TRIANGLES, texcoords, level=level))
        for kind, count, component in (("VEC3", 6, FLOAT), ("VEC2", 6, FLOAT), ("SCALAR", 12, USHORT)):
            file.add("accessors", {"componentType": component, "type": kind, "count": count})
        file.json["accessors"][0].update(min=[0, 0, 0], max=[1, 1, 1])
        file.root(mesh=file.mesh({"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "extensions": {
            "KHR_draco_mesh_compression": {"bufferView": view, "attributes": {"POSITION": 0, "TEXCOORD_0": 1}}}}))
        file.write(PLACE / f"{name}.gltf")


def png(rows):
    """An RGB image of 8 bits from rows of (r, g, b)."""
    raw = b"".join(b"\0" + bytes(c for pixel in row for c in pixel) for row in rows)
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)), (b"IDAT", zlib.compress(raw)),
              (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks)


def materials():
    def attribute(name, *arguments, **more):
        def write(file, primitive):
            primitive["attributes"][name] = file.accessor(*arguments, **more)
        return write
    colors = [(255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255), (255, 255, 255, 255), (0, 0, 0, 255), (51, 51, 51, 255)]
    simple("vertex_colors_uint8", attribute("COLOR_0", "VEC4", UBYTE, colors, normalized=True))
    simple("vertex_colors_uint16", attribute("COLOR_0", "VEC4", USHORT, [tuple(257 * c for c in row) for row in colors],
                                             normalized=True))
    simple("vertex_colors_float", attribute("COLOR_0", "VEC3", FLOAT, [(1, 0.5, 0.25)] * 3 + [(0, 1, 0.5)] * 3))

    checkers = png([[(255, 0, 0), (0, 255, 0)], [(0, 0, 255), (255, 255, 255)]])
    squares = [(0, 0), (0.5, 0), (0, 0.5), (0.5, 0.5), (0, 1), (0.5, 1)]

    def textured(name, info, emissive=None, **sets):
        file = File(*(["KHR_texture_transform"] if "extensions" in info else []))
        attributes = {"POSITION": file.positions(STEP)}
        for key, rows in sets.items():
            attributes[key] = file.accessor("VEC2", FLOAT, rows)
        texture = file.texture(checkers)
        more = {"emissiveFactor": [1, 0.5, 0], "emissiveTexture": {"index": texture, **emissive}} if emissive else {}
        material = file.material(pbr={"baseColorTexture": {"index": texture, **info}}, **more)
        file.root(mesh=file.mesh({"attributes": attributes, "indices": file.indices(LIST), "material": material}))
        file.write(PLACE / f"{name}.gltf")
    textured("texture_and_emission", {}, {"texCoord": 1}, TEXCOORD_0=squares, TEXCOORD_1=[(v, u) for u, v in squares])
    transform = {"offset": [0.5, 1], "rotation": 1.5707963267948966, "scale": [0.5, 2]}
    textured("texture_transform", {"extensions": {"KHR_texture_transform": transform}}, TEXCOORD_0=squares)
    textured("texture_transform_texcoord", {"extensions": {"KHR_texture_transform": {"texCoord": 2, "scale": [2, 2]}}},
             TEXCOORD_0=[(9, 9)] * 6, TEXCOORD_1=[(8, 8)] * 6, TEXCOORD_2=squares)

    def material(**more):
        def write(file, primitive):
            file.json["materials"][0].update(more)
            if "extensions" in more:
                file.json.setdefault("extensionsUsed", []).extend(more["extensions"])
        return write
    simple("alpha_mask", material(alphaMode="MASK", alphaCutoff=0.25, doubleSided=True))
    simple("alpha_blend", material(alphaMode="BLEND"))
    simple("unlit", material(extensions={"KHR_materials_unlit": {}}))


def nodes():
    def placed(name, *placements, **more):
        file = File()
        mesh = file.mesh({"attributes": {"POSITION": file.positions(STEP)}, "indices": file.indices(LIST)}, **more)
        for node in placements:
            node = dict(node)
            child = node.pop("child", None)
            index = file.root(**node)
            if child is None:
                file.json["nodes"][index]["mesh"] = mesh
            else:
                file.json["nodes"][index]["children"] = [file.add("nodes", {"mesh": mesh, **child})]
        file.write(PLACE / f"{name}.gltf")
    placed("instances", {}, {"translation": [2, 0, 0]})
    placed("nested_nodes", {"translation": [0, 4, 0], "scale": [2, 2, 2], "child": {
        "translation": [1, 0, 0], "scale": [0.5, 0.5, 0.5]}})
    placed("mirrored", {"scale": [-1, 1, 1]})
    placed("matrix", {"matrix": [0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 3, 0, 0, 1]})
    placed("texel_density", {"extras": {"radbake_texel_density": 4}}, {"translation": [2, 0, 0]},
           extras={"radbake_texel_density": 0.5})

    file = File()
    positions = file.positions(STEP)
    file.root(mesh=file.mesh({"attributes": {"POSITION": positions}, "indices": file.indices(LIST[:6]), "mode": 4},
                             {"attributes": {"POSITION": positions}, "indices": file.indices(LIST[6:]), "mode": 4},
                             {"attributes": {"POSITION": positions}, "mode": 0},
                             {"attributes": {"POSITION": positions}, "mode": 3}))
    file.write(PLACE / "several_primitives.gltf")

    file = File()
    mesh = file.mesh({"attributes": {"POSITION": file.positions(STEP)}, "indices": file.indices(LIST)})
    file.add("nodes", {"mesh": mesh, "translation": [0, 0, 9]})
    file.add("nodes", {"mesh": mesh})
    file.json["scenes"] = [{"nodes": [0]}, {"nodes": [1]}]
    file.json["scene"] = 1
    file.write(PLACE / "default_scene.gltf")


for part in (topologies, accessors, containers, extensions, materials, nodes):
    part()
