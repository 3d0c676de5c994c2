"""LuxCore's PATHCPU: luxcore_peer.py FOLDER THREADS

Sobol without adaptation, box filter, no clamping. CPU seconds are those between start and the last pass; the engine stops at
whole passes, so what it took more than asked is divided out. Its glossy metal has the microfacets of GGX but Schlick's shadowing, which is
lighter at grazing angles than Smith's: glossy floors are 5 to 10 % brighter than everybody's. Nothing can be set about it."""
import os
import sys
import time

sys.path.append(__file__.rsplit("/", 1)[0])
from neutral import Scene, conductor_k, serve, write_pfm

import numpy as np
import pyluxcore as lux

lux.Init(lambda message: None)
folder, threads = sys.argv[1], int(sys.argv[2])
scene = Scene(folder)


def properties(said):
    p = lux.Properties()
    for key, value in said.items():
        p.Set(lux.Property(key, value))
    return p


def numbers(values):
    return [float(x) for x in values]


def sphere(centre, radius, rounds):
    """20 x 4^rounds triangles: few for lamps, or its light sampling breaks."""
    g = (1 + 5 ** 0.5) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    points = [np.array(p) / np.linalg.norm(p) for p in points]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
             (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(rounds):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                m = points[a] + points[b]
                middles[key] = len(points)
                points.append(m / np.linalg.norm(m))
            return middles[key]

        for a, b, c in faces:
            x, y, z = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, x, z), (b, y, x), (c, z, y), (x, y, z)]
        faces = finer
    return np.array(points) * radius + np.array(centre), np.array(faces)


made = lux.Scene()
c = scene.camera
made.Parse(properties({
    "scene.camera.type": "perspective", "scene.camera.lookat.orig": numbers(c["origin"]), "scene.camera.lookat.target": numbers(c["target"]),
    "scene.camera.up": [0.0, 1.0, 0.0], "scene.camera.fieldofview": c["fov_x"], "scene.camera.autovolume.enable": False,
    "scene.camera.cliphither": 0.001}))
for i, shape in enumerate(scene.shapes):
    g = shape["geometry"]
    points, faces = scene.mesh(shape) if "mesh" in g else sphere(g["sphere"]["centre"], g["sphere"]["radius"], 3 if shape["emission"] else 6)
    made.DefineMesh("mesh%d" % i, [tuple(numbers(p)) for p in points], [tuple(int(x) for x in f) for f in faces], None, None, None, None)
    m, n = shape["material"], "scene.materials.m%d." % i
    if m["kind"] == "diffuse":
        said = {n + "type": "matte", n + "kd": numbers(m["rgb"])}
    else:
        # Not "fresnelcolor", which is Schlick's polynomial and no conductor.
        said = {"scene.textures.f%d.type" % i: "fresnelconst", "scene.textures.f%d.n" % i: [1.0, 1.0, 1.0],
                "scene.textures.f%d.k" % i: numbers(conductor_k(m["f0"])), n + "type": "metal2", n + "fresnel": "f%d" % i,
                n + "uroughness": m["alpha"], n + "vroughness": m["alpha"]}
    if shape["emission"]:
        said[n + "emission"], said[n + "emission.gain"] = numbers(shape["emission"]), [1.0, 1.0, 1.0]
    made.Parse(properties(said))
    made.Parse(properties({"scene.objects.o%d.shape" % i: "mesh%d" % i, "scene.objects.o%d.material" % i: "m%d" % i}))
if scene.sky:
    made.Parse(properties({
        "scene.lights.sky.type": "infinite", "scene.lights.sky.file": scene.sky_map("luxcore"), "scene.lights.sky.colorspace": "nop",
        "scene.lights.sky.gamma": 1.0, "scene.lights.sky.gain": [1.0, 1.0, 1.0],
        # Its z up to our y up.
        "scene.lights.sky.transformation": [1.0, 0, 0, 0, 0, 0, -1.0, 0, 0, 1.0, 0, 0, 0, 0, 0, 1.0]}))


def render(request):
    spp, depth = request["spp"], scene.max_bounces + 1
    config = lux.RenderConfig(properties({
        "renderengine.type": "PATHCPU", "lightstrategy.type": "POWER", "sampler.type": "SOBOL", "sampler.sobol.adaptive.strength": 0.0,
        "renderengine.seed": request["seed"] + 1, "path.pathdepth.total": depth, "path.pathdepth.diffuse": depth, "path.pathdepth.glossy": depth,
        "path.pathdepth.specular": depth, "path.russianroulette.depth": 5, "path.clamping.variance.maxvalue": 0.0,
        "path.hybridbackforward.enable": False, "film.width": scene.width, "film.height": scene.height, "film.filter.type": "BOX",
        "film.filter.width": 0.5, "film.filter.xwidth": 0.5, "film.filter.ywidth": 0.5, "film.imagepipelines.0.0.type": "NOP",
        "batch.haltspp": spp, "film.noiseestimation.warmup": 10 ** 9, "film.outputs.0.type": "RGB", "film.outputs.0.filename": "x.exr",
        "native.threads.count": threads}), made)
    session = lux.RenderSession(config)
    session.Start()
    wall, cpu = time.time(), time.process_time()
    while True:
        session.UpdateStats()
        if session.HasDone() or session.GetStats().Get("stats.renderengine.pass").GetInt() >= spp:
            break
        time.sleep(0.02)
    wall, cpu = time.time() - wall, time.process_time() - cpu
    session.UpdateStats()
    taken = session.GetStats().Get("stats.renderengine.total.samplecount").GetFloat() / (scene.width * scene.height)
    session.Stop()
    pixels = np.zeros(scene.width * scene.height * 3, np.float32)
    session.GetFilm().GetOutputFloat(lux.FilmOutputType.RGB, pixels, 0)
    image = pixels.reshape(scene.height, scene.width, 3)[::-1]
    # Its rows lie one lower than everybody's; the lowest, which it lacks then, is repeated.
    write_pfm(request["out"], np.concatenate([image[1:], image[-1:]]))
    return {"seconds": wall * spp / taken, "cpu_seconds": cpu * spp / taken, "spp_taken": taken}


serve(render, version="LuxCore %s" % lux.Version())
os._exit(0)  # 2.11.2 aborts in its own teardown
