#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Targets after the rows of table 1 of [Inv18], inverted one by one into a table of results.

    bench/inversion_cases.py build/release/bin/tenter OUT [--only skirt,page] [--time-budget 60] [--range skirt,page]
                             [--reference SECONDS] [--materials FITTED.json ...] [--table FILE.md]

The shapes are generated: surfaces of revolution and their like in metres, resting on analytic bodies. Friction is that of the
paper, and so is the material, times the first of 1, 2, 4, 8 that is certified. --range looks for the softest multiple of some,
--reference runs the paper's algorithm on the same problem for so many seconds, --materials inverts three targets of
fitted cloth, with their material turned by 90 degrees too.
"""
import argparse
import json
import resource
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


# name: shape, rho, k_L, k_theta, mu of table 1
CASES = {
    "skirt": (lambda: skirt(20, 10, 5, 0.3, 2, 0.6), 0.1, 3.0, 5e-3, 0.6),
    "page": (lambda: page(29), 10.0, 5.0, 2e-3, 0.4),
    "beret": (lambda: beret(36, 23), 0.25, 5e-2, 5e-4, 0.3),
    "hat": (lambda: hat(36, 24), 2.5, 5.0, 5e-4, 0.6),
    "top": (lambda: barrel(36, 25, 0.4, 0.14, 0.04, 3, 2), 0.5, 0.2, 1e-1, 0.2),
    "saroual": (lambda: barrel(50, 50, 0.7, 0.11, 0.12, 2, 2), 0.05, 1.0, 1e-2, 0.2),
    "sleeve": (lambda: sleeve(20, 20), 1.0, 0.1, 1e-3, 0.7),
    "gored": (lambda: skirt(45, 28, 9, 0.5, 4, 0.5), 0.05, 0.8, 5e-3, 0.7),
    "shirt": (lambda: shirt(51, 50), 1.0, 3.0, 5e-4, 0.2),
}
MULTIPLES = [1, 2, 4, 8]


def over_sphere(n):
    """A round cloth over the upper half of a sphere that hangs 4 cm below its equator."""
    radius, quarter = 0.1, 0.05 * np.pi
    points, uv = [], []
    for b in np.linspace(-1, 1, n):
        for a in np.linspace(-1, 1, n):
            u, v = a * np.sqrt(1 - b * b / 2), b * np.sqrt(1 - a * a / 2)
            s, angle = np.hypot(u, v) * (quarter + 0.04), np.arctan2(v, u)
            over = min(s, quarter)
            r = radius * np.sin(over / radius)
            points.append((r * np.cos(angle), r * np.sin(angle), radius * np.cos(over / radius) - (s - over)))
            uv.append((s * np.cos(angle), s * np.sin(angle)))
    return np.array(points), grid_triangles(n, n, False), [f"sphere:0,0,0,{radius}"], np.array(uv)


def over_cylinder(n):
    """A sheet over the upper half of a cylinder that hangs 5 cm beyond it on both sides."""
    radius, quarter = 0.1, 0.05 * np.pi
    points, uv = [], []
    for y in np.linspace(0.0, 0.15, n):
        for s in np.linspace(-1.0, 1.0, n) * (quarter + 0.05):
            over = min(abs(s), quarter)
            points.append((np.copysign(radius * np.sin(over / radius), s), y,
                           radius * np.cos(over / radius) - (abs(s) - over)))
            uv.append((s, y))
    return np.array(points), grid_triangles(n, n, False), [f"cylinder:0,0,0,0,1,0,{radius}"], np.array(uv)


def on_cone(columns, rows, body):
    """A skirt on a cone of finite height, a mesh, that hangs straight down from its lower end; no material coordinates."""
    top, slope = 0.12, 0.5
    points, faces = tube(columns, rows, lambda s, a: top + slope * min(0.2 * s, 0.1), lambda s: -0.2 * s)
    profile = [(top - 0.5 * slope * 0.1, 0.05)] + [(top + slope * d, -d) for d in np.linspace(0.0, 0.1, 6)] + [(0.16, -0.12)]
    around = 4 * columns
    rings = [(r * np.cos(a), r * np.sin(a), z) for r, z in profile for a in 2.0 * np.pi * np.arange(around) / around]
    sides = grid_triangles(around, len(profile), True)
    last, north, south = (len(profile) - 1) * around, len(rings), len(rings) + 1
    sides += [(north, i, (i + 1) % around) for i in range(around)]
    sides += [(south, last + (i + 1) % around, last + i) for i in range(around)]
    write_obj(body, np.array(rings + [(0, 0, profile[0][1]), (0, 0, profile[-1][1])]), sides)
    return points, faces, [body], None


FABRIC_TARGETS = {"sphere": lambda out: over_sphere(15), "cylinder": lambda out: over_cylinder(15),
                  "cone": lambda out: on_cone(24, 11, out / "cone-body.obj")}
FABRIC_FRICTION = 0.3


def write_obj(path, points, faces, uv=None):
    with open(path, "w", encoding="utf-8") as out:
        for p in points:
            out.write("v %.17g %.17g %.17g\n" % tuple(p))
        for p in [] if uv is None else uv:
            out.write("vt %.17g %.17g\n" % tuple(p))
        for f in faces:
            out.write("f " + " ".join(str(v + 1) if uv is None else f"{v + 1}/{v + 1}" for v in f) + "\n")


def read_points(path):
    with open(path, encoding="utf-8") as lines:
        return np.array([line.split()[1:] for line in lines if line.startswith("v ")], dtype=float)


def invert(program, target, out, bodies, friction, budget, more):
    """The command's answer, with the seconds of processor time that it took."""
    command = [program, "invert", target, "--friction", friction, "--time-budget", budget, "-o", out, "--json"] + more
    for body in bodies:
        command += ["--obstacle", body]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(c) for c in command], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 5):
        sys.exit(f"{target}: exit {done.returncode}: {done.stderr}")
    answer = json.loads(done.stdout)
    answer["cpu"] = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return answer


def constants(rho, stretch, bend, factor):
    return ["--rho", rho, "--k-stretch", stretch * factor, "--k-bend", bend * factor]


def run(program, name, options):
    shape, rho, stretch, bend, mu = CASES[name]
    points, faces, bodies = shape()
    target = options.out / f"{name}.obj"
    write_obj(target, points, faces)
    for factor in MULTIPLES:
        answer = invert(program, target, options.out / name, bodies, mu, options.time_budget,
                        constants(rho, stretch, bend, factor))
        answer.update(name=name, factor=factor, vertices=len(points))
        if answer["status"] == "certified":
            break
    if name in options.range.split(","):
        found = invert(program, target, options.out / f"{name}-range", bodies, mu, 4 * options.time_budget,
                       constants(rho, stretch, bend, 1) + ["--range"])
        answer["range"] = found["range"]
    if options.reference:
        answer["reference"] = invert(program, target, options.out / f"{name}-reference", bodies, mu, options.reference,
                                     constants(rho, stretch, bend, answer["factor"]) + ["--method", "reference"])
    return answer


def turned(uv):
    return np.column_stack([-uv[:, 1], uv[:, 0]])


def run_fabric(program, name, material, options):
    """One target of fitted cloth; how far its rest shape moves when weft and warp change places, of its size."""
    points, faces, bodies, uv = FABRIC_TARGETS[name](options.out)
    rests, answers = [], []
    for turn in (False, True):
        target, out = options.out / f"{name}{'-turned' * turn}.obj", options.out / f"{name}-{material.stem}{'-turned' * turn}"
        write_obj(target, points, faces, turned(uv) if turn and uv is not None else uv)
        # No one direction runs around a tube, so the skirt is not turned.
        more = ["--material", material] + ([] if uv is not None else ["--warp", "0,0,1"])
        answers.append(invert(program, target, out, bodies, FABRIC_FRICTION, options.time_budget, more))
        rests.append(read_points(out / "rest.obj"))
        if uv is None:
            break
    answer = answers[0]
    size = np.linalg.norm(points.max(axis=0) - points.min(axis=0))
    change = None
    if len(rests) == 2 and all(a["status"] == "certified" for a in answers):
        change = np.linalg.norm(rests[1] - rests[0], axis=1).max() / size
    answer.update(name=f"{material.stem}, {name}", vertices=len(points), factor=1, turned=change)
    return answer


def shown(value, form):
    return "-" if value is None else format(value, form)


def markdown(titles, rows):
    lines = ["| " + " | ".join(titles) + " |", "|" + "---|" * len(titles)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


COMMON = ["Vertices", "Contacts", "Status", "F / weight", "Smallest margin", "lambda_min [1/s^2]", "Re-draped, of size", "Stretch",
          "Bend [rad]", "Seconds", "CPU [s]"]


def common(r):
    return [r["vertices"], r["contacts"], r["status"], f"{r['force_residual_rel']:.1e}", f"{r['cone_margin_min']:.3f}",
            shown(r["lambda_min_per_s2"], ".3g"), shown(r["redrape_max_rel"], ".1e"), f"{r['stretch_max']:.4f}",
            f"{r['bend_max_rad']:.3f}", f"{r['seconds']:.1f}", f"{r['cpu']:.1f}"]


def case_table(rows):
    return markdown(["Case", "Multiple"] + COMMON, [[r["name"], r["factor"]] + common(r) for r in rows])


def range_table(rows):
    return markdown(["Case", "Softest certified multiple", "Not certified", "Least friction, of mu", "Not certified", "Proved to slide below"],
                    [[r["name"], shown(q["stiffness_factor_min"], ".3g"), shown(q["stiffness_factor_below"], ".3g"),
                      shown(q["friction_factor_min"], ".3g"), shown(q["friction_factor_below"], ".3g"),
                      shown(q["friction_factor_proved_below"], ".3g")] for r in rows for q in [r["range"]]])


def reference_table(rows):
    return markdown(["Case", "Multiple", "Status", "F / weight", "Contacts outside", "lambda_min [1/s^2]", "Seconds", "Ours: seconds",
                     "Ours: F / weight", "Ours: lambda_min"],
                    [[r["name"], r["factor"], q["status"], f"{q['force_residual_rel']:.1e}", q["cone_violations"],
                      shown(q["lambda_min_per_s2"], ".3g"), f"{q['seconds']:.1f}", f"{r['seconds']:.2f}",
                      f"{r['force_residual_rel']:.1e}", shown(r["lambda_min_per_s2"], ".3g")] for r in rows for q in [r["reference"]]])


def fabric_table(rows):
    return markdown(["Fabric, on a"] + COMMON + ["Weft and warp exchanged, of size"],
                    [[r["name"]] + common(r) + [shown(r["turned"], ".1e")] for r in rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", default=",".join(CASES))
    parser.add_argument("--time-budget", type=float, default=60.0)
    parser.add_argument("--range", default="")
    parser.add_argument("--reference", type=float, default=0.0)
    parser.add_argument("--materials", type=Path, nargs="*", default=[])
    parser.add_argument("--table", type=Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows, fabrics = [], []
    for name in filter(None, options.only.split(",")):
        rows.append(run(options.program, name, options))
        print(case_table(rows[-1:]).splitlines()[-1], flush=True)
    for material in options.materials:
        for name in FABRIC_TARGETS:
            fabrics.append(run_fabric(options.program, name, material, options))
            print(fabric_table(fabrics[-1:]).splitlines()[-1], flush=True)
    parts = [(rows, "## The cases of [Inv18]", case_table),
             ([r for r in rows if "range" in r], "## Feasible range", range_table),
             (rows if options.reference else [], "## The algorithm of [Inv18] on the same problems", reference_table),
             (fabrics, "## Fitted cloth", fabric_table)]
    if options.table:
        options.table.write_text("\n".join(f"{title}\n{form(r)}" for r, title, form in parts if r), encoding="utf-8")


if __name__ == "__main__":
    main()
