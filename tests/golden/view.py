"""Renders a baked .glb with its lightmap, for looking at small scenes: a seam, a leak or an upside-down chart shows.

  view.py SCENE.glb LIGHTMAPS PICTURE.png [--eye X,Y,Z] [--target X,Y,Z] [--up X,Y,Z] [--fov DEGREES] [--size PIXELS]
                                          [--exposure E]

LIGHTMAPS is one EXR for the whole scene, or the folder of the EXRs that the scene's MOZ_lightmap textures are named
after. Every pixel against every triangle, in numpy: meant for hundreds of triangles. A pixel is luminance (base colour
times irradiance over pi, plus emission; bilinear look-ups) times the exposure; without one, the brightest hundredth of
the surfaces that do not emit is just below white. Not drawn: vertex colours, opacity, texture transforms.
Needs Debian's python3-numpy and python3-openimageio.
"""
import argparse
import base64
import json
import os
import pathlib
import struct
import tempfile

import numpy as np
import OpenImageIO as oiio

COMPONENTS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def read_image(path, is_srgb=False):
    """[height, width, 3] float64, linear; grey is three equal channels."""
    pixels = np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT), np.float64)
    pixels = pixels[..., :3] if pixels.shape[2] >= 3 else np.repeat(pixels[..., :1], 3, 2)
    return np.where(pixels <= 0.04045, pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4) if is_srgb else pixels


class Glb:
    """What a drawing needs of a .glb with one buffer."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        length, = struct.unpack_from("<I", data, 12)
        self.gltf, self.blob = json.loads(data[20:20 + length]), data[28 + length:]

    def accessor(self, index):
        a = self.gltf["accessors"][index]
        if "sparse" in a or "bufferView" not in a:
            raise SystemExit(f"accessor {index}: sparse accessors are not drawn")
        view = self.gltf["bufferViews"][a["bufferView"]]
        kind, width = np.dtype(COMPONENTS[a["componentType"]]), WIDTHS[a["type"]]
        start = view.get("byteOffset", 0) + a.get("byteOffset", 0)
        stride = view.get("byteStride", kind.itemsize * width)
        values = np.ndarray((a["count"], width), kind, self.blob, start, (stride, kind.itemsize))
        if a.get("normalized"):
            return np.maximum(values.astype(np.float64) / np.iinfo(kind).max, -1)
        return values if a["type"] == "SCALAR" else values.astype(np.float64)

    def texture_image(self, texture):
        return self.gltf["images"][self.gltf["textures"][texture]["source"]]

    def texture(self, texture, is_srgb):
        image = self.texture_image(texture)
        if "bufferView" in image:
            view = self.gltf["bufferViews"][image["bufferView"]]
            data = self.blob[view.get("byteOffset", 0):][:view["byteLength"]]
        else:
            data = base64.b64decode(image["uri"].split(",", 1)[1])
        with tempfile.NamedTemporaryFile(suffix="." + image.get("mimeType", "image/png").split("/")[1]) as file:
            file.write(data)
            file.flush()
            return read_image(file.name, is_srgb)

    def placed_meshes(self):
        """(mesh, matrix to the world) of every node of the scene that has a mesh."""
        nodes = [(index, np.eye(4)) for index in self.gltf["scenes"][self.gltf.get("scene", 0)]["nodes"]]
        while nodes:
            index, parent = nodes.pop(0)
            node = self.gltf["nodes"][index]
            matrix = parent @ local_matrix(node)
            nodes += [(child, matrix) for child in node.get("children", [])]
            if "mesh" in node:
                yield self.gltf["meshes"][node["mesh"]], matrix


def local_matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                               [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                               [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


class Surface:
    """A primitive in the world: corners [n, 3, 3], and a function from weights of a triangle's corners to luminance."""

    def __init__(self, glb, primitive, matrix, lightmaps):
        attributes = primitive["attributes"]
        positions = glb.accessor(attributes["POSITION"])
        index = np.arange(len(positions)) if "indices" not in primitive else glb.accessor(primitive["indices"])
        if primitive.get("mode", 4) != 4:
            raise SystemExit(f"a primitive of mode {primitive['mode']}: triangles only are drawn")
        index = index.reshape(-1, 3)
        self.corners = (positions @ matrix[:3, :3].T + matrix[:3, 3])[index]
        material = glb.gltf["materials"][primitive["material"]] if "material" in primitive else {}
        self.is_mirrored = np.linalg.det(matrix[:3, :3]) < 0
        self.is_double_sided = material.get("doubleSided", False)
        self.coordinates = {key: glb.accessor(value)[index] for key, value in attributes.items() if "TEXCOORD" in key}

        surface, extensions = material.get("pbrMetallicRoughness", {}), material.get("extensions", {})
        colour = np.array(surface.get("baseColorFactor", (1, 1, 1, 1))[:3]) * (1 - surface.get("metallicFactor", 1))
        strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
        self.emission = np.array(material.get("emissiveFactor", (0, 0, 0))) * strength
        self.layers = [self.layer(glb, colour, surface.get("baseColorTexture")),
                       self.layer(glb, self.emission, material.get("emissiveTexture"))]
        self.lightmap = lightmaps.of(glb, extensions.get("MOZ_lightmap"))

    @staticmethod
    def layer(glb, factor, texture):
        """factor, image or None, its coordinates"""
        if texture is None:
            return factor, None, None
        return factor, glb.texture(texture["index"], True), f"TEXCOORD_{texture.get('texCoord', 0)}"

    def luminance(self, triangle, weights):
        """weights [k, 3] -> [k, 3]"""
        def value(factor, image, key):
            return factor if image is None else factor * bilinear(image, weights @ self.coordinates[key][triangle], True)
        reflectance, glow = (value(*layer) for layer in self.layers)
        irradiance = bilinear(self.lightmap, weights @ self.coordinates["TEXCOORD_1"][triangle], False)
        return reflectance * irradiance / np.pi + glow


class Lightmaps:
    """One EXR for all, or a folder of those that textures are named after."""

    def __init__(self, path):
        self.path, self.images = pathlib.Path(path), {}

    def of(self, glb, extension):
        path = self.path
        if path.is_dir():
            if extension is None:
                return np.zeros((1, 1, 3))
            path /= glb.texture_image(extension["index"])["name"] + ".exr"
        if path not in self.images:
            self.images[path] = read_image(path)
        return self.images[path]


def bilinear(image, uv, repeats):
    """Rows from the top; texel centres at half numbers."""
    height, width = image.shape[:2]
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]

    def texel(dx, dy):
        if repeats:
            return image[(y0 + dy) % height, (x0 + dx) % width]
        return image[np.clip(y0 + dy, 0, height - 1), np.clip(x0 + dx, 0, width - 1)]
    return ((texel(0, 0) * (1 - fx) + texel(1, 0) * fx) * (1 - fy) + (texel(0, 1) * (1 - fx) + texel(1, 1) * fx) * fy)


def render(glb, lightmaps, eye, target, up, fov, size, exposure=None):
    """-> picture [size, size, 3] in sRGB, share of each pixel that a surface covers [size, size]"""
    forward = target - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    upward = np.cross(right, forward)
    scale = np.tan(np.radians(fov) / 2)
    samples = (np.arange(2 * size) + 0.5) / size - 1  # two by two a pixel
    px, py = np.meshgrid(samples, -samples)
    rays = (forward + scale * (px[..., None] * right + py[..., None] * upward)).reshape(-1, 3)

    nearest = np.full(len(rays), np.inf)
    colour = np.zeros((len(rays), 3))
    glows = np.zeros(len(rays), bool)
    for mesh, matrix in glb.placed_meshes():
        for primitive in mesh["primitives"]:
            surface = Surface(glb, primitive, matrix, lightmaps)
            for triangle, (a, b, c) in enumerate(surface.corners):
                e1, e2, s = b - a, c - a, eye - a
                p, q = np.cross(rays, e2), np.cross(eye - a, b - a)
                determinant = p @ e1  # positive where the front is seen
                with np.errstate(divide="ignore", invalid="ignore"):
                    u, v, t = p @ s / determinant, rays @ q / determinant, e2 @ q / determinant
                    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < nearest)
                if not surface.is_double_sided:
                    hit &= (determinant < 0) if surface.is_mirrored else (determinant > 0)
                colour[hit] = surface.luminance(triangle, np.stack([1 - u[hit] - v[hit], u[hit], v[hit]], 1))
                glows[hit] = surface.emission.max() > 0
                nearest[hit] = t[hit]
    covered = np.isfinite(nearest)
    if exposure is None:
        exposure = 0.95 / np.percentile(colour[~glows & covered].max(1), 99)
    linear = np.clip(exposure * colour, 0, 1)
    srgb = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return (srgb.reshape(size, 2, size, 2, 3).mean((1, 3)).astype(np.float32),
            covered.reshape(size, 2, size, 2).mean((1, 3)))


def write_picture(path, pixels):
    image = oiio.ImageBuf(oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.UINT8))
    image.set_pixels(oiio.ROI(), np.ascontiguousarray(pixels))
    if not image.write(os.fspath(path)):
        raise SystemExit(image.geterror())


if __name__ == "__main__":
    def triple(text):
        return np.array([float(x) for x in text.split(",")])

    ap = argparse.ArgumentParser()
    ap.add_argument("scene")
    ap.add_argument("lightmaps")
    ap.add_argument("picture")
    ap.add_argument("--eye", type=triple, default="0,1,4.6")
    ap.add_argument("--target", type=triple, default="0,1,0")
    ap.add_argument("--up", type=triple, default="0,1,0")
    ap.add_argument("--fov", type=float, default=32)
    ap.add_argument("--size", type=int, default=512)
    ap.add_argument("--exposure", type=float)
    a = ap.parse_args()
    pixels, _ = render(Glb(a.scene), Lightmaps(a.lightmaps), a.eye, a.target, a.up, a.fov, a.size, a.exposure)
    write_picture(a.picture, pixels)
