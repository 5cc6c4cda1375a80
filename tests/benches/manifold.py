#!/usr/bin/env python3
"""Times manifold (pip install manifold3d) on the balls that `PATCHWRIGHT_DUMP=FOLDER cargo bench --bench mesh` wrote.

What is timed is the whole boolean, which is the nearest thing to a query that its interface has: broad phase, edge-triangle
intersections and the assembly of the result. Building a manifold (with its tree) from triangles is timed by itself.
"""

import statistics
import sys
import time
from pathlib import Path

import manifold3d
import numpy


def ball(folder, name):
    points = numpy.fromfile(folder / f"{name}.f64").reshape(-1, 3)
    triangles = numpy.fromfile(folder / f"{name}.u32", dtype=numpy.uint32).reshape(-1, 3)
    return manifold3d.Mesh64(points, triangles.astype(numpy.uint64))


def main():
    folder = Path(sys.argv[1])
    for a in sorted(folder.glob("a*.f64"), key=lambda path: path.stat().st_size):
        meshes = [ball(folder, a.stem), ball(folder, "b" + a.stem[1:])]
        builds, booleans = [], []
        for _ in range(3):
            start = time.perf_counter()
            a, b = [manifold3d.Manifold(mesh) for mesh in meshes]
            counts = [a.num_tri(), b.num_tri()]
            middle = time.perf_counter()
            found = (a ^ b).num_tri()
            builds.append(middle - start)
            booleans.append(time.perf_counter() - middle)
        build, boolean = [1e3 * statistics.median(times) for times in (builds, booleans)]
        print(f"{counts[0]:9} x {counts[1]:<9} manifold: built {build:7.0f} ms, boolean {boolean:7.1f} ms, {found} triangles")


main()
