#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Targets after the rows of table 1 of [Inv18], inverted one by one into a table of results.

    bench/inversion_cases.py build/release/bin/tenter OUT [--only skirt,page] [--time-budget 60] [--table FILE.md]

The shapes are generated: surfaces of revolution and their like in metres, resting on analytic bodies. Materials and
friction are those of the paper times a factor for each case: a guess, and not every case is certified with it.
"""
import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np


def grid_triangles(columns, rows, closed):
    faces = []
    for j in range(rows - 1):
        for i in range(columns if closed else columns - 1):
            a, b = j * columns + i, j * columns + (i + 1) % columns
            c, d = a + columns, b + columns
            faces += [(a, d, b), (a, c, d)] if (i + j) % 2 == 0 else [(a, c, b), (b, c, d)]
    return faces


def tube(columns, rows, radius, height):
    """Rows from the top down; radius(s, angle) and height(s) with s in 0..1."""
    points = []
    for j in range(rows):
        s = j / (rows - 1)
        for i in range(columns):
            angle = 2.0 * np.pi * i / columns
            r = radius(s, angle)
            points.append((r * np.cos(angle), r * np.sin(angle), height(s)))
    return np.array(points), grid_triangles(columns, rows, True)


def disc(columns, rings, radius, height):
    """A pole, then rings outwards."""
    points, faces = [(0.0, 0.0, height(0.0, 0.0))], []
    for j in range(1, rings + 1):
        s = j / rings
        for i in range(columns):
            angle = 2.0 * np.pi * i / columns
            r = radius(s, angle)
            points.append((r * np.cos(angle), r * np.sin(angle), height(s, angle)))
    faces += [(0, 1 + i, 1 + (i + 1) % columns) for i in range(columns)]
    faces += [tuple(v + 1 for v in f) for f in grid_triangles(columns, rings, True)]
    return np.array(points), faces


def smooth(t):
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def skirt(columns, rows, lobes, depth, contact_rows, flare):
    slope, top = 0.5, 0.12  # of the cone that carries it

    def radius(s, angle):
        z = 0.4 * s
        free = max(0.0, s - (contact_rows - 1) / (rows - 1))
        return top + slope * z + flare * free * free * (1.0 + depth * np.cos(lobes * angle))

    points, faces = tube(columns, rows, radius, lambda s: -0.4 * s)
    return points, faces, [f"cone:0,0,0,0,0,-1,{top},{top + slope}"]


def page(n):
    radius = 0.06
    angle = np.pi * np.arange(n) / (n - 1)
    points = [(-radius * np.cos(angle[i]), 0.25 * j / (n - 1), radius * np.sin(angle[i]) * (0 < i < n - 1))
              for j in range(n) for i in range(n)]
    return np.array(points), grid_triangles(n, n, False), ["plane:0,0,0,0,0,1"]


HEAD = 0.1


def beret(columns, rings):
    """Over the top, out to a soft edge, and back in to a band around the head."""
    band = 55.0 * np.pi / 180.0

    def profile(s):
        if s >= 0.92:
            polar = band + (s - 0.92) * 2.2
            return HEAD * np.sin(polar), HEAD * np.cos(polar)
        t = s / 0.92
        angle = np.pi * 0.86 * t
        out = 0.17 * np.sin(angle) if angle < np.pi / 2 else None
        edge_r, edge_z = 0.15, HEAD * np.cos(band) + 0.035
        end_r, end_z = HEAD * np.sin(band), HEAD * np.cos(band)
        if t < 0.6:
            u = t / 0.6
            return edge_r * np.sin(0.5 * np.pi * u), edge_z + 0.045 * np.cos(0.5 * np.pi * u)
        u = (t - 0.6) / 0.4
        return edge_r + (end_r - edge_r) * u * u * (3 - 2 * u) if out is None else edge_r - (edge_r - end_r) * u, (
            edge_z - (edge_z - end_z) * np.sin(0.5 * np.pi * u))

    points, faces = disc(columns, rings, lambda s, a: profile(s)[0], lambda s, a: profile(s)[1])
    return points, [(f[0], f[2], f[1])[::-1] for f in faces], [f"sphere:0,0,0,{HEAD}"]


def hat(columns, rings):
    """A crown that lies on the head, and a brim that hangs out from it in waves."""
    edge = 1.15

    def parts(s):
        polar = min(edge, 2.1 * edge * s)
        return polar, max(0.0, s - 1.0 / 2.1) / (1.0 - 1.0 / 2.1)

    def radius(s, angle):
        polar, brim = parts(s)
        return HEAD * np.sin(polar) + 0.09 * brim * (1.0 + 0.2 * brim * np.cos(5 * angle))

    def height(s, angle):
        polar, brim = parts(s)
        return HEAD * np.cos(polar) - 0.09 * brim * (1.0 - 0.2 * brim * np.cos(5 * angle))

    points, faces = disc(columns, rings, radius, height)
    return points, faces, [f"sphere:0,0,0,{HEAD}"]


def barrel(columns, rows, length, radius, bulge, top_rows, bottom_rows):
    """A tube on an upright, slightly conical body that it leaves between its ends."""
    slope = 0.15

    def radius_at(s, angle):
        begin, end = (top_rows - 1) / (rows - 1), 1.0 - (bottom_rows - 1) / (rows - 1)
        body = radius + slope * length * s
        if s <= begin or s >= end:
            return body
        return body + bulge * np.sin(np.pi * (s - begin) / (end - begin)) ** 2

    points, faces = tube(columns, rows, radius_at, lambda s: -length * s)
    return points, faces, [f"cone:0,0,0,0,0,-1,{radius},{radius + slope}"]


def sleeve(columns, rows):
    points, faces = tube(columns, rows, lambda s, a: 0.045 + 0.05 * np.sin(np.pi * np.clip((s - 0.08) / 0.84, 0, 1)) ** 2,
                         lambda s: -0.25 * s)
    return points[:, [2, 0, 1]], faces, ["cylinder:0,0,0,1,0,0,0.045"]


def shirt(columns, rows):
    """Close to the body over a third of its height, with a millimetre of noise."""
    points, faces, bodies = barrel(columns, rows, 0.6, 0.16, 0.03, rows // 3, 2)
    noise = np.random.default_rng(20260107).uniform(-0.5e-3, 0.5e-3, len(points))
    out = points.copy()
    out[:, :2] *= (1.0 + noise / np.linalg.norm(points[:, :2], axis=1))[:, None]
    return out, faces, bodies


# name: shape, rho, k_L, k_theta, mu of table 1, factor on both stiffnesses
CASES = {
    "skirt": (lambda: skirt(20, 10, 5, 0.3, 2, 0.6), 0.1, 3.0, 5e-3, 0.6, 1),
    "page": (lambda: page(29), 10.0, 5.0, 2e-3, 0.4, 8),
    "beret": (lambda: beret(36, 23), 0.25, 5e-2, 5e-4, 0.3, 8),
    "hat": (lambda: hat(36, 24), 2.5, 5.0, 5e-4, 0.6, 8),
    "top": (lambda: barrel(36, 25, 0.4, 0.14, 0.04, 3, 2), 0.5, 0.2, 1e-1, 0.2, 8),
    "saroual": (lambda: barrel(50, 50, 0.7, 0.11, 0.12, 2, 2), 0.05, 1.0, 1e-2, 0.2, 2),
    "sleeve": (lambda: sleeve(20, 20), 1.0, 0.1, 1e-3, 0.7, 8),
    "gored": (lambda: skirt(45, 28, 9, 0.5, 4, 0.5), 0.05, 0.8, 5e-3, 0.7, 1),
    "shirt": (lambda: shirt(51, 50), 1.0, 3.0, 5e-4, 0.2, 8),
}


def write_obj(path, points, faces):
    with open(path, "w", encoding="utf-8") as out:
        for p in points:
            out.write("v %.17g %.17g %.17g\n" % tuple(p))
        for f in faces:
            out.write("f %d %d %d\n" % tuple(v + 1 for v in f))


def run(program, name, out, budget):
    shape, rho, stretch, bend, mu, factor = CASES[name]
    points, faces, bodies = shape()
    target = out / f"{name}.obj"
    write_obj(target, points, faces)
    command = [program, "invert", target, "--rho", rho, "--k-stretch", stretch * factor, "--k-bend", bend * factor,
               "--friction", mu, "--time-budget", budget, "-o", out / name, "--json"]
    for body in bodies:
        command += ["--obstacle", body]
    done = subprocess.run([str(c) for c in command], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode not in (0, 5):
        sys.exit(f"{name}: exit {done.returncode}: {done.stderr}")
    answer = json.loads(done.stdout)
    answer.update(name=name, factor=factor, vertices=len(points))
    return answer


def shown(value, form):
    return "-" if value is None else format(value, form)


def table(rows):
    lines = ["| Case | Factor | Vertices | Contacts | Status | F / weight | Smallest margin | lambda_min [1/s^2] | Re-draped, of size | "
             "Stretch | Bend [rad] | Seconds |", "|" + "---|" * 12]
    for r in rows:
        lines.append(f"| {r['name']} | {r['factor']} | {r['vertices']} | {r['contacts']} | {r['status']} | "
                     f"{r['force_residual_rel']:.1e} | {r['cone_margin_min']:.3f} | {shown(r['lambda_min_per_s2'], '.3g')} | "
                     f"{shown(r['redrape_max_rel'], '.1e')} | {r['stretch_max']:.3f} | {r['bend_max_rad']:.3f} | {r['seconds']:.1f} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", default=",".join(CASES))
    parser.add_argument("--time-budget", type=float, default=60.0)
    parser.add_argument("--table", type=Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in options.only.split(","):
        rows.append(run(options.program, name, options.out, options.time_budget))
        print(table(rows[-1:]).splitlines()[-1], flush=True)
    if options.table:
        options.table.write_text(table(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
