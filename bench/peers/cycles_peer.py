"""Blender's Cycles on the processor: cycles_peer.py FOLDER THREADS

Fixed samples, box filter, no denoiser, no clamping, no adaptive sampling, light tree on: as unbiased as it goes. A render by
script does everything anew, so CPU seconds are those of the call less those of the same call with one sample, times what that
one sample is of all: synchronising and building are not in them."""
import math
import sys
import time

sys.path.append(__file__.rsplit("/", 1)[0])
from neutral import Scene, conductor_k, serve, write_pfm

import bpy
import numpy as np
from mathutils import Matrix, Vector

folder, threads = sys.argv[1], int(sys.argv[2])
scene = Scene(folder)
bpy.ops.wm.read_factory_settings(use_empty=True)
blender = bpy.context.scene
blender.render.engine = "CYCLES"
c = blender.cycles
c.device = "CPU"
c.use_adaptive_sampling = c.use_denoising = c.use_guiding = c.use_fast_gi = c.use_auto_tile = False
c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = scene.max_bounces
c.min_light_bounces = 5
c.sample_clamp_direct = c.sample_clamp_indirect = c.blur_glossy = c.light_sampling_threshold = 0
c.caustics_reflective = c.caustics_refractive = True
c.use_light_tree = True
c.sampling_pattern = "TABULATED_SOBOL"
c.pixel_filter_type = "BOX"
r = blender.render
r.resolution_x, r.resolution_y, r.resolution_percentage = scene.width, scene.height, 100
r.use_persistent_data = False
r.threads_mode, r.threads = "FIXED", threads
r.image_settings.file_format, r.image_settings.color_depth = "OPEN_EXR", "32"
r.image_settings.color_mode, r.image_settings.exr_codec = "RGB", "NONE"
r.filepath = folder + "/cycles-out.exr"
r.use_file_extension = r.film_transparent = r.use_compositing = r.use_sequencer = False
r.dither_intensity = 0


def turned(p):
    """Our y up to Blender's z up."""
    return Vector((p[0], -p[2], p[1]))


def color(values):
    return [float(x) for x in values] + [1.0]


def material(shape, index):
    said = shape["material"]
    m = bpy.data.materials.new("m%d" % index)
    m.use_nodes = True
    nodes, links = m.node_tree.nodes, m.node_tree.links
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    if shape["emission"]:
        # One side shines: light where the back faces is mixed away.
        e, back = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeNewGeometry")
        strength = max(shape["emission"])
        e.inputs["Color"].default_value = color(x / strength for x in shape["emission"])
        e.inputs["Strength"].default_value = strength
        black = nodes.new("ShaderNodeBsdfDiffuse")
        black.inputs["Color"].default_value = color((0, 0, 0))
        mix = nodes.new("ShaderNodeMixShader")
        links.new(back.outputs["Backfacing"], mix.inputs[0])
        links.new(e.outputs[0], mix.inputs[1])
        links.new(black.outputs[0], mix.inputs[2])
        links.new(mix.outputs[0], out.inputs[0])
        m.cycles.emission_sampling = "FRONT"
    elif said["kind"] == "diffuse":
        b = nodes.new("ShaderNodeBsdfDiffuse")
        b.inputs["Color"].default_value = color(said["rgb"])
        b.inputs["Roughness"].default_value = 0
        links.new(b.outputs[0], out.inputs[0])
    else:
        b = nodes.new("ShaderNodeBsdfMetallic")
        b.distribution, b.fresnel_type = "GGX", "PHYSICAL_CONDUCTOR"
        b.inputs["IOR"].default_value = (1, 1, 1)
        b.inputs["Extinction"].default_value = [float(k) for k in conductor_k(said["f0"])]
        b.inputs["Roughness"].default_value = math.sqrt(said["alpha"])
        links.new(b.outputs[0], out.inputs[0])
    return m


def sphere(radius, rings=256):
    """Cycles has no spheres for surfaces: a quarter of a million triangles. Blender's own operator takes half a minute for them."""
    segments = 2 * rings
    theta = math.pi * np.arange(1, rings) / rings
    phi = 2 * math.pi * np.arange(segments) / segments
    body = np.stack([np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)),
                     np.outer(np.cos(theta), np.ones(segments))], -1).reshape(-1, 3)
    points = radius * np.concatenate([body, [(0, 0, 1), (0, 0, -1)]])
    i, j = np.meshgrid(np.arange(rings - 2), np.arange(segments), indexing="ij")
    k = (j + 1) % segments
    a, b, c, d = i * segments + j, (i + 1) * segments + j, (i + 1) * segments + k, i * segments + k
    j, k = np.arange(segments), (np.arange(segments) + 1) % segments
    top, bottom, last = len(body), len(body) + 1, (rings - 2) * segments
    triangles = [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3),
                 np.stack([j, k, np.full(segments, top)], -1), np.stack([last + k, last + j, np.full(segments, bottom)], -1)]
    return points, np.concatenate(triangles)


def surface(shape, index, points, triangles):
    mesh = bpy.data.meshes.new("mesh%d" % index)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.add(3 * len(triangles))
    mesh.loops.foreach_set("vertex_index", triangles.ravel().astype(np.int32))
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * len(triangles), 3, dtype=np.int32))
    mesh.shade_flat()
    mesh.update(calc_edges=True)
    mesh.validate()
    mesh.materials.append(material(shape, index))
    return bpy.data.objects.new("o%d" % index, mesh)


def lamp(shape, index, radius):
    # A lamp of radiance L and radius r has the power 4 pi^2 r^2 L.
    light = bpy.data.lights.new("l%d" % index, "POINT")
    light.shadow_soft_size, light.use_soft_falloff = radius, False
    strength = max(shape["emission"])
    light.color = [x / strength for x in shape["emission"]]
    light.energy = strength * 4 * math.pi ** 2 * radius ** 2
    light.cycles.use_multiple_importance_sampling = True
    return bpy.data.objects.new("o%d" % index, light)


def add(shape, index):
    if "mesh" in shape["geometry"]:
        points, triangles = scene.mesh(shape)
        made = surface(shape, index, np.stack([points[:, 0], -points[:, 2], points[:, 1]], -1), triangles)
    else:
        s = shape["geometry"]["sphere"]
        if shape["emission"]:
            # Lamps are transparent: what is behind them would shine through them in mirrors, but for a black core.
            core = {"material": {"kind": "diffuse", "rgb": (0, 0, 0)}, "emission": None}
            made = surface(core, index + 1000000, *sphere(0.995 * s["radius"], 64))
            made.location = turned(s["centre"])
            blender.collection.objects.link(made)
            made = lamp(shape, index, s["radius"])
        else:
            made = surface(shape, index, *sphere(s["radius"]))
        made.location = turned(s["centre"])
    blender.collection.objects.link(made)


for i, s in enumerate(scene.shapes):
    add(s, i)
world = bpy.data.worlds.new("w")
blender.world = world
world.use_nodes = True
nodes, links = world.node_tree.nodes, world.node_tree.links
nodes.clear()
out, background = nodes.new("ShaderNodeOutputWorld"), nodes.new("ShaderNodeBackground")
links.new(background.outputs[0], out.inputs[0])
if scene.sky:
    n = nodes.new("ShaderNodeTexEnvironment")
    n.image = bpy.data.images.load(scene.sky_map("cycles"))
    n.image.colorspace_settings.name = "Linear Rec.709"
    n.projection = "EQUIRECTANGULAR"
    links.new(n.outputs[0], background.inputs[0])
else:
    background.inputs[0].default_value = (0, 0, 0, 1)
camera = bpy.data.cameras.new("c")
camera.sensor_fit, camera.angle = "HORIZONTAL", math.radians(scene.camera["fov_x"])
camera.clip_start, camera.clip_end = 0.01, 1e5
o = bpy.data.objects.new("camera", camera)
blender.collection.objects.link(o)
blender.camera = o
eye = turned(scene.camera["origin"])
forward = (turned(scene.camera["target"]) - eye).normalized()
right = forward.cross(Vector((0, 0, 1))).normalized()
up = right.cross(forward)
o.matrix_world = Matrix(((right[0], up[0], -forward[0], eye[0]), (right[1], up[1], -forward[1], eye[1]),
                         (right[2], up[2], -forward[2], eye[2]), (0, 0, 0, 1)))


def call(samples, seed, write):
    c.samples, c.seed = samples, seed
    wall, cpu = time.time(), time.process_time()
    bpy.ops.render.render(write_still=write)
    return time.time() - wall, time.process_time() - cpu


def picture():
    image = bpy.data.images.load(r.filepath)
    image.colorspace_settings.name = "Linear Rec.709"
    w, h = image.size
    pixels = np.empty(w * h * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(h, w, 4)[::-1]


def render(request):
    spp = request["spp"]
    one = call(1, request["seed"], False)
    total = call(spp, request["seed"], True)
    share = spp / max(spp - 1, 1)
    write_pfm(request["out"], picture())
    return {"seconds": (total[0] - one[0]) * share, "cpu_seconds": (total[1] - one[1]) * share}


serve(render, version="Blender %s, Cycles" % bpy.app.version_string)
