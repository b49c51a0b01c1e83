"""Closest hits by Embree (pip install embreex), for benches/trace.rs.

    embree.py VERTICES TRIANGLES RAYS DISTANCES

Reads packed 32-bit numbers: vertices, indices, rays (origin and direction). For each line on standard input it traces
all rays once and prints the seconds that took. Where the input ends it writes the distances, infinite for misses.

embreex traces in one thread and one ray at a time, so each processor gets a process of its own with a share of the
rays; the slowest counts.
"""

import multiprocessing
import os
import sys
import time

import numpy
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

vertices, triangles, rays, distances = sys.argv[1:]
vertices = numpy.fromfile(vertices, numpy.float32).reshape(-1, 3)
triangles = numpy.fromfile(triangles, numpy.int32).reshape(-1, 3)
rays = numpy.fromfile(rays, numpy.float32).reshape(-1, 2, 3)

scene = rtcore_scene.EmbreeScene()
mesh = TriangleMesh(scene, vertices, triangles)


def trace(share):
    origins, directions = (numpy.ascontiguousarray(share[:, i]) for i in range(2))
    start = time.perf_counter()
    hits = scene.run(origins, directions, query="INTERSECT", output=True)
    seconds = time.perf_counter() - start
    return seconds, numpy.where(hits["primID"] >= 0, hits["tfar"], numpy.inf).astype(numpy.float32)


count = len(os.sched_getaffinity(0))
# The scene is built at the first ray: before the processes part, so that they share it.
trace(rays[:1])
with multiprocessing.get_context("fork").Pool(count) as pool:
    shares = numpy.array_split(rays, count)
    for _ in sys.stdin:
        results = pool.map(trace, shares, chunksize=1)
        print(max(seconds for seconds, _ in results), flush=True)
    numpy.concatenate([hits for _, hits in results]).tofile(distances)
