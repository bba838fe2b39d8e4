"""Small glTF scenes for the command line's tests: one good, and bad ones that differ from it in one thing."""
import base64
import copy
import json
import math
import pathlib
import struct

# A unit square that faces up, two triangles.
POSITIONS = [(0, 0, 0), (1, 0, 0), (1, 0, -1), (0, 0, -1)]
TEXCOORDS = [(0.1, 0.9), (0.9, 0.9), (0.9, 0.1), (0.1, 0.1)]
INDICES = [0, 1, 2, 0, 2, 3]


def square(positions=POSITIONS, indices=INDICES, emissive=(1, 1, 1)):
    """A glTF of one square that glows."""
    payload = struct.pack("<12f", *(c for p in positions for c in p)) + struct.pack("<6H", *indices)
    payload += struct.pack("<8f", *(c for t in TEXCOORDS for c in t))
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "floor", "mesh": 0}],
        "meshes": [{"name": "square", "primitives": [
            {"attributes": {"POSITION": 0, "TEXCOORD_1": 2}, "indices": 1, "material": 0}]}],
        "materials": [{"name": "glow", "emissiveFactor": list(emissive),
                       "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, -1], "max": [1, 0, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48},
                        {"buffer": 0, "byteOffset": 48, "byteLength": 12},
                        {"buffer": 0, "byteOffset": 60, "byteLength": 32}],
        "buffers": [{"byteLength": 92,
                     "uri": "data:application/octet-stream;base64," + base64.b64encode(payload).decode()}],
    }


def with_change(change):
    scene = copy.deepcopy(square())
    change(scene)
    return json.dumps(scene).encode()


def _set(path, value):
    """A change that sets scene[path[0]][path[1]]... to a value."""
    def change(scene):
        place = scene
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value
    return change


def _make_cycle(scene):
    scene["nodes"] = [{"name": "a", "mesh": 0, "children": [1]}, {"name": "b", "children": [0]}]


def _corrupt_draco(scene):
    scene["extensionsUsed"] = scene["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    scene["meshes"][0]["primitives"][0]["extensions"] = {
        "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}


def _corrupt_image(scene):
    scene["images"] = [{"name": "noise", "mimeType": "image/png", "bufferView": 0}]
    scene["textures"] = [{"source": 0}]
    scene["materials"][0]["emissiveTexture"] = {"index": 0}
    scene["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 2


def bad_scenes(glb: pathlib.Path):
    """(file name, bytes, a word of the message that names what is wrong) of each kind of bad input."""
    nan = json.dumps(square(positions=[(0, 0, 0), (math.nan, 0, 0), (1, 0, -1), (0, 0, -1)])).encode()
    return [
        ("not_a_gltf.glb", b"These are not the bytes of a scene.", "not_a_gltf.glb"),
        ("truncated.glb", glb.read_bytes()[:-1000], "truncated.glb"),
        ("no_json.gltf", b'{"asset": {"version": "2.0"}, "scenes": [', "no_json.gltf"),
        ("buffer.gltf", with_change(_set(["bufferViews", 0, "buffer"], 7)), "7"),
        ("view.gltf", with_change(_set(["accessors", 0, "bufferView"], 9)), "9"),
        ("accessor.gltf", with_change(_set(["meshes", 0, "primitives", 0, "indices"], 11)), "11"),
        ("count.gltf", with_change(_set(["accessors", 0, "count"], 4000)), "4000"),
        ("index.gltf", json.dumps(square(indices=[0, 1, 2, 0, 2, 4444])).encode(), "4444"),
        ("nan.gltf", nan, "square"),
        ("cycle.gltf", with_change(_make_cycle), "node"),
        ("no_area.gltf", with_change(_set(["nodes", 0, "scale"], [0, 0, 0])), "area"),
        ("dark.gltf", json.dumps(square(emissive=(0, 0, 0))).encode(), "--sky"),
        ("extension.gltf", with_change(_set(["extensionsRequired"], ["EXT_of_tomorrow"])), "EXT_of_tomorrow"),
        ("draco.gltf", with_change(_corrupt_draco), "raco"),
        ("image.gltf", with_change(_corrupt_image), "noise"),
        ("external.gltf", with_change(_set(["buffers", 0, "uri"], "nowhere.bin")), "nowhere.bin"),
    ]
