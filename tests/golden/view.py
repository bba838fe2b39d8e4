"""Renders a baked .glb with its lightmap, for looking at small scenes: a seam, a leak or an upside-down chart shows.

  view.py SCENE.glb LIGHTMAP.exr PICTURE.png [--eye X,Y,Z] [--target X,Y,Z] [--fov DEGREES] [--size PIXELS]

Every pixel against every triangle, in numpy: meant for hundreds of triangles. Colour is base colour times irradiance
over pi plus emission, bilinear look-ups, exposed so that the brightest hundredth of the surfaces that do not emit is
just below white. Reads meshes of node trees without transforms only. Needs Debian's python3-numpy and
python3-openimageio.
"""
import argparse
import json
import struct

import numpy as np
import OpenImageIO as oiio


def read_glb(path):
    """-> triangles [n, 3, 3], lightmap coordinates [n, 3, 2], reflectance [n, 3], emission [n, 3]"""
    data = open(path, "rb").read()
    length = struct.unpack("<I", data[12:16])[0]
    gltf, blob = json.loads(data[20:20 + length]), data[28 + length:]

    def accessor(index):
        a = gltf["accessors"][index]
        view = gltf["bufferViews"][a["bufferView"]]
        kind = {5126: np.float32, 5123: np.uint16, 5125: np.uint32}[a["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[a["type"]]
        start = view.get("byteOffset", 0) + a.get("byteOffset", 0)
        return np.frombuffer(blob, kind, a["count"] * width, start).reshape(-1, width)

    corners, coordinates, reflectance, emission = [], [], [], []
    for mesh in gltf["meshes"]:
        for primitive in mesh["primitives"]:
            index = accessor(primitive["indices"]).reshape(-1, 3)
            corners.append(accessor(primitive["attributes"]["POSITION"])[index])
            coordinates.append(accessor(primitive["attributes"]["TEXCOORD_1"])[index])
            material = gltf["materials"][primitive["material"]]
            base = material.get("pbrMetallicRoughness", {}).get("baseColorFactor", [1, 1, 1, 1])[:3]
            strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {})
            glow = np.array(material.get("emissiveFactor", [0, 0, 0])) * strength.get("emissiveStrength", 1)
            reflectance.append(np.tile(base, (len(index), 1)))
            emission.append(np.tile(glow, (len(index), 1)))
    return [np.concatenate(x).astype(np.float64) for x in (corners, coordinates, reflectance, emission)]


def bilinear(image, uv):
    """Rows from the top; texel centres at half numbers."""
    height, width = image.shape[:2]
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]

    def texel(dx, dy):
        return image[np.clip(y0 + dy, 0, height - 1), np.clip(x0 + dx, 0, width - 1), :3]
    return ((texel(0, 0) * (1 - fx) + texel(1, 0) * fx) * (1 - fy) + (texel(0, 1) * (1 - fx) + texel(1, 1) * fx) * fy)


def render(scene, lightmap, eye, target, fov, size):
    corners, coordinates, reflectance, emission = scene
    forward = target - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    scale = np.tan(np.radians(fov) / 2)
    samples = (np.arange(2 * size) + 0.5) / size - 1  # two by two a pixel
    px, py = np.meshgrid(samples, -samples)
    rays = (forward + scale * (px[..., None] * right + py[..., None] * up)).reshape(-1, 3)

    nearest = np.full(len(rays), np.inf)
    colour = np.zeros((len(rays), 3))
    glows = np.zeros(len(rays), bool)
    for (a, b, c), uv, rho, glow in zip(corners, coordinates, reflectance, emission):
        e1, e2 = b - a, c - a
        p = np.cross(rays, e2)
        determinant = p @ e1
        with np.errstate(divide="ignore", invalid="ignore"):
            s = eye - a
            u = p @ s / determinant
            q = np.cross(s, e1)
            v = rays @ q / determinant
            t = e2 @ q / determinant
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < nearest)
        w = np.stack([1 - u[hit] - v[hit], u[hit], v[hit]], 1)
        colour[hit] = rho * bilinear(lightmap, w @ uv) / np.pi + glow
        glows[hit] = glow.max() > 0
        nearest[hit] = t[hit]
    lit = colour[~glows & np.isfinite(nearest)]
    colour *= 0.95 / np.percentile(lit.max(1), 99)
    srgb = np.clip(colour, 0, 1)
    srgb = np.where(srgb < 0.0031308, 12.92 * srgb, 1.055 * srgb ** (1 / 2.4) - 0.055)
    return srgb.reshape(size, 2, size, 2, 3).mean((1, 3)).astype(np.float32)


if __name__ == "__main__":
    def triple(text):
        return np.array([float(x) for x in text.split(",")])

    ap = argparse.ArgumentParser()
    ap.add_argument("scene")
    ap.add_argument("lightmap")
    ap.add_argument("picture")
    ap.add_argument("--eye", type=triple, default="0,1,4.6")
    ap.add_argument("--target", type=triple, default="0,1,0")
    ap.add_argument("--fov", type=float, default=32)
    ap.add_argument("--size", type=int, default=512)
    a = ap.parse_args()
    pixels = render(read_glb(a.scene), oiio.ImageBuf(a.lightmap).get_pixels(oiio.FLOAT), a.eye, a.target, a.fov, a.size)
    out = oiio.ImageBuf(oiio.ImageSpec(a.size, a.size, 3, oiio.UINT8))
    out.set_pixels(oiio.ROI(), pixels)
    if not out.write(a.picture):
        raise SystemExit(out.geterror())
