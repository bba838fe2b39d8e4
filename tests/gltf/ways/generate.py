#!/usr/bin/env python3
"""Writes one scene in many ways beside itself: six that lose nothing, and two that move its vertices a little.

usage: generate.py     (needs Draco's encoder: Debian's package draco)

A nook: a floor with the wall behind it and the wall at its left, a red screen that stands free, and a lamp under the
ceiling. Coordinates are eighths of a metre, the layout is in 64ths of the atlas: floats hold both exactly.
"""
import pathlib
import sys

PLACE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(PLACE.parent / "conformance"))
from gltf_file import FLOAT, UBYTE, USHORT, File, draco, packed  # noqa: E402


def atlas(x, y):
    return (x / 64, y / 64)


# Vertices (position, place in the lightmap) of strips; every strip is a band of quads from two vertices to the next two.
FLOOR_AND_WALL = [((x, y, z), atlas(4 + 8 * x, 4 + 8 * (4 - z + y)))
                  for y, z in ((0, 4), (0, 2), (0, 0), (1.5, 0), (3, 0)) for x in (0, 4)]
LEFT_WALL = [((0, y, z), atlas(40 + 5 * z, 4 + 5 * y)) for y in (0, 3) for z in (4, 0)]
SCREEN = [((x, y, z), atlas(40 + 16 * (x - 1.5), 28 + 8 * y))
          for y, z in ((0, 1.5), (1, 1.5), (1.5, 1.75)) for x in (1.5, 2.5)]
LAMP = [((x, 2.75, z), atlas(40 + 8 * (x - 1), 52 + 8 * (z - 1))) for z in (1, 2) for x in (1, 2)]
# Three primitives, the first of two strips.
PRIMITIVES = [[FLOOR_AND_WALL, LEFT_WALL], [SCREEN], [LAMP]]


def vertices(strips):
    return [v for strip in strips for v in strip]


def strip_indices(strips):
    """One strip, its parts stitched by triangles without area so that each begins at an even place."""
    indices, first = [], 0
    for strip in strips:
        if indices:
            indices += [indices[-1], first] + ([first] if len(indices) % 2 else [])
        indices += range(first, first + len(strip))
        first += len(strip)
    return indices


def triangles(strips):
    found, first = [], 0
    for strip in strips:
        for i in range(first, first + len(strip) - 2):
            found.append((i, i + 1 + i % 2, i + 2 - i % 2))
        first += len(strip)
    return found


def corners(strips):
    return [v for t in triangles(strips) for v in t]


def nook(name, primitive_of, *extensions, nodes=({},), external=()):
    file = File("KHR_materials_emissive_strength", *extensions)
    if extensions:
        file.json["extensionsRequired"] = list(extensions)
    file.material("plaster", (0.75, 0.75, 0.75, 1))
    file.material("red", (0.75, 0.125, 0.125, 1), doubleSided=True)
    file.material("lamp", (0.5, 0.5, 0.5, 1), emissiveFactor=[1, 0.875, 0.75],
                  extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 64}})
    mesh = file.mesh(*[{**primitive_of(file, strips), "material": i} for i, strips in enumerate(PRIMITIVES)])
    # Nodes in a chain; the last one has the mesh.
    for depth, node in enumerate(nodes):
        index = file.root(**node) if depth == 0 else file.add("nodes", dict(node))
        if depth > 0:
            file.json["nodes"][index - 1]["children"] = [index]
    file.json["nodes"][-1]["mesh"] = mesh
    file.write(PLACE / f"{name}.gltf", external=external)


def attributes(file, rows):
    return {"POSITION": file.positions([p for p, _ in rows]), "TEXCOORD_1": file.accessor("VEC2", FLOAT, [t for _, t in rows])}


def indexed(file, strips):
    return {"attributes": attributes(file, vertices(strips)), "indices": file.indices(corners(strips))}


def strip(file, strips):
    return {"attributes": attributes(file, vertices(strips)), "indices": file.indices(strip_indices(strips), UBYTE),
            "mode": 5}


def non_indexed(file, strips):
    rows = vertices(strips)
    return {"attributes": attributes(file, [rows[v] for v in corners(strips)])}


def sparse(file, strips):
    """Every second position comes from a sparse list over a view of wrong ones, all coordinates from one over zeros."""
    rows = vertices(strips)
    odd = list(range(1, len(rows), 2))
    primitive = indexed(file, strips)
    wrong = [(9, 9, 9) if i % 2 else p for i, (p, _) in enumerate(rows)]
    positions = file.positions(wrong)
    texcoords = file.add("accessors", {"componentType": FLOAT, "type": "VEC2", "count": len(rows)})
    for accessor, where, kind in ((positions, odd, 0), (texcoords, list(range(len(rows))), 1)):
        file.json["accessors"][accessor]["sparse"] = {
            "count": len(where),
            "indices": {"bufferView": file.view(packed(UBYTE, where)), "componentType": UBYTE},
            "values": {"bufferView": file.view(packed(FLOAT, [rows[i][kind] for i in where]))}}
    file.json["accessors"][positions].update(min=[0, 0, 0], max=[9, 9, 9])
    primitive["attributes"] = {"POSITION": positions, "TEXCOORD_1": texcoords}
    return primitive


# World = (2, -4, 8) + 4 (1/2 (p + (1, 0, -2))): powers of two, so nothing is rounded on the way back.
NESTED = ({"translation": [2, -4, 8], "scale": [4, 4, 4]}, {"scale": [0.5, 0.5, 0.5]}, {"translation": [1, 0, -2]})


def nested(file, strips):
    rows = [(tuple((c - t) / 2 - s for c, t, s in zip(p, (2, -4, 8), (1, 0, -2))), uv) for p, uv in vertices(strips)]
    return {"attributes": attributes(file, rows), "indices": file.indices(corners(strips))}


def quantised(file, strips):
    """16 bits over 4 m: a vertex moves by at most 2 m / 65535 along each axis."""
    rows = vertices(strips)
    return {"attributes": {
        "POSITION": file.positions([tuple(round(c / 4 * 65535) for c in p) for p, _ in rows], USHORT, normalized=True),
        "TEXCOORD_1": file.accessor("VEC2", USHORT, [tuple(round(c * 65535) for c in t) for _, t in rows], normalized=True)},
        "indices": file.indices(corners(strips))}


def compressed(file, strips):
    """Draco with 14 bits, in the order of the file."""
    rows = vertices(strips)
    positions = [p for p, _ in rows]
    data = draco(positions, triangles(strips), [t for _, t in rows], position_bits=14, texcoord_bits=14, level=0)
    accessors = [file.add("accessors", {"componentType": FLOAT, "type": kind, "count": len(rows)})
                 for kind in ("VEC3", "VEC2")]
    file.json["accessors"][accessors[0]].update(min=[min(p[i] for p in positions) for i in range(3)],
                                                max=[max(p[i] for p in positions) for i in range(3)])
    indices = file.add("accessors", {"componentType": USHORT, "type": "SCALAR", "count": len(corners(strips))})
    return {"attributes": {"POSITION": accessors[0], "TEXCOORD_1": accessors[1]}, "indices": indices, "extensions": {
        "KHR_draco_mesh_compression": {"bufferView": file.view(data), "attributes": {"POSITION": 0, "TEXCOORD_1": 1}}}}


nook("indexed", indexed)
nook("strip", strip)
nook("non_indexed", non_indexed)
nook("sparse", sparse)
nook("external", indexed, external=["external.bin"])
nook("nested", nested, nodes=NESTED)
nook("quantised", quantised, "KHR_mesh_quantization", nodes=({"scale": [4, 4, 4]},))
nook("draco", compressed, "KHR_draco_mesh_compression")
