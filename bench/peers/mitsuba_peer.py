"""Mitsuba 3: mitsuba_peer.py FOLDER THREADS VARIANT SAMPLER

CPU seconds are those of mi.render and of copying the picture out, after a first render of the same size, so that LLVM's
compilation is not in them; what that first one took more is said apart."""
import sys
import time

sys.path.append(__file__.rsplit("/", 1)[0])
from neutral import Scene, conductor_k, serve, write_pfm

import numpy as np
import drjit as dr
import mitsuba as mi

folder, threads, variant, sampler = sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4]
mi.set_variant(variant)
mi.set_log_level(mi.LogLevel.Error)
scene = Scene(folder)
jit = not variant.startswith("scalar")


def rgb(values):
    return {"type": "rgb", "value": [float(x) for x in values]}


def bsdf(material):
    if material["kind"] == "diffuse":
        inner = {"type": "diffuse", "reflectance": rgb(material["rgb"])}
    else:
        inner = {"type": "roughconductor", "distribution": "ggx", "alpha": material["alpha"], "eta": rgb([1, 1, 1]),
                 "k": rgb(conductor_k(material["f0"]))}
    return {"type": "twosided", "inner": inner}


def shape_of(shape):
    geometry = shape["geometry"]
    if "mesh" in geometry:
        # A file of one's own is the only way that is quick in all variants.
        points, triangles = scene.mesh(shape)
        name = "%s/mitsuba-%s.ply" % (folder, shape["name"])
        with open(name, "wb") as f:
            f.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
                     "element face %d\nproperty list uchar int vertex_indices\nend_header\n" % (len(points), len(triangles))).encode())
            f.write(points.tobytes())
            rows = np.empty(len(triangles), dtype=[("n", "u1"), ("i", "<u4", 3)])
            rows["n"], rows["i"] = 3, triangles
            f.write(rows.tobytes())
        said = {"type": "ply", "filename": name, "face_normals": True}
    else:
        s = geometry["sphere"]
        said = {"type": "sphere", "center": s["centre"], "radius": s["radius"]}
    said["bsdf"] = bsdf(shape["material"])
    if shape["emission"]:
        said["emitter"] = {"type": "area", "radiance": rgb(shape["emission"])}
    return said


def sensor():
    c = scene.camera
    T = mi.ScalarTransform4f
    film = {"type": "hdrfilm", "width": scene.width, "height": scene.height, "pixel_format": "rgb", "component_format": "float32",
            "rfilter": {"type": "box"}}
    return {"type": "perspective", "fov": c["fov_x"], "fov_axis": "x", "near_clip": 0.01, "far_clip": 1e4,
            "to_world": T().look_at(origin=c["origin"], target=c["target"], up=[0, 1, 0]), "film": film,
            "sampler": {"type": sampler, "sample_count": 16}}


said = {"type": "scene", "integrator": {"type": "path", "max_depth": scene.max_bounces + 1, "rr_depth": 5}, "sensor": sensor()}
for i, s in enumerate(scene.shapes):
    said["shape%d" % i] = shape_of(s)
if scene.sky:
    said["sky"] = {"type": "envmap", "filename": scene.sky_map("mitsuba")}
start = time.time()
# Loading in parallel waits for itself for ever when there is one thread.
loaded = mi.load_dict(said, parallel=False)
dr.set_thread_count(threads)
if jit:
    dr.sync_thread()
load_seconds = time.time() - start
warm = set()


def timed(spp, seed):
    # At most 2^24 samples at once, or memory runs out.
    passes = -(-spp * scene.width * scene.height // 2 ** 24)
    while spp % passes:
        passes += 1
    wall, cpu = time.time(), time.process_time()
    image = 0
    for i in range(passes):
        image = image + np.array(mi.render(loaded, spp=spp // passes, seed=seed + 7919 * i))
    image = image / passes
    return image, time.time() - wall, time.process_time() - cpu


def render(request):
    spp, seed = request["spp"], request["seed"]
    answer = {}
    if jit and spp not in warm:
        first = timed(spp, seed + 1000003)
        answer["first_seconds"], answer["first_cpu_seconds"] = first[1], first[2]
        warm.add(spp)
    image, seconds, cpu = timed(spp, seed)
    write_pfm(request["out"], image)
    return dict(answer, seconds=seconds, cpu_seconds=cpu)


serve(render, version="Mitsuba %s, Dr.Jit %s, %s, %s sampler" % (mi.__version__, dr.__version__, variant, sampler), load_seconds=load_seconds)
