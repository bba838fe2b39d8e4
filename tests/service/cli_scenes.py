"""Small glTF scenes for the command line's tests: one good, and bad ones that differ from it in one thing."""
import base64
import copy
import json
import math
import pathlib
import struct
import zlib

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


def glb_parts(content):
    """The JSON and the binary chunk of a .glb."""
    size, = struct.unpack_from("<I", content, 12)
    return json.loads(content[20:20 + size]), content[20 + size + 8:]


def floats(gltf, chunk, accessor):
    """The numbers of an accessor of floats; its view has no gaps unless it says so."""
    entry = gltf["accessors"][accessor]
    assert entry["componentType"] == 5126
    view = gltf["bufferViews"][entry["bufferView"]]
    width = {"VEC2": 2, "VEC3": 3, "VEC4": 4}[entry["type"]]
    start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
    stride = view.get("byteStride", 4 * width)
    return [x for i in range(entry["count"]) for x in struct.unpack_from(f"<{width}f", chunk, start + i * stride)]


def exr(width, height, pixels):
    """An OpenEXR image, not compressed: rows of (r, g, b) from the top."""
    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(value)) + value
    channels = b"".join(name + b"\0" + struct.pack("<IIII", 2, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<II", 20000630, 2) + attribute("channels", "chlist", channels)
    head += attribute("compression", "compression", b"\0") + attribute("dataWindow", "box2i", box)
    head += attribute("displayWindow", "box2i", box) + attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    size = 12 * width
    lines, offsets = b"", b""
    for y in range(height):
        row = pixels[y * width:(y + 1) * width]
        offsets += struct.pack("<Q", len(head) + 8 * height + y * (8 + size))
        lines += struct.pack("<iI", y, size) + b"".join(struct.pack("<f", p[c]) for c in (2, 1, 0) for p in row)
    return head + offsets + lines


def read_exr(content):
    """{channel: rows of floats} of an OpenEXR image of float32 channels as radbake writes it: ZIP, 16 lines a block."""
    at, names, box = 8, [], None
    while content[at] != 0:
        name, kind, rest = content[at:].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        size, = struct.unpack_from("<I", content, at)
        value = content[at + 4:at + 4 + size]
        at += 4 + size
        if name == b"dataWindow":
            box = struct.unpack("<4i", value)
        elif name == b"compression":
            assert value == b"\3", "not ZIP"
        elif name == b"channels":
            while value != b"\0":
                channel, value = value.split(b"\0", 1)
                assert struct.unpack_from("<I", value)[0] == 2, "not float32"
                names.append(channel.decode())
                value = value[16:]
    at += 1
    width, height = box[2] - box[0] + 1, box[3] - box[1] + 1
    rows = {name: [] for name in names}
    for block in range((height + 15) // 16):
        offset, = struct.unpack_from("<Q", content, at + 8 * block)
        _, size = struct.unpack_from("<iI", content, offset)
        data = content[offset + 8:offset + 8 + size]
        num_lines = min(16, height - 16 * block)
        if size < 4 * width * len(names) * num_lines:  # else it stands as it is
            # Differences to the byte before, the even bytes before the odd ones.
            data = bytearray(zlib.decompress(data))
            for i in range(1, len(data)):
                data[i] = (data[i - 1] + data[i] - 128) & 255
            half = (len(data) + 1) // 2
            data = bytes(data[i // 2 + (half if i % 2 else 0)] for i in range(len(data)))
        floats_of = iter(struct.unpack(f"<{len(data) // 4}f", data))
        for _ in range(num_lines):
            for name in names:
                rows[name].append([next(floats_of) for _ in range(width)])
    return rows


def lit_by(light, **scene):
    """The square, dark but for one lamp of KHR_lights_punctual above it that shines down."""
    gltf = square(emissive=(0, 0, 0), **scene)
    gltf["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
    gltf["nodes"].append({"name": "lamp", "translation": [0.5, 1, -0.5],
                          "rotation": [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)],
                          "extensions": {"KHR_lights_punctual": {"light": 0}}})
    gltf["scenes"][0]["nodes"].append(1)
    return gltf


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


def _with_view(scene, payload):
    """Adds a buffer of its own for some bytes; returns the view."""
    scene["buffers"].append({"byteLength": len(payload), "uri": "data:application/octet-stream;base64," +
                             base64.b64encode(payload).decode()})
    scene["bufferViews"].append({"buffer": len(scene["buffers"]) - 1, "byteLength": len(payload)})
    return len(scene["bufferViews"]) - 1


def _sparse(*indices):
    """A change that replaces positions by a sparse list."""
    def change(scene):
        scene["accessors"][0]["sparse"] = {
            "count": len(indices),
            "indices": {"bufferView": _with_view(scene, struct.pack(f"<{len(indices)}H", *indices)), "componentType": 5123},
            "values": {"bufferView": _with_view(scene, bytes(12 * len(indices)))}}
    return change


def _short_sparse_values(scene):
    _sparse(1, 2)(scene)
    scene["bufferViews"][-1]["byteLength"] = 16


def _short_strip(scene):
    scene["meshes"][0]["primitives"][0]["mode"] = 5
    scene["accessors"][1]["count"] = 2


def _unbacked(scene):
    scene["accessors"][0].pop("bufferView")
    scene["accessors"][2].pop("bufferView")
    scene["accessors"][0]["count"] = scene["accessors"][2]["count"] = 7654321
    scene["meshes"][0]["primitives"][0].pop("indices")


def _quantised(scene):
    scene["extensionsUsed"] = scene["extensionsRequired"] = ["KHR_mesh_quantization"]
    scene["accessors"][0]["componentType"] = 5125


def _colors(component_type, payload):
    """A change that adds vertex colours."""
    def change(scene):
        scene["accessors"].append({"bufferView": _with_view(scene, payload), "componentType": component_type,
                                   "type": "VEC4", "count": 4})
        scene["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = len(scene["accessors"]) - 1
    return change


def _texture_transform(transform):
    """A change that puts a texture on the emission, with a transform."""
    def change(scene):
        scene["images"] = [{"uri": "any.png"}]
        scene["textures"] = [{"source": 0}]
        scene["materials"][0]["emissiveTexture"] = {"index": 0, "texCoord": 1,
                                                    "extensions": {"KHR_texture_transform": transform}}
    return change


def _two_sets(scene):
    _texture_transform({"texCoord": 2})(scene)
    scene["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}


def _beyond_the_view(scene):
    scene["bufferViews"][0]["byteLength"] = 5000


def _instances_without_end(scene):
    """30,000 triangles, placed 2,000 times."""
    view = _with_view(scene, bytes(2 * 90000))
    scene["accessors"][1].update(bufferView=view, count=90000)
    scene["nodes"] = [{"mesh": 0} for _ in range(2000)]
    scene["scenes"][0]["nodes"] = list(range(2000))


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
        ("outside.gltf", with_change(_set(["buffers", 0, "uri"], "../tmp")), "../tmp"),
        ("beyond.gltf", with_change(_beyond_the_view), "5000"),
        ("strip.gltf", with_change(_short_strip), "strip has 2 corners"),
        ("sparse_index.gltf", with_change(_sparse(1, 4)), "sparse index 1 is 4"),
        ("sparse_order.gltf", with_change(_sparse(2, 1)), "sparse index 1 is 1 after 2"),
        ("sparse_values.gltf", with_change(_short_sparse_values), "16"),
        ("unbacked.gltf", with_change(_unbacked), "7654321"),
        ("quantised.gltf", with_change(_quantised), "32-bit unsigned integers"),
        ("color_type.gltf", with_change(_colors(5121, bytes(16))), "COLOR_0"),
        ("color_nan.gltf", with_change(_colors(5126, struct.pack("<16f", *[1] * 10, math.nan, *[1] * 5))), "vertex 2"),
        ("uv_transform.gltf", with_change(_texture_transform({"scale": 3})), "scale is 3"),
        ("uv_nan.gltf", with_change(_texture_transform({"offset": [math.nan, 0]})), "JSON"),
        ("uv_null.gltf", with_change(_texture_transform({"rotation": None})), "rotation is null"),
        ("uv_sets.gltf", with_change(_two_sets), "TEXCOORD_2"),
        ("spot.gltf", json.dumps(lit_by({"type": "spot", "spot": {"innerConeAngle": 0.75, "outerConeAngle": 0.5}})).encode(),
         "innerConeAngle 0.750000 is not below outerConeAngle 0.500000"),
        ("roughness.gltf", with_change(_set(["materials", 0, "pbrMetallicRoughness", "roughnessFactor"], 2)), "roughnessFactor is 2"),
        ("thickness.gltf", with_change(_set(["materials", 0, "extensions"], {"KHR_materials_volume": {"thicknessFactor": -3}})),
         "thicknessFactor is -3"),
        ("texel_density.gltf", with_change(_set(["nodes", 0, "extras"], {"radbake_texel_density": 1000})), "1000"),
        ("instances.gltf", with_change(_instances_without_end), "limit of 50000000"),
        ("matrix.gltf", with_change(_set(["nodes", 0, "matrix"], [1, 0, 0, 5] + [0, 1, 0, 0] + [0, 0, 1, 0] + [0, 0, 0, 1])),
         "matrix"),
    ]
