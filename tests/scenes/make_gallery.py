"""Writes the classic rooms of radiosity as .glb files, without a layout: each calls for other effects of light.

  make_gallery.py ROOM OUT.glb        ROOM: goral, simple, computer, vermeer, museum, engine
  make_gallery.py sky OUT.hdr         for the museum's --hdri: a sky with clouds before noon

goral     a cube with one red and one blue wall under a shining ceiling: convex, nothing hides anything (Goral et al. 1984)
simple    a table, a chair and a picture under a lamp of area (Wallace, Cohen & Greenberg 1987)
computer  rows of desks with monitors that glow by a texture, instanced, under area lights (Nishita & Nakamae 1985)
vermeer   a checkered floor, a curtain that transmits, a window for --sun and --sky (Cohen & Greenberg 1986)
museum    skylights for --hdri, textured pictures, carved benches and urns: > 100,000 triangles (Cohen et al. 1988)
engine    pipes, gratings with holes, point, spot and IES lights: > 100,000 triangles (Wallace, Elmquist & Haines 1989)

Metres, Y up. Plain Python; equal arguments give equal bytes.
"""
import argparse
import json
import math
import random
import struct
import zlib

import make_interior as kit
from make_interior import add, scaled, sub


def png(width, height, pixel, channels=3):
    """A PNG of pixel(x, y) -> channels bytes."""
    rows = b"".join(b"\0" + b"".join(bytes(pixel(x, y)) for x in range(width)) for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def matte(*color, **more):
    return {"pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": 0, "roughnessFactor": 1}, **more}


def glowing(*radiance, **more):
    strength = max(radiance)
    return matte(0, 0, 0, emissiveFactor=[v / strength for v in radiance],
                 extensions={"KHR_materials_emissive_strength": {"emissiveStrength": strength}}, **more)


def textured(image, **more):
    material = matte(1, 1, 1, **more)
    material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": image}
    return material


def turned_node(name, position, towards, extension):
    """A node whose -Z points along a direction."""
    z = scaled(kit.unit(towards), -1)
    x = kit.unit(kit.cross((0, 1, 0) if abs(z[1]) < 0.9 else (1, 0, 0), z))
    y = kit.cross(z, x)
    return {"name": name, "matrix": [*x, 0, *y, 0, *z, 0, *position, 1], "extensions": extension}


class Room:
    """Shapes in groups, each a mesh that nodes place; images, lights and luminaires."""

    def __init__(self, materials, images=()):
        self.materials, self.images = materials, list(images)
        self.shapes = kit.Scene()
        self.places = {}  # group -> translations and turns about Y; none: as it stands
        self.lights, self.profiles, self.lamp_nodes = [], [], []

    def __getattr__(self, name):
        return getattr(self.shapes, name)

    def place(self, group, translation, turn=0.0):
        self.places.setdefault(group, []).append((translation, turn))

    def light(self, name, kind, position, color, intensity, towards=(0, -1, 0), **cone):
        light = {"name": name, "type": kind, "color": list(color), "intensity": intensity}
        if kind == "spot":
            light["spot"] = {"innerConeAngle": cone["inner"], "outerConeAngle": cone["outer"]}
        self.lights.append(light)
        self.lamp_nodes.append(turned_node(name, position, towards,
                                           {"KHR_lights_punctual": {"light": len(self.lights) - 1}}))

    def luminaire(self, name, profile, position, towards=(0, -1, 0), multiplier=1.0, color=(1, 1, 1)):
        if profile not in self.profiles:
            self.profiles.append(profile)
        self.lamp_nodes.append(turned_node(name, position, towards, {"EXT_lights_ies": {
            "light": self.profiles.index(profile), "multiplier": multiplier, "color": list(color)}}))

    def write(self, path):
        glb, names, nodes, meshes = Writer(), list(self.materials), [], []
        num_triangles = 0
        for group, patches in self.shapes.objects.items():
            primitives = []
            for material in names:
                chosen = [p for p in patches if p.material == material]
                if not chosen:
                    continue
                positions, normals, coordinates, triangles = arrays(chosen)
                copies = max(1, len(self.places.get(group, ())))
                num_triangles += copies * len(triangles)
                primitives.append({"attributes": {"POSITION": glb.add(positions, "VEC3", True),
                                                  "NORMAL": glb.add(normals, "VEC3"),
                                                  "TEXCOORD_0": glb.add(coordinates, "VEC2")},
                                   "indices": glb.add(triangles, "SCALAR"), "material": names.index(material)})
            meshes.append({"name": group, "primitives": primitives})
            for k, (translation, turn) in enumerate(self.places.get(group, [((0, 0, 0), 0.0)])):
                node = {"name": group if group not in self.places else f"{group} {k + 1}", "mesh": len(meshes) - 1}
                if group in self.places:
                    node["translation"] = list(translation)
                    node["rotation"] = [0, math.sin(turn / 2), 0, math.cos(turn / 2)]
                nodes.append(node)
        nodes += self.lamp_nodes
        document = {"asset": {"version": "2.0", "generator": "make_gallery.py"}, "scene": 0,
                    "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes, "meshes": meshes,
                    "materials": [{"name": name, **self.materials[name]} for name in names]}
        used = {name for m in self.materials.values() for name in m.get("extensions", {})}
        if self.images:
            document["images"] = [{"bufferView": glb.raw(data), "mimeType": "image/png"} for data in self.images]
            document["textures"] = [{"source": k} for k in range(len(self.images))]
        if self.lights:
            used.add("KHR_lights_punctual")
            document.setdefault("extensions", {})["KHR_lights_punctual"] = {"lights": self.lights}
        if self.profiles:
            used.add("EXT_lights_ies")
            document.setdefault("extensions", {})["EXT_lights_ies"] = {"lights": [
                {"bufferView": glb.raw(text.encode()), "mimeType": "application/x-ies-lm-63"} for text in self.profiles]}
        if used:
            document["extensionsUsed"] = sorted(used)
        glb.write(path, document)
        print(f"{path}: {num_triangles} triangles, {len(meshes)} meshes, {len(nodes)} nodes")


class Writer(kit.Glb):
    def raw(self, data):
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)})
        self.blob += data + b"\0" * (-len(data) % 4)
        return len(self.views) - 1


def arrays(patches):
    """As of one sheet: each chart is its own unit square."""
    return kit.primitive_arrays(patches, [(0, 1, 1, -1, False)] * len(patches), 1)


def shell(room, size, floor, ceiling, left, right, back, front):
    """Six walls that face in, by material; None: left out."""
    w, h, d = size
    for name, material, quad in (
            ("floor", floor, ((0, 0, d), (w, 0, 0), (0, 0, -d))), ("ceiling", ceiling, ((0, h, 0), (w, 0, 0), (0, 0, d))),
            ("left wall", left, ((0, 0, d), (0, 0, -d), (0, h, 0))), ("right wall", right, ((w, 0, 0), (0, 0, d), (0, h, 0))),
            ("back wall", back, ((0, 0, 0), (w, 0, 0), (0, h, 0))), ("front wall", front, ((w, 0, d), (-w, 0, 0), (0, h, 0)))):
        if material:
            room.quad(name, *quad, material)


def goral():
    room = Room({"white": matte(0.75, 0.75, 0.75), "red": matte(0.75, 0.12, 0.1), "blue": matte(0.12, 0.2, 0.7),
                 "shining": glowing(900, 880, 820)})
    shell(room, (3, 3, 3), "white", "shining", "red", "blue", "white", "white")
    return room


def table(room, group, low, high, top, leg):
    """A board on four legs."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    room.block(group, (x0, y1 - 0.04, z0), (x1, y1, z1), top)
    for x in (x0 + 0.05, x1 - 0.05):
        for z in (z0 + 0.05, z1 - 0.05):
            room.block(group, (x - 0.03, y0, z - 0.03), (x + 0.03, y1 - 0.04, z + 0.03), leg, leave_out="bottom top")


def chair(room, group, at, turn, material):
    x, z = at
    c, s = math.cos(turn), math.sin(turn)

    def part(x0, y0, z0, x1, y1, z1, leave_out=""):
        mx, mz = (x0 + x1) / 2, (z0 + z1) / 2
        cx, cz = x + c * mx + s * mz, z - s * mx + c * mz
        room.block(group, (cx - (x1 - x0) / 2, y0, cz - (z1 - z0) / 2), (cx + (x1 - x0) / 2, y1, cz + (z1 - z0) / 2),
                   material, turn=turn, leave_out=leave_out)
    part(-0.21, 0.43, -0.21, 0.21, 0.46, 0.21)
    part(-0.21, 0.46, 0.18, 0.21, 0.92, 0.21, "bottom")
    for dx in (-0.18, 0.18):
        for dz in (-0.18, 0.18):
            part(dx - 0.02, 0, dz - 0.02, dx + 0.02, 0.43, dz + 0.02, "bottom top")


def picture(width, height, colors, seed):
    """Fields of colour about a few lines, as painters of the last century had them."""
    rng = random.Random(seed)
    xs = sorted(rng.uniform(0.1, 0.9) for _ in range(4))
    ys = sorted(rng.uniform(0.1, 0.9) for _ in range(3))
    fields = {(i, j): rng.choice(colors) for i in range(5) for j in range(4)}

    def pixel(x, y):
        u, v = (x + 0.5) / width, (y + 0.5) / height
        if any(abs(u - a) < 0.012 for a in xs) or any(abs(v - b) < 0.015 for b in ys):
            return 25, 22, 20
        return fields[sum(u > a for a in xs), sum(v > b for b in ys)]
    return png(width, height, pixel)


PAINTS = [(232, 226, 208), (206, 52, 40), (38, 66, 150), (240, 200, 60), (90, 128, 96), (150, 96, 70)]


def framed(room, groups, low, size, bar, deep, material, image):
    """A picture on the wall z = 0, in a frame of four bars."""
    (x0, y0), (w, h) = low, size
    frame, canvas = groups
    x1, y1 = x0 + w, y0 + h
    room.block(frame, (x0, y0, 0), (x1, y0 + bar, deep), material, leave_out="back")
    room.block(frame, (x0, y1 - bar, 0), (x1, y1, deep), material, leave_out="back")
    for x in (x0, x1 - bar):
        room.block(frame, (x, y0 + bar, 0), (x + bar, y1 - bar, deep), material, leave_out="back top bottom")
    room.quad(canvas, (x0 + bar, y0 + bar, deep / 2), (w - 2 * bar, 0, 0), (0, h - 2 * bar, 0), image)


def simple():
    room = Room({"plaster": matte(0.76, 0.73, 0.66), "boards": matte(0.5, 0.33, 0.2), "oak": matte(0.42, 0.26, 0.15),
                 "cloth": matte(0.25, 0.4, 0.62), "picture": textured(0), "frame": matte(0.25, 0.16, 0.09),
                 "shade": glowing(9000, 8100, 6400), "brass": matte(0.5, 0.4, 0.2)}, [picture(128, 96, PAINTS, 3)])
    shell(room, (4, 2.6, 4.5), "boards", "plaster", "plaster", "plaster", "plaster", "plaster")
    table(room, "table", (1.3, 0, 1.5), (2.9, 0.75, 2.4), "oak", "oak")
    chair(room, "chairs", (1.7, 2.75), 0.1, "oak")
    chair(room, "chairs", (2.5, 1.2), math.pi - 0.2, "cloth")
    framed(room, ("frame", "picture"), (1.5, 1.15), (1.2, 0.9), 0.05, 0.03, "frame", "picture")
    # The lamp hangs over the table: a disc that shines down under a shade's rim.
    room.turned("lamp rod", (2.1, 2.1, 1.95), lambda t: (0.008, 0.5 * t), 8, 1, "brass")
    room.block("lamp", (1.85, 1.98, 1.7), (2.35, 2.1, 2.2), "brass", leave_out="bottom")
    room.quad("shade", (1.85, 1.98, 1.7), (0.5, 0, 0), (0, 0, 0.5), "shade")
    room.turned("vase", (1.6, 0.75, 1.8), kit.vase_profile, 24, 24, "cloth")
    return room


def screen_image():
    """Lines of text, green on black, in the upper half."""
    rng = random.Random(9)
    rows = [[(k < 9 and rng.random() < 0.8 and rng.randrange(12, 44)) or 0] for k in range(16)]

    def pixel(x, y):
        line, within = divmod(y, 6)
        is_on = within < 4 and line < 16 and x // 2 < rows[line][0] and (x * 7 + line * 13) % 5 != 0
        return (90, 255, 140) if is_on else (0, 5, 2)
    return png(96, 96, pixel)


def computer():
    glow = matte(0, 0, 0, emissiveFactor=[1, 1, 1], emissiveTexture={"index": 0},
                 extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 1600}})
    room = Room({"wall": matte(0.7, 0.7, 0.66), "carpet": matte(0.18, 0.22, 0.3), "tiles": matte(0.78, 0.78, 0.76),
                 "desk": matte(0.62, 0.5, 0.36), "case": matte(0.6, 0.58, 0.52), "screen": glow,
                 "seat": matte(0.12, 0.13, 0.16), "lamp": glowing(420, 450, 500)}, [screen_image()])
    shell(room, (9, 2.8, 7), "carpet", "tiles", "wall", "wall", "wall", "wall")
    table(room, "desk", (-0.7, 0, -0.4), (0.7, 0.74, 0.4), "desk", "case")
    room.block("monitor", (-0.2, 0.76, -0.3), (0.2, 1.12, 0.05), "case")
    room.quad("screen", (-0.17, 0.8, 0.052), (0.34, 0, 0), (0, 0.28, 0), "screen")
    room.block("keyboard", (-0.22, 0.745, 0.12), (0.22, 0.77, 0.3), "case", leave_out="bottom")
    chair(room, "seat", (0.05, 0.75), 0.15, "seat")
    for row in range(3):
        for column in range(4):
            at = (1.5 + 2.0 * column, 0, 1.3 + 1.9 * row)
            for group in ("desk", "monitor", "screen", "keyboard", "seat"):
                room.place(group, at, 0.06 * ((row * 4 + column) % 3 - 1) if group == "seat" else 0.0)
    for row in range(2):
        for column in range(3):
            x, z = 1.2 + 2.7 * column, 1.8 + 3.0 * row
            room.block("lamp boxes", (x, 2.72, z), (x + 1.2, 2.8, z + 0.3), "case", leave_out="bottom top")
            room.quad("lamps", (x, 2.72, z), (1.2, 0, 0), (0, 0, 0.3), "lamp")
    return room


def checkers(dark, light):
    return png(256, 256, lambda x, y: light if (x // 32 + y // 32) % 2 else dark)


def vermeer():
    curtain = {"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.55,
                                                      "diffuseTransmissionColorFactor": [0.9, 0.62, 0.3]}}
    room = Room({"plaster": matte(0.74, 0.71, 0.64), "floor": textured(0), "beams": matte(0.3, 0.2, 0.12),
                 "frame": matte(0.22, 0.14, 0.08), "cloth": matte(0.55, 0.12, 0.1), "oak": matte(0.36, 0.22, 0.12),
                 "curtain": matte(0.75, 0.5, 0.22, doubleSided=True, extensions=curtain), "picture": textured(1),
                 "jug": matte(0.82, 0.82, 0.86)},
                [checkers((28, 26, 30), (226, 220, 206)), picture(128, 96, PAINTS, 8)])
    w, h, d = 5.0, 3.2, 6.0
    room.quad("floor", (0, 0, d), (w, 0, 0), (0, 0, -d), "floor")
    shell(room, (w, h, d), None, "plaster", None, "plaster", "plaster", "plaster")
    # The left wall about two windows, 0.25 m deep.
    windows, sill, top, deep = ((1.0, 2.3), (3.0, 4.3)), 0.9, 2.7, 0.25
    zs = [0.0, *(z for window in windows for z in window), d]
    room.quad("left wall", (0, 0, d), (0, 0, -d), (0, h, 0), "plaster", s=[1 - z / d for z in reversed(zs)],
              t=[0, sill / h, top / h, 1], skip=lambda i, j: i % 2 == 1 and j == 1)
    for z0, z1 in windows:
        room.quad("reveals", (-deep, sill, z1), (deep, 0, 0), (0, 0, z0 - z1), "plaster")
        room.quad("reveals", (-deep, top, z0), (deep, 0, 0), (0, 0, z1 - z0), "plaster")
        room.quad("reveals", (-deep, sill, z0), (deep, 0, 0), (0, top - sill, 0), "plaster")
        room.quad("reveals", (0, sill, z1), (-deep, 0, 0), (0, top - sill, 0), "plaster")
        for k in range(1, 3):
            z = z0 + (z1 - z0) * k / 3
            room.block("bars", (-0.2, sill, z - 0.02), (-0.16, top, z + 0.02), "frame", leave_out="top bottom")
        y = (sill + top) / 2
        room.block("bars", (-0.2, y - 0.02, z0), (-0.16, y + 0.02, z1), "frame", leave_out="front back")
    for k in range(4):
        room.block("beams", (0, h - 0.22, 0.7 + 1.4 * k), (w, h, 0.92 + 1.4 * k), "beams", leave_out="top left right")

    def folds(s, t):
        return (0.14 + 0.05 * math.sin(9 * math.pi * s), 0.35 + 2.5 * t, 3.75 + 0.85 * s)
    room.patch("curtain", folds, kit.steps(72), kit.steps(6), "curtain", (1.4, 2.5))
    table(room, "table", (1.0, 0, 1.3), (2.6, 0.78, 2.3), "oak", "oak")
    room.block("cloth", (0.98, 0.45, 1.28), (2.0, 0.79, 2.32), "cloth", leave_out="bottom right")
    chair(room, "chair", (3.0, 1.8), math.pi / 2, "oak")
    room.turned("jug", (1.5, 0.79, 1.8), kit.vase_profile, 32, 32, "jug")
    framed(room, ("frame", "picture"), (2.2, 1.2), (1.4, 1.0), 0.08, 0.04, "frame", "picture")
    return room


def museum():
    paints = [picture(96, 72, PAINTS, seed) for seed in range(20, 26)]
    room = Room({"plaster": matte(0.78, 0.76, 0.72), "parquet": textured(6), "stone": matte(0.66, 0.62, 0.54),
                 "frame": matte(0.45, 0.32, 0.12), "bench": matte(0.3, 0.18, 0.1), "bronze": matte(0.28, 0.2, 0.12),
                 "clay": matte(0.6, 0.32, 0.2), **{f"picture {k}": textured(k) for k in range(6)}},
                paints + [checkers((38, 32, 28), (224, 210, 186))])
    w, h, d = 16.0, 5.5, 9.0
    room.quad("floor", (0, 0, d), (w, 0, 0), (0, 0, -d), "parquet")
    shell(room, (w, h, d), None, None, "plaster", "plaster", "plaster", "plaster")
    # Three skylights, each with a shaft of 0.6 m.
    xs = [0.0, 2.0, 4.6, 6.7, 9.3, 11.4, 14.0, w]
    z0, z1, lift = 3.0, 6.0, 0.6
    room.quad("ceiling", (0, h, 0), (w, 0, 0), (0, 0, d), "plaster", s=[x / w for x in xs], t=[0, z0 / d, z1 / d, 1],
              skip=lambda i, j: i % 2 == 1 and j == 1)
    for k in range(3):
        a, b = xs[2 * k + 1], xs[2 * k + 2]
        room.quad("shafts", (a, h, z1), (0, 0, z0 - z1), (0, lift, 0), "plaster")
        room.quad("shafts", (b, h, z0), (0, 0, z1 - z0), (0, lift, 0), "plaster")
        room.quad("shafts", (a, h, z0), (b - a, 0, 0), (0, lift, 0), "plaster")
        room.quad("shafts", (b, h, z1), (a - b, 0, 0), (0, lift, 0), "plaster")
        for bar in range(1, 4):
            x = a + (b - a) * bar / 4
            room.block("bars", (x - 0.03, h + 0.3, z0), (x + 0.03, h + 0.38, z1), "bronze", leave_out="front back")
    for k in range(6):
        x = 1.2 + 2.5 * k
        framed(room, ("frames", "pictures"), (x, 1.3), (1.8, 1.4), 0.1, 0.05, "frame", f"picture {k}")
    for k in range(3):
        x = 2.4 + 4.6 * k
        room.block("benches", (x, 0.38, 4.2), (x + 1.8, 0.45, 4.8), "bench")
        for end in (x + 0.1, x + 1.6):
            room.block("benches", (end, 0, 4.3), (end + 0.1, 0.38, 4.7), "bench", leave_out="top bottom")
    # Urns on pedestals, turned and fluted.
    room.block("pedestal", (-0.3, 0, -0.3), (0.3, 1.0, 0.3), "stone", leave_out="bottom")

    def urn(s, t):
        r, y = kit.vase_profile(t)
        a = -2 * math.pi * s
        r *= 2.2 * (1 + 0.04 * math.cos(24 * a) * math.sin(math.pi * t))
        return (r * math.cos(a), 1.0 + 2.2 * y, r * math.sin(a))
    room.patch("urn", urn, kit.steps(144), kit.steps(72), "clay", (1.4, 1.6))
    for at in ((1.2, 0, 7.6), (6.0, 0, 7.6), (10.6, 0, 7.6), (14.8, 0, 7.6), (14.8, 0, 1.2)):
        room.place("pedestal", at)
        room.place("urn", at)
    # A rope barrier before the pictures.
    for k in range(7):
        x = 0.9 + 2.4 * k
        room.turned("posts", (x, 0, 1.1), lambda t: (0.16 - 0.14 * min(1, t * 12) + 0.01 * math.sin(40 * t), 0.95 * t), 24, 48,
                    "bronze")
        if k < 6:
            room.tube("ropes", lambda s, x=x: (x + 2.4 * s, 0.9 - 0.5 * 4 * s * (1 - s) * 0.5, 1.1), 0.025, 48, 12, "bench", 2.5)
    return room


def grating():
    return png(64, 64, lambda x, y: (150, 150, 155, 255 if x % 8 < 2 or y % 16 < 2 else 0), 4)


DOWNLIGHT = "IESNA:LM-63-2002\nTILT=NONE\n1 2000 1 10 1 1 2 0.2 0.2 0\n1 1 60\n0 10 20 30 40 50 60 70 80 90\n0\n" \
            "1500 1450 1300 1050 700 360 120 30 5 0\n"


def engine():
    room = Room({"concrete": matte(0.5, 0.5, 0.48), "wall": matte(0.55, 0.57, 0.52), "steel": matte(0.4, 0.42, 0.45),
                 "red pipe": matte(0.6, 0.12, 0.08), "green pipe": matte(0.15, 0.42, 0.22), "copper": matte(0.6, 0.34, 0.2),
                 "grating": {**textured(0), "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True},
                 "boiler": matte(0.3, 0.36, 0.42), "sheet metal": matte(0.75, 0.72, 0.62, doubleSided=True)}, [grating()])
    w, h, d = 12.0, 6.0, 8.0
    shell(room, (w, h, d), "concrete", "concrete", "wall", "wall", "wall", "wall")
    # Boilers, their caps and bolts.
    for k in range(3):
        x = 2.2 + 3.8 * k
        room.turned("boilers", (x, 0, 2.2), lambda t: kit.along_line([(1.0, 0.0), (1.0, 2.4), (0.7, 2.8), (0.0, 2.9)], t), 96, 64,
                    "boiler")
        for bolt in range(24):
            a = 2 * math.pi * bolt / 24
            room.turned("bolts", (x + 1.02 * math.cos(a), 2.3, 2.2 + 1.02 * math.sin(a)),
                        lambda t: (0.03 * math.sqrt(max(0.0, 1 - t * t)), 0.04 * t), 10, 6, "steel")

    def pipe(points, radius, material):
        """Straight runs with bends of four radii."""
        total = sum(kit.length(sub(b, a)) for a, b in zip(points, points[1:]))

        def path(s):
            at = min(max(s, 0.0), 1.0) * total
            for a, b in zip(points, points[1:]):
                run = kit.length(sub(b, a))
                if at <= run or b is points[-1]:
                    return add(a, scaled(sub(b, a), at / run))
                at -= run

        def smooth(s):
            e = 4 * radius / total
            return scaled(add(add(path(s - e), path(s + e)), scaled(path(s), 2)), 0.25)
        room.tube("pipes", smooth, radius, 20 * len(points) + 20, 20, material, total)
    rng = random.Random(5)
    colors = ["red pipe", "green pipe", "copper", "steel"]
    for k in range(14):
        y, z = 3.4 + 0.16 * k, 0.3 + 0.1 * (k % 4)
        drop = 1.0 + 0.75 * k
        pipe([(0.05, y, z), (drop, y, z), (drop, y - 1.2, z), (drop, y - 1.2, 2.0 + 0.3 * (k % 3)), (drop, 2.7, 2.0 + 0.3 * (k % 3))],
             0.03 + 0.02 * rng.random(), colors[k % 4])
    for k in range(8):
        z = 4.6 + 0.35 * k
        pipe([(0.05, 5.3 + 0.05 * (k % 3), z), (11.95, 5.3 + 0.05 * (k % 3), z)], 0.05, colors[k % 4])
    # A catwalk: gratings on beams, a rail on posts.
    for k in range(10):
        x = 1.0 + k
        room.quad("gratings", (x, 2.6, 5.6), (0, 0, -1.2), (-1.0, 0, 0), "grating")
    for z in (4.4, 5.56):
        room.block("beams", (0, 2.46, z), (10.0, 2.58, z + 0.04), "steel", leave_out="left")
    for k in range(11):
        room.turned("rail", (k * 1.0, 2.6, 5.55), lambda t: (0.02, 1.05 * t), 16, 4, "steel")
    for y in (3.1, 3.65):
        room.tube("rail", lambda s, y=y: (10.0 * s, y, 5.55), 0.022, 80, 16, "steel", 10.0)
    # Sheets that stand before the right wall, their backs to the room.
    for k in range(2):
        room.quad("screens", (10.6, 0.05, 5.6 - 2.2 * k), (0, 0, -1.8), (0, 2.2, 0), "sheet metal")
    for k in range(4):
        room.luminaire(f"downlight {k + 1}", DOWNLIGHT, (1.8 + 2.8 * k, 5.2, 6.6), multiplier=2)
    room.light("work lamp", "point", (6.0, 1.8, 4.0), (1, 0.85, 0.6), 160)
    room.light("floodlight", "spot", (11.4, 4.4, 7.4), (0.85, 0.9, 1), 1800, (-0.6, -0.5, -0.6), inner=0.25, outer=0.6)
    return room


def write_sky(path):
    """An equirectangular sky of 256 x 128 texels as Radiance RGBE, in units of 1000 nit: blue above, bright clouds, a veiled
    sun, dark ground below."""
    width, height = 256, 128
    rng = random.Random(11)
    clouds = [(rng.uniform(0, 2 * math.pi), rng.uniform(0.25, 1.2), rng.uniform(0.08, 0.3)) for _ in range(40)]
    azimuth, elevation = 0.9, 0.85
    sun = (math.cos(elevation) * math.cos(azimuth), math.sin(elevation), math.cos(elevation) * math.sin(azimuth))

    def radiance(azimuth, elevation):
        if elevation < 0:
            return 0.25, 0.24, 0.2
        up = math.sin(elevation)
        color = [3.5 - 1.5 * up, 4.6 - 1.2 * up, 6.5 - 0.5 * up]
        for a, e, size in clouds:
            apart = math.hypot((azimuth - a + math.pi) % (2 * math.pi) - math.pi, 2 * (elevation - e)) / size
            share = max(0.0, 1 - apart) ** 0.7
            color = [c + share * (9.0 - c) for c in color]
        toward = math.cos(elevation) * math.cos(azimuth) * sun[0] + up * sun[1] + math.cos(elevation) * math.sin(azimuth) * sun[2]
        glow = 400 * max(0.0, toward) ** 600
        return tuple(c + g * glow for c, g in zip(color, (1.0, 0.94, 0.82)))

    def rgbe(color):
        mantissa, exponent = math.frexp(max(color))
        return bytes([*(min(255, int(c * 256 / 2 ** exponent)) for c in color), exponent + 128])
    rows = b"".join(rgbe(radiance(2 * math.pi * (x + 0.5) / width, math.pi * (0.5 - (y + 0.5) / height)))
                    for y in range(height) for x in range(width))
    with open(path, "wb") as file:
        file.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + rows)


ROOMS = {"goral": goral, "simple": simple, "computer": computer, "vermeer": vermeer, "museum": museum, "engine": engine}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("room", choices=[*sorted(ROOMS), "sky"])
    parser.add_argument("out", metavar="OUT.glb")
    arguments = parser.parse_args()
    if arguments.room == "sky":
        write_sky(arguments.out)
    else:
        ROOMS[arguments.room]().write(arguments.out)
