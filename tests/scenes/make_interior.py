"""Writes a furnished hall as a .glb: curved and flat, large and tiny, lit by windows and lamps, laid out for a lightmap.

  make_interior.py OUT.glb [--small]

A nave under a barrel vault between two arcades, with aisles, a gallery, stairs, tables, books, plants and chandeliers on
chains: 190,000 triangles, TEXCOORD_1 for one sheet of 1024 x 1024 texels. Leaves, links of chains and backs of books are
narrower than a texel. --small has the same elements in two bays: some 3,500 triangles for a sheet of 256 x 256.

Metres, Y up; every chart is a rectangle of its own. Backs of what is single-sided are nowhere to be seen, so bakers that
reflect from both sides see the same scene. Plain Python; equal arguments give equal bytes.
"""
import argparse
import json
import math
import random
import struct

# name: reflectance, radiance in nit, double-sided
MATERIALS = {
    "plaster": ((0.74, 0.71, 0.66), None, False),
    "stone": ((0.62, 0.58, 0.51), None, False),
    "tiles": ((0.45, 0.37, 0.30), None, False),
    "oak": ((0.42, 0.27, 0.15), None, False),
    "iron": ((0.20, 0.20, 0.21), None, False),
    "clay": ((0.60, 0.30, 0.20), None, False),
    "glaze": ((0.25, 0.42, 0.60), None, False),
    "red book": ((0.50, 0.10, 0.09), None, False),
    "blue book": ((0.12, 0.20, 0.45), None, False),
    "brown book": ((0.36, 0.24, 0.14), None, False),
    "leaf": ((0.15, 0.40, 0.10), None, True),
    "cloth": ((0.65, 0.16, 0.14), None, True),
    "window": ((0.0, 0.0, 0.0), (2700.0, 3000.0, 3400.0), False),
    "globe": ((0.0, 0.0, 0.0), (14000.0, 12000.0, 8500.0), False),
}
BOOKS = ("red book", "blue book", "brown book")


class Detail:
    """How much of everything there is."""

    def __init__(self, is_small):
        def choose(large, small):
            return small if is_small else large
        self.sheet = choose(1024, 256)
        self.bays = choose(6, 2)
        self.gallery = choose(3.0, 1.6)                              # metres deep
        self.around, self.rings = choose(48, 8), choose(44, 8)      # of columns
        self.vault = choose((96, 48), (8, 8))
        self.arch = choose(48, 8)
        self.turned = choose((12, 18), (4, 5))                       # of balusters, legs, pots
        self.baluster_pitch = choose(0.14, 0.6)
        self.link = choose((14, 8), (6, 3))
        self.globe = choose((16, 10), (5, 3))
        self.hoop = choose((96, 10), (12, 4))
        self.leaves = choose(550, 50)
        self.shelves = choose(5, 2)
        self.books = choose(1.0, 0.12)                               # share of a board that is filled
        self.cloth = choose((32, 48), (5, 6))
        self.chain = choose(2.6, 0.4)                               # metres
        self.steps = choose(13, 4)
        self.floor = choose((36, 24), (4, 6))


def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scaled(a, s):
    return (a[0] * s, a[1] * s, a[2] * s)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a):
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def unit(a):
    size = length(a)
    return scaled(a, 1 / size) if size > 0 else (0.0, 1.0, 0.0)


def steps(n):
    return [i / n for i in range(n + 1)]


class Patch:
    """A grid of points, row j at t[j], with its chart. Its front faces d/ds x d/dt."""

    def __init__(self, points, normals, chart, size, material, skip):
        self.points, self.normals, self.chart, self.size = points, normals, chart, size
        self.material, self.skip = material, skip


class Scene:
    def __init__(self):
        self.objects = {}

    def patch(self, name, f, s, t, material, size, smooth=True, chart=None, skip=lambda i, j: False):
        """f(s, t) -> a point; size: metres of the chart along s and t; chart(s, t) -> a point of it, 0..1."""
        points = [[f(a, b) for a in s] for b in t]
        if smooth:
            normals = [[normal_at(f, a, b) for a in s] for b in t]
        else:
            flat = normal_at(f, (s[0] + s[-1]) / 2, (t[0] + t[-1]) / 2)
            normals = [[flat for _ in s] for _ in t]
        chart = chart or (lambda a, b: (a, b))
        charts = [[chart(a, b) for a in s] for b in t]
        self.objects.setdefault(name, []).append(Patch(points, normals, charts, size, material, skip))

    def quad(self, name, origin, along_s, along_t, material, n=(1, 1), s=None, t=None, skip=lambda i, j: False, shrink=1):
        """A parallelogram that faces along_s x along_t."""
        self.patch(name, lambda a, b: add(origin, add(scaled(along_s, a), scaled(along_t, b))), s or steps(n[0]),
                   t or steps(n[1]), material, (length(along_s) * shrink, length(along_t) * shrink), False, skip=skip)

    def block(self, name, low, high, material, turn=0.0, leave_out=""):
        """A box about the vertical axis through its middle; leave_out: of "bottom", "back" what touches others."""
        centre = ((low[0] + high[0]) / 2, (low[2] + high[2]) / 2)
        c, s = math.cos(turn), math.sin(turn)

        def place(p):
            x, z = p[0] - centre[0], p[2] - centre[1]
            return (centre[0] + c * x + s * z, p[1], centre[1] - s * x + c * z)
        (x0, y0, z0), (x1, y1, z1) = low, high
        faces = {"front": ((x0, y0, z1), (x1, y0, z1), (x0, y1, z1)), "back": ((x1, y0, z0), (x0, y0, z0), (x1, y1, z0)),
                 "right": ((x1, y0, z1), (x1, y0, z0), (x1, y1, z1)), "left": ((x0, y0, z0), (x0, y0, z1), (x0, y1, z0)),
                 "top": ((x0, y1, z1), (x1, y1, z1), (x0, y1, z0)), "bottom": ((x0, y0, z0), (x1, y0, z0), (x0, y0, z1))}
        for face, (o, a, b) in faces.items():
            if face not in leave_out.split():
                o, a, b = place(o), place(a), place(b)
                self.quad(name, o, sub(a, o), sub(b, o), material)

    def turned(self, name, foot, profile, around, rings, material):
        """A surface of revolution about the vertical; profile(t) -> radius, height."""
        def f(s, t):
            r, y = profile(t)
            a = -2 * math.pi * s
            return (foot[0] + r * math.cos(a), foot[1] + y, foot[2] + r * math.sin(a))
        samples = [profile(k / 64) for k in range(65)]
        mean_radius = sum(r for r, _ in samples) / 65
        along = sum(math.hypot(b[0] - a[0], b[1] - a[1]) for a, b in zip(samples, samples[1:]))
        self.patch(name, f, steps(around), steps(rings), material, (2 * math.pi * mean_radius, along))

    def tube(self, name, path, radius, along, around, material, metres):
        """Around path(s), from 0 to 1; up to the reader whether it closes."""
        def f(s, t):
            here = path(s)
            forward = unit(sub(path(s + 1e-4), path(s - 1e-4)))
            side = unit(cross(forward, (0.3, 1, 0.2) if abs(forward[1]) < 0.9 else (1, 0.2, 0.3)))
            a = 2 * math.pi * t
            return add(here, add(scaled(side, radius * math.cos(a)),
                                 scaled(cross(side, forward), radius * math.sin(a))))
        self.patch(name, f, steps(along), steps(around), material, (metres, 2 * math.pi * radius))

    def hoop(self, name, centre, axis_u, axis_v, major, minor, along, around, material):
        """A torus about axis_u x axis_v."""
        w = cross(axis_u, axis_v)

        def f(s, t):
            a, b = 2 * math.pi * s, 2 * math.pi * t
            out = add(scaled(axis_u, math.cos(a)), scaled(axis_v, math.sin(a)))
            return add(centre, add(scaled(out, major + minor * math.cos(b)), scaled(w, minor * math.sin(b))))
        self.patch(name, f, steps(along), steps(around), material, (2 * math.pi * major, 2 * math.pi * minor))


def normal_at(f, s, t):
    e = 1e-5
    s, t = min(max(s, e), 1 - e), min(max(t, e), 1 - e)
    return unit(cross(sub(f(s + e, t), f(s - e, t)), sub(f(s, t + e), f(s, t - e))))


# The hall: x along it, z across.
BAY, NAVE, WALL, AISLE, SPRINGING, HEIGHT, ARCH = 3.0, 2.75, 0.5, 6.0, 3.0, 5.0, 1.1


def column_profile(t):
    """A foot of two rolls, a shaft that swells, a capital that opens."""
    y = t * (SPRINGING - 0.15)
    shaft = 0.30 - 0.04 * t + 0.012 * math.sin(math.pi * t)
    foot = 0.12 * math.exp(-((t - 0.02) / 0.025) ** 2) + 0.07 * math.exp(-((t - 0.075) / 0.018) ** 2)
    capital = 0.14 * max(0.0, (t - 0.88) / 0.12) ** 2 + 0.03 * math.exp(-((t - 0.865) / 0.012) ** 2)
    return shaft + foot + capital, y


def baluster_profile(t):
    return 0.022 + 0.018 * math.sin(math.pi * t) ** 2 + 0.010 * math.cos(6 * math.pi * t) ** 2, 0.8 * t


def leg_profile(t):
    return 0.028 + 0.012 * t + 0.010 * math.exp(-((t - 0.75) / 0.06) ** 2), 0.70 * t


def pot_profile(t):
    """Outside up, over the rim, down the inside to the earth."""
    outside, inside = [(0.16, 0.0), (0.24, 0.4)], [(0.21, 0.4), (0.18, 0.3), (0.0, 0.3)]
    return along_line(outside + inside, t)


def vase_profile(t):
    if t < 0.6:
        k = t / 0.6
        return 0.05 + 0.05 * math.sin(math.pi * min(1.0, 1.3 * k)) + 0.01 * k, 0.30 * k
    k = (t - 0.6) / 0.4
    top = 0.05 + 0.05 * math.sin(math.pi) + 0.01
    return top - 0.008 - (top - 0.008) * k ** 3, 0.30 - 0.25 * k


def seat_profile(t):
    return along_line([(0.0, 0.41), (0.17, 0.41), (0.19, 0.43), (0.17, 0.45), (0.0, 0.45)], t)


def along_line(points, t):
    at = t * (len(points) - 1)
    k = min(int(at), len(points) - 2)
    share = at - k
    return tuple(a + share * (b - a) for a, b in zip(points[k], points[k + 1]))


def build_shell(scene, d, half):
    """Floor, walls with windows, ceilings, vault, arcades."""
    width = 2 * half
    scene.quad("floor", (-half, 0, AISLE), (width, 0, 0), (0, 0, -2 * AISLE), "tiles", d.floor)
    for side in (1, -1):
        scene.quad("aisle ceiling", (-half, HEIGHT, side * (NAVE + WALL)) if side > 0 else (-half, HEIGHT, -AISLE),
                   (width, 0, 0), (0, 0, AISLE - NAVE - WALL), "plaster", (2 * d.bays, 2))
        build_end_wall(scene, d, side * half, side)
        build_arcade(scene, d, half, side)

    def vault(s, t):
        a = math.pi * t
        return (-half + width * s, HEIGHT + NAVE * math.sin(a), -NAVE * math.cos(a))
    scene.patch("vault", vault, steps(d.vault[0]), steps(d.vault[1]), "plaster", (width, math.pi * NAVE))
    scene.quad("north wall", (-half, 0, -AISLE), (width, 0, 0), (0, HEIGHT, 0), "plaster", (4 * d.bays, 4))
    build_window_wall(scene, d, half)


def build_end_wall(scene, d, x, side):
    across = (0, 0, side * 2 * AISLE)
    scene.quad("end wall", (x, 0, -side * AISLE), across, (0, HEIGHT, 0), "plaster", (12, 5))

    def lunette(s, t):
        a = math.pi * s
        return (x, HEIGHT + t * NAVE * math.sin(a), -side * t * NAVE * math.cos(a))
    scene.patch("end wall", lunette, steps(d.arch), [0, 0.5, 1], "plaster", (2 * NAVE, NAVE), False,
                lambda s, t: (0.5 - 0.5 * t * math.cos(math.pi * s), t * math.sin(math.pi * s)))


def build_window_wall(scene, d, half):
    """One window a bay, set back in the wall; a glowing panel closes it."""
    opening, sill, top, depth = 1.4, 1.2, 3.6, 0.3
    breaks = [0.0]
    for bay in range(d.bays):
        middle = (bay + 0.5) * BAY
        breaks += [middle - opening / 2, middle + opening / 2]
    breaks.append(2 * half)
    scene.quad("south wall", (half, 0, AISLE), (-2 * half, 0, 0), (0, HEIGHT, 0), "plaster",
               s=[b / (2 * half) for b in breaks], t=[0, sill / HEIGHT, top / HEIGHT, 1],
               skip=lambda i, j: i % 2 == 1 and j == 1)
    for bay in range(d.bays):
        x0 = half - (bay + 0.5) * BAY - opening / 2
        x1, z0, z1 = x0 + opening, AISLE, AISLE + depth
        scene.quad("reveal", (x0, sill, z1), (opening, 0, 0), (0, 0, -depth), "stone", (4, 1))
        scene.quad("reveal", (x0, top, z0), (opening, 0, 0), (0, 0, depth), "stone", (4, 1))
        scene.quad("reveal", (x1, sill, z1), (0, top - sill, 0), (0, 0, -depth), "stone", (4, 1))
        scene.quad("reveal", (x0, sill, z0), (0, top - sill, 0), (0, 0, depth), "stone", (4, 1))
        scene.quad("window", (x1, sill, z1), (-opening, 0, 0), (0, top - sill, 0), "window", shrink=0.2)


def build_arcade(scene, d, half, side):
    """Columns, arches and the wall above them."""
    z_nave, z_aisle = side * NAVE, side * (NAVE + WALL)
    middle = side * (NAVE + WALL / 2)
    for bay in range(d.bays):
        x0 = -half + bay * BAY
        cx, rise = x0 + BAY / 2, HEIGHT - SPRINGING

        def spandrel(s, t, cx=cx, rise=rise):
            """Between the arch (t = 0) and the bay's rectangle (t = 1)."""
            a = math.pi * s
            c, q = math.cos(a), math.sin(a)
            reach = min(BAY / 2 / abs(c) if abs(c) > 1e-9 else 1e9, rise / q if q > 1e-9 else 1e9)
            r = ARCH + t * (reach - ARCH)
            return cx + r * c, SPRINGING + r * q
        # Rays through the corners of the rectangle keep it whole.
        corner = math.atan2(rise, BAY / 2) / math.pi
        angles = sorted(set(steps(d.arch)) | {corner, 1 - corner})
        for z, faces_up in ((z_nave, side < 0), (z_aisle, side > 0)):
            def face(s, t, z=z, faces_up=faces_up):
                x, y = spandrel(1 - s if faces_up else s, t)
                return (x, y, z)

            def chart(s, t, faces_up=faces_up, x0=x0):
                x, y = spandrel(1 - s if faces_up else s, t)
                return (x - x0 if faces_up else x0 + BAY - x) / BAY, (y - SPRINGING) / (HEIGHT - SPRINGING)
            scene.patch("arcade", face, [1 - a for a in reversed(angles)] if faces_up else angles, steps(4), "stone",
                        (BAY, rise), False, chart)

        def intrados(s, t, cx=cx):
            a = math.pi * s
            return (cx + ARCH * math.cos(a), SPRINGING + ARCH * math.sin(a), middle + (0.5 - t) * WALL)
        scene.patch("arcade", intrados, steps(d.arch), steps(4), "stone", (math.pi * ARCH, WALL))
    for bay in range(1, d.bays):
        build_column(scene, d, -half + bay * BAY, middle)
    for x, wall in ((-half, "left"), (half - (BAY / 2 - ARCH), "right")):
        scene.block("piers", (x, 0, middle - WALL / 2), (x + BAY / 2 - ARCH, SPRINGING, middle + WALL / 2), "stone",
                    leave_out="bottom top " + wall)


def build_column(scene, d, x, z):
    scene.turned("columns", (x, 0, z), column_profile, d.around, d.rings, "stone")
    scene.block("columns", (x - 0.45, SPRINGING - 0.15, z - 0.45), (x + 0.45, SPRINGING, z + 0.45), "stone")


def build_ribs(scene, d, half):
    """Half rounds under the vault, over the columns."""
    radius = 0.09
    for bay in range(1, d.bays):
        def rib(s, t, x=-half + bay * BAY):
            a, b = math.pi * s, math.pi * t
            inside = NAVE - radius * math.sin(b)
            return (x + radius * math.cos(b), HEIGHT + inside * math.sin(a), -inside * math.cos(a))
        scene.patch("ribs", rib, steps(d.arch), steps(d.link[1]), "stone", (math.pi * NAVE, math.pi * radius))


def build_gallery(scene, d, half):
    """A floor at one end, its balustrade, and a flight of treads that leads up."""
    rise = 0.2
    level, edge = rise * d.steps, -half + d.gallery
    scene.block("gallery", (-half, level - 0.2, -NAVE), (edge, level, NAVE), "oak", leave_out="left")
    for z in (-0.9, 0.9):
        height = level - 0.2
        scene.turned("gallery", (edge - 0.3, 0, z), lambda t, h=height: (0.09 - 0.02 * math.sin(math.pi * t), h * t),
                     d.turned[0], d.turned[1], "oak")
    z = -1.5
    while z < NAVE - 0.05:
        scene.turned("balusters", (edge - 0.1, level, z), baluster_profile, *d.turned, "iron")
        z += d.baluster_pitch
    scene.block("balusters", (edge - 0.15, level + 0.8, -1.55), (edge - 0.05, level + 0.86, NAVE), "oak")
    going = 0.28
    for k in range(d.steps - 1):
        x, y = edge + k * going, level - (k + 1) * rise
        scene.block("stairs", (x, y - 0.06, -2.6), (x + going + 0.02, y, -1.6), "oak")
        if k % max(1, round(d.baluster_pitch / 0.28)) == 0:
            scene.turned("balusters", (x + going / 2, y, -1.64), baluster_profile, *d.turned, "iron")
    first, last = (edge, level + 0.83, -1.64), (edge + d.steps * going, 0.83, -1.64)
    scene.tube("stairs", lambda s: add(first, scaled(sub(last, first), s)), 0.03, d.steps, d.link[1], "oak",
               length(sub(last, first)))


def build_table(scene, d, x, z, rng):
    scene.block("tables", (x - 1.1, 0.70, z - 0.45), (x + 1.1, 0.75, z + 0.45), "oak")
    for dx in (-1.0, 1.0):
        for dz in (-0.35, 0.35):
            scene.turned("tables", (x + dx, 0, z + dz), leg_profile, *d.turned, "oak")
    for k in range(3 if d.bays > 2 else 1):
        build_stool(scene, d, x - 0.75 + 0.75 * k + rng.uniform(-0.1, 0.1), z + 0.75 + rng.uniform(0, 0.1), rng)
    vase = (x + rng.uniform(-0.6, 0.6), 0.75, z + rng.uniform(-0.2, 0.2))
    scene.turned("vases", vase, vase_profile, 2 * d.turned[0], 2 * d.turned[1], "glaze")
    scene.block("books", (x - 0.95, 0.75, z - 0.1), (x - 0.72, 0.79, z + 0.2), BOOKS[0], turn=rng.uniform(-0.5, 0.5),
                leave_out="bottom")


def build_stool(scene, d, x, z, rng):
    scene.turned("stools", (x, 0, z), seat_profile, 2 * d.turned[0], 8, "oak")
    for k in range(3):
        a = 2 * math.pi * (k / 3 + rng.random())
        top, foot = (x + 0.09 * math.cos(a), 0.415, z + 0.09 * math.sin(a)), (x + 0.16 * math.cos(a), 0.0, z + 0.16 * math.sin(a))
        scene.tube("stools", lambda s, p=foot, q=top: add(p, scaled(sub(q, p), s)), 0.016, 4, d.link[1], "oak", 0.42)


def build_chandelier(scene, d, x, z, top):
    """A chain of links in turn, a hoop on three arms, and a globe of light amid it."""
    pitch, major, minor = 0.046, 0.028, 0.0045
    count = round(d.chain / pitch)
    for k in range(count):
        across = (1.0, 0, 0) if k % 2 else (0, 0, 1.0)
        scene.hoop("chains", (x, top - 0.04 - k * pitch, z), across, (0, 1.0, 0), major, minor, *d.link, "iron")
    y = top - count * pitch - 0.04
    for k in range(3):
        a = 2 * math.pi * k / 3
        end = (x + 0.5 * math.cos(a), y - 0.35, z + 0.5 * math.sin(a))
        scene.tube("chandeliers", lambda s, e=end: add((x, y, z), scaled(sub(e, (x, y, z)), s)), 0.008, 6, d.link[1],
                   "iron", 0.6)
    scene.hoop("chandeliers", (x, y - 0.35, z), (1.0, 0, 0), (0, 0, -1.0), 0.5, 0.018, *d.hoop, "iron")
    scene.turned("globes", (x, y - 0.35, z), lambda t: (0.14 * math.sin(math.pi * t), -0.14 * math.cos(math.pi * t)),
                 *d.globe, "globe")


def build_bookcase(scene, d, x, rng):
    """Against the north wall: sides, boards and books, each box by itself."""
    width, depth, pitch = 2.0, 0.30, 0.42
    z0, z1 = -AISLE, -AISLE + depth
    height = d.shelves * pitch + 0.03
    for side in (x, x + width - 0.03):
        scene.block("bookcases", (side, 0, z0), (side + 0.03, height, z1), "oak", leave_out="bottom back")
    for board in range(d.shelves + 1):
        y = board * pitch
        scene.block("bookcases", (x + 0.03, y, z0), (x + width - 0.03, y + 0.03, z1), "oak",
                    leave_out="back left right" + (" bottom" if board == 0 else ""))
        if board == d.shelves:
            continue
        at, end = x + 0.05, x + 0.03 + (width - 0.06) * d.books
        while at < end - 0.06:
            thick, tall, deep = rng.uniform(0.018, 0.05), rng.uniform(0.20, 0.32), rng.uniform(0.16, 0.24)
            scene.block("books", (at, y + 0.03, z0 + 0.02), (at + thick, y + 0.03 + tall, z0 + 0.02 + deep),
                        rng.choice(BOOKS), leave_out="bottom")
            at += thick + (rng.uniform(0.002, 0.006) if rng.random() < 0.9 else 0.12)


def build_plant(scene, d, x, z, rng):
    scene.turned("pots", (x, 0, z), pot_profile, 2 * d.turned[0], 2 * d.turned[1], "clay")
    for _ in range(d.leaves):
        a, lift = rng.uniform(0, 2 * math.pi), rng.uniform(-0.2, 1.2)
        start = (x + 0.35 * rng.random() * math.cos(a), 0.47 + 1.0 * rng.random() ** 0.7, z + 0.35 * rng.random() * math.sin(a))
        out = unit((math.cos(a), lift, math.sin(a)))
        side = unit(cross(out, (0.1, 1.0, 0.1)))
        long, wide, droop = rng.uniform(0.05, 0.11), rng.uniform(0.012, 0.03), rng.uniform(0.1, 0.5)

        def leaf(s, t, start=start, out=out, side=side, long=long, wide=wide, droop=droop):
            p = add(start, add(scaled(out, long * s), scaled(side, wide * (t - 0.5) * (1.2 - 0.8 * s))))
            return add(p, (0, -droop * long * s * s, 0))
        scene.patch("leaves", leaf, steps(2), steps(1), "leaf", (long, wide))


def build_banner(scene, d, x, z):
    def cloth(s, t):
        return (x - 0.45 + 0.9 * s, 1.9 + 1.9 * t, z + 0.06 * math.sin(7 * s + 1.5 * t) * (1.1 - t))
    scene.patch("banners", cloth, steps(d.cloth[0]), steps(d.cloth[1]), "cloth", (0.9, 1.9))


def build(d):
    scene, rng = Scene(), random.Random(20)
    half = d.bays * BAY / 2
    build_shell(scene, d, half)
    build_ribs(scene, d, half)
    build_gallery(scene, d, half)
    if d.bays > 2:
        for x in (-1.5, 2.2, 5.9):
            build_table(scene, d, x, 0.4, rng)
        for x in (-5.2, 0.5, 5.2):
            build_chandelier(scene, d, x, 0.0, HEIGHT + NAVE)
        for x in (-8.0, -2.5, 3.0, 6.4):
            build_bookcase(scene, d, x, rng)
        for x, z in ((-7.5, 4.8), (-1.5, -4.2), (4.5, 4.9), (8.2, -4.6), (8.2, 0.9)):
            build_plant(scene, d, x, z, rng)
        for x in (-4.5, -1.5, 1.5):
            build_banner(scene, d, x, NAVE + WALL / 2)
    else:
        build_table(scene, d, 1.2, 0.4, rng)
        build_chandelier(scene, d, 0.8, 0.0, HEIGHT + NAVE)
        build_bookcase(scene, d, 0.4, rng)
        build_plant(scene, d, -1.0, 4.6, rng)
        build_banner(scene, d, 1.5, NAVE + WALL / 2)
    return scene


def lay_out(scene, sheet):
    """Rectangles of all charts on shelves, at the highest density that fits: patch -> x, y, w, h, is_turned."""
    patches = [p for group in scene.objects.values() for p in group]

    def attempt(density):
        wanted = []
        for k, p in enumerate(patches):
            w, h = p.size[0] * density, p.size[1] * density
            # What is larger than a few texels is made of whole ones.
            w, h = (round(v) if v > 4 else v for v in (w, h))
            wanted.append((max(w, h), min(w, h), h > w, k))
        wanted.sort(key=lambda c: (-c[1], -c[0], c[3]))
        gap = 2
        x = y = gap
        shelf = 0
        places = {}
        for long, short, is_turned, k in wanted:
            across, down = math.ceil(long) + gap, math.ceil(short) + (gap if short > 4 else 1)
            if x + across > sheet:
                x, y, shelf = gap, y + shelf, 0
            if y + down > sheet or across + gap > sheet:
                return None
            # Tiny charts lie anywhere in their cells, over the middle of a texel or not.
            shift = (k * 0.37 % 1 * (math.ceil(long) - long), k * 0.61 % 1 * (math.ceil(short) - short))
            places[k] = (x + shift[0], y + shift[1], long, short, is_turned)
            x += across
            shelf = max(shelf, down)
        return places
    low, high, best = 0.1, 1000.0, None
    for _ in range(40):
        middle = math.sqrt(low * high)
        places = attempt(middle)
        if places:
            low, best = middle, places
        else:
            high = middle
    return [best[k] for k in range(len(patches))], low


def primitive_arrays(patches, places, sheet):
    """Positions, normals, texture coordinates and triangles of patches of one material."""
    positions, normals, coordinates, triangles = [], [], [], []
    for p, (x, y, w, h, is_turned) in zip(patches, places):
        base, columns = len(positions), len(p.points[0])
        for j, row in enumerate(p.points):
            for i, point in enumerate(row):
                a, b = p.chart[j][i]
                u, v = (b, 1 - a) if is_turned else (a, b)
                positions.append(point)
                normals.append(p.normals[j][i])
                coordinates.append(((x + u * w) / sheet, (y + v * h) / sheet))
        for j in range(len(p.points) - 1):
            for i in range(columns - 1):
                if p.skip(i, j):
                    continue
                a = base + j * columns + i
                for t in ((a, a + 1, a + columns + 1), (a, a + columns + 1, a + columns)):
                    corners = [positions[k] for k in t]
                    # At poles a side has no length.
                    if length(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]))) > 1e-12:
                        triangles.append(t)
    return positions, normals, coordinates, triangles


class Glb:
    """Collects accessors, then writes the file."""

    def __init__(self):
        self.blob, self.views, self.accessors = bytearray(), [], []

    def add(self, rows, kind, with_bounds=False):
        flat = [v for row in rows for v in row]
        is_index = kind == "SCALAR"
        self.views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": 4 * len(flat)})
        self.blob += struct.pack(f"<{len(flat)}{'I' if is_index else 'f'}", *flat)
        accessor = {"bufferView": len(self.views) - 1, "componentType": 5125 if is_index else 5126,
                    "count": len(flat) if is_index else len(rows), "type": kind}
        if with_bounds:
            stored = [struct.unpack("<3f", struct.pack("<3f", *row)) for row in rows]
            accessor["min"], accessor["max"] = ([f(c) for c in zip(*stored)] for f in (min, max))
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def write(self, path, document):
        document.update(accessors=self.accessors, bufferViews=self.views, buffers=[{"byteLength": len(self.blob)}])
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        with open(path, "wb") as file:
            file.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(self.blob)))
            file.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            file.write(struct.pack("<II", len(self.blob), 0x004E4942) + self.blob)


def material_json(name):
    reflectance, radiance, is_double_sided = MATERIALS[name]
    material = {"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*reflectance, 1], "metallicFactor": 0,
                                                       "roughnessFactor": 1}}
    if radiance:
        strength = max(radiance)
        material["emissiveFactor"] = [v / strength for v in radiance]
        material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
    if is_double_sided:
        material["doubleSided"] = True
    return material


def write_glb(scene, sheet, path):
    places, density = lay_out(scene, sheet)
    glb, names, nodes, meshes = Glb(), list(MATERIALS), [], []
    num_triangles = at = 0
    for name, patches in scene.objects.items():
        own = places[at:at + len(patches)]
        at += len(patches)
        primitives = []
        for material in names:
            chosen = [(p, q) for p, q in zip(patches, own) if p.material == material]
            if not chosen:
                continue
            positions, normals, coordinates, triangles = primitive_arrays(*zip(*chosen), sheet)
            num_triangles += len(triangles)
            primitives.append({"attributes": {"POSITION": glb.add(positions, "VEC3", True),
                                              "NORMAL": glb.add(normals, "VEC3"),
                                              # Importers count texture coordinates from 0.
                                              "TEXCOORD_0": glb.add(coordinates, "VEC2"),
                                              "TEXCOORD_1": len(glb.accessors) - 1},
                               "indices": glb.add(triangles, "SCALAR"), "material": names.index(material)})
        meshes.append({"name": name, "primitives": primitives})
        nodes.append({"name": name, "mesh": len(meshes) - 1})
    glb.write(path, {"asset": {"version": "2.0", "generator": "make_interior.py"}, "scene": 0,
                     "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes, "meshes": meshes,
                     "materials": [material_json(name) for name in names],
                     "extensionsUsed": ["KHR_materials_emissive_strength"]})
    fill = sum(w * h for _, _, w, h, _ in places) / sheet ** 2
    print(f"{path}: {num_triangles} triangles, {len(places)} charts, sheet {sheet}, {density:.1f} texels a metre, "
          f"{100 * fill:.0f} % filled")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT.glb")
    parser.add_argument("--small", action="store_true")
    arguments = parser.parse_args()
    detail = Detail(arguments.small)
    write_glb(build(detail), detail.sheet, arguments.out)
