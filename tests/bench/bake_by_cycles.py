"""Bakes the lightmap of a .glb by Cycles on the CPU, in Blender; bench_cycles.py starts it.

  blender -b --factory-startup --python bake_by_cycles.py -- SCENE.glb OUT.npy --size N --spp N [--seed N] [--threads N]

OUT.npy: [size, size, 4] float32, rows from the top as glTF counts them; irradiance / pi of direct and indirect light,
alpha 1 inside charts. The layout is the file's TEXCOORD_1. Materials are exact Lambertian ones with the file's base
colours and emission, or their textures: no lamps, black surroundings. What glows does so on its front; Cycles takes surfaces that reflect for double-sided.
The last line on stdout is JSON: CPU and wall seconds of the bake alone, without start, import and files.
"""
import argparse
import json
import resource
import struct
import sys
import time

import numpy as np

np.bool = bool  # Blender 3.4's importer uses the name that numpy has dropped

import bpy  # noqa: E402


def cpu_seconds():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def read_materials(path):
    """{name: (base colour, radiance, PNG of whichever has a texture)} of a .glb."""
    with open(path, "rb") as file:
        length, = struct.unpack("<12xI4x", file.read(20))
        gltf = json.loads(file.read(length))
        blob = file.read()[8:]
    materials = {}
    for m in gltf["materials"]:
        strength = m.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
        radiance = [strength * v for v in m.get("emissiveFactor", (0, 0, 0))]
        surface = m.get("pbrMetallicRoughness", {})
        texture = m.get("emissiveTexture") if max(radiance) > 0 else surface.get("baseColorTexture")
        png = None
        if texture:
            view = gltf["bufferViews"][gltf["images"][gltf["textures"][texture["index"]]["source"]]["bufferView"]]
            png = blob[view.get("byteOffset", 0):][:view["byteLength"]]
        materials[m["name"]] = surface.get("baseColorFactor", (1, 1, 1, 1))[:3], radiance, png
    return materials


def import_as_one(path):
    """One object with all meshes: Blender starts its renderer anew for each object that is baked."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    meshes = [o for o in bpy.context.scene.objects if o.type == "MESH"]
    bpy.ops.object.select_all(action="DESELECT")
    for o in meshes:
        o.select_set(True)
    bpy.context.view_layer.objects.active = meshes[0]
    if len(meshes) > 1:
        bpy.ops.object.join()
    return bpy.context.view_layer.objects.active


def add_texture(nodes, png, name):
    """As TEXCOORD_0 lays it; its factors are all one in what is compared."""
    image = bpy.data.images.new(name, 1, 1)
    image.pack(data=png, data_len=len(png))
    image.source = "FILE"
    image.colorspace_settings.name = "sRGB"
    node = nodes.new("ShaderNodeTexImage")
    node.image = image
    return node


def make_lambertian(material, reflectance, radiance, png, image):
    """A diffuse or glowing surface, and the image that the bake goes to."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    textured = add_texture(nodes, png, material.name) if png else None
    if max(radiance) > 0:
        surface = nodes.new("ShaderNodeEmission")
        strength = max(radiance)
        surface.inputs["Color"].default_value = (*(v / strength for v in radiance), 1)
        surface.inputs["Strength"].default_value = strength
    else:
        surface = nodes.new("ShaderNodeBsdfDiffuse")
        surface.inputs["Color"].default_value = (*reflectance, 1)
        surface.inputs["Roughness"].default_value = 0
    if textured:
        coordinates = nodes.new("ShaderNodeUVMap")
        coordinates.uv_map = "UVMap"  # as the importer names TEXCOORD_0
        links.new(coordinates.outputs["UV"], textured.inputs["Vector"])
        links.new(textured.outputs["Color"], surface.inputs["Color"])
    seen = surface
    if max(radiance) > 0:
        # Dark on the back.
        seen, dark = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBsdfDiffuse")
        dark.inputs["Color"].default_value = (0, 0, 0, 1)
        links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], seen.inputs[0])
        links.new(surface.outputs[0], seen.inputs[1])
        links.new(dark.outputs[0], seen.inputs[2])
    links.new(seen.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    target = nodes.new("ShaderNodeTexImage")
    target.image = image
    nodes.active = target


def set_up(scene, threads):
    scene.world = bpy.data.worlds.new("black")
    scene.world.color = (0, 0, 0)
    scene.render.engine = "CYCLES"
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    cycles, bake = scene.cycles, scene.render.bake
    cycles.device = "CPU"
    # Unbiased: no limit on bounces that matters, no clamp, no denoiser.
    cycles.max_bounces = cycles.diffuse_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    bake.use_pass_direct = bake.use_pass_indirect = True
    bake.use_pass_color = False
    return cycles


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("--size", type=int, required=True)
    parser.add_argument("--spp", type=int, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])

    baked = import_as_one(arguments.scene)
    image = bpy.data.images.new("lightmap", arguments.size, arguments.size, alpha=True, float_buffer=True)
    materials = read_materials(arguments.scene)
    for slot in baked.material_slots:
        make_lambertian(slot.material, *materials[slot.material.name], image)
    layout = baked.data.uv_layers[-1]  # TEXCOORD_1
    layout.active = layout.active_render = True
    cycles = set_up(bpy.context.scene, arguments.threads)
    cycles.samples, cycles.seed = arguments.spp, arguments.seed

    wall, cpu = time.monotonic(), cpu_seconds()
    bpy.ops.object.bake(type="DIFFUSE", margin=0, use_clear=True)
    wall, cpu = time.monotonic() - wall, cpu_seconds() - cpu

    pixels = np.empty(arguments.size * arguments.size * 4, np.float32)
    image.pixels.foreach_get(pixels)
    np.save(arguments.out, pixels.reshape(arguments.size, arguments.size, 4)[::-1])
    print(json.dumps({"cpu_seconds": cpu, "wall_seconds": wall, "spp": arguments.spp,
                      "triangles": sum(len(p.vertices) - 2 for p in baked.data.polygons)}), flush=True)


main()
