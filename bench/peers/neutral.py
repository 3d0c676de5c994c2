"""What the drivers of all peers share: the neutral scene, pictures out, and the conversation with the benchmark.

A driver is started with the folder of a scene and the number of threads. It loads, says {"ready": ...}, then answers each
line of JSON on standard input ({"spp", "seed", "out"}) with one on standard output. Answers begin with "BENCH ", because
renderers talk too."""
import json
import os
import resource
import sys

import numpy as np


class Scene:
    """scene.json as attributes; arrays of a shape's mesh by mesh()."""

    def __init__(self, folder):
        self.folder = folder
        self.__dict__.update(json.load(open(os.path.join(folder, "scene.json"))))
        self.bytes = np.fromfile(os.path.join(folder, "geometry.bin"), np.uint8)

    def mesh(self, shape):
        """Points (n, 3) float32 and triangles (m, 3) uint32."""
        m = shape["geometry"]["mesh"]
        middle = m["offset"] + 12 * m["points"]
        points = self.bytes[m["offset"]:middle].view(np.float32).reshape(-1, 3)
        triangles = self.bytes[middle:middle + 12 * m["triangles"]].view(np.uint32).reshape(-1, 3)
        return points, triangles

    def sky_map(self, kind):
        return os.path.join(self.folder, "sky-%s.exr" % kind)


def conductor_k(f0):
    """Extinction of a conductor with eta = 1 and this reflectance at normal incidence."""
    f0 = np.array(f0, np.float64)
    return 2 * np.sqrt(f0 / (1 - f0))


def write_pfm(path, image):
    """Rows from the top; PFM stores them from the bottom."""
    image = np.ascontiguousarray(image[::-1, :, :3], "<f4")
    with open(path, "wb") as f:
        f.write(b"PF\n%d %d\n-1.0\n" % (image.shape[1], image.shape[0]))
        f.write(image.tobytes())


def say(**what):
    sys.stdout.write("BENCH " + json.dumps(what) + "\n")
    sys.stdout.flush()


def serve(render, **ready):
    """Answers requests with what render(request) returns, until standard input ends."""
    say(ready=True, **ready)
    for line in sys.stdin:
        answer = render(json.loads(line))
        answer["peak_memory_bytes"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        say(**answer)
