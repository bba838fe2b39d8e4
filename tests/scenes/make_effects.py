"""Writes a small room with effects of light that tell methods apart, as a .glb without a layout.

  make_effects.py OUT.glb

3 x 2.5 x 3 m: one wall has an opening for --sky and --sun; a screen of holes (alpha mask) stands before it, a blue sheet
passes light, a double-sided panel stands amid; a lamp without size and a panel that glows. Equal bytes each time.
"""
import argparse
import struct
import zlib

from make_interior import Glb

MATERIALS = [
    {"name": "white", "pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.7, 0.7, 1], "metallicFactor": 0}},
    {"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.1, 0.08, 1], "metallicFactor": 0}},
    {"name": "screen", "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True,
     "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.4, 0.3, 1], "baseColorTexture": {"index": 0}, "metallicFactor": 0}},
    {"name": "blue sheet", "doubleSided": True, "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.8}},
     "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.9, 1], "metallicFactor": 0}},
    {"name": "panel", "doubleSided": True,
     "pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.6, 0.5, 1], "metallicFactor": 0}},
    {"name": "glow", "emissiveFactor": [1, 0.85, 0.6],
     "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2000}},
     "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0}},
]

# name, material, origin and two sides: the front is side x side.
QUADS = [
    ("floor", "white", (0, 0, 3), (3, 0, 0), (0, 0, -3)),
    ("ceiling", "white", (0, 2.5, 0), (3, 0, 0), (0, 0, 3)),
    ("left", "red", (0, 0, 3), (0, 0, -3), (0, 2.5, 0)),
    ("back", "white", (0, 0, 0), (3, 0, 0), (0, 2.5, 0)),
    ("front", "white", (3, 0, 3), (-3, 0, 0), (0, 2.5, 0)),
    # The right wall about its opening of 1.4 x 1.2 m.
    ("right below", "white", (3, 0, 0), (0, 0, 3), (0, 0.9, 0)),
    ("right above", "white", (3, 2.1, 0), (0, 0, 3), (0, 0.4, 0)),
    ("right before", "white", (3, 0.9, 0), (0, 0, 0.8), (0, 1.2, 0)),
    ("right behind", "white", (3, 0.9, 2.2), (0, 0, 0.8), (0, 1.2, 0)),
    ("screen", "screen", (2.6, 0.7, 0.6), (0, 0, 0.8), (0, 1.6, 0)),
    ("blue sheet", "blue sheet", (2.6, 0.7, 1.5), (0, 0, 0.8), (0, 1.6, 0)),
    ("panel", "panel", (1.0, 0, 0.8), (0.4, 0, 1.2), (0, 1.4, 0)),
    ("glow", "glow", (0.2, 2.48, 2.3), (0.4, 0, 0), (0, 0, 0.4)),
]


def holes():
    """A PNG of 64 x 64: eight by eight squares of which every other one is open."""
    rows = b"".join(b"\0" + b"".join(b"\xff\xff\xff" + (b"\0" if (x // 8 + y // 8) % 2 else b"\xff") for x in range(64))
                    for y in range(64))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 64, 64, 8, 6, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def main(path):
    glb, names = Glb(), [m["name"] for m in MATERIALS]
    nodes, meshes = [], []
    for name, material, origin, s, t in QUADS:
        corners = [tuple(o + a * p + b * q for o, p, q in zip(origin, s, t)) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        primitive = {"attributes": {"POSITION": glb.add(corners, "VEC3", True),
                                    "TEXCOORD_0": glb.add([(0, 1), (1, 1), (1, 0), (0, 0)], "VEC2")},
                     "indices": glb.add([(0, 1, 2), (0, 2, 3)], "SCALAR"), "material": names.index(material)}
        meshes.append({"name": name, "primitives": [primitive]})
        nodes.append({"name": name, "mesh": len(meshes) - 1})
    nodes.append({"name": "lamp", "translation": [2.4, 2.2, 2.6], "extensions": {"KHR_lights_punctual": {"light": 0}}})
    image = holes()
    glb.views.append({"buffer": 0, "byteOffset": len(glb.blob), "byteLength": len(image)})
    glb.blob += image + bytes(-len(image) % 4)
    lamp = {"type": "point", "color": [1, 0.9, 0.8], "intensity": 60}
    glb.write(path, {"asset": {"version": "2.0", "generator": "make_effects.py"}, "scene": 0,
                     "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes, "meshes": meshes,
                     "materials": MATERIALS, "textures": [{"source": 0}],
                     "images": [{"bufferView": len(glb.views) - 1, "mimeType": "image/png"}],
                     "extensions": {"KHR_lights_punctual": {"lights": [lamp]}},
                     "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength",
                                        "KHR_materials_transmission"]})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT.glb")
    main(parser.parse_args().out)
