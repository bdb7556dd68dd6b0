#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Targets after the rows of table 1 of [Inv18], inverted one by one into a table of results.

    bench/inversion_cases.py build/release/bin/tenter OUT [--only skirt,page] [--time-budget 60] [--resimulate]
                             [--range skirt,page] [--sweep skirt,page] [--sweep-seconds 200] [--reference skirt,page] [--reference-seconds 60]
                             [--materials FITTED.json ...] [--growth] [--metric] [--table FILE.md]

The shapes are generated: surfaces of revolution and their like in metres, resting on analytic bodies. Friction is that of the
paper, and so is the material, times the first of 1, 2, 4, 8 that is certified. --resimulate lets what is certified move for
5 s, --range looks for the softest multiple of some, --sweep inverts at 2 to 1/64 of the paper's stiffness, for a rest mesh and for
a metric rest state, each with at most --sweep-seconds, --reference runs the
paper's algorithm on the same problem, --materials inverts three targets of fitted cloth, with their material turned by 90
degrees too, --growth inverts one garment on ever finer meshes, --metric finds the metric rest state of one of 10,000 vertices with
600 contacts. Answers that OUT holds already are used again. --table replaces what stands after the marker of a
page.
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


def smooth(t):
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def curve(start, heading, length, count):
    """Points in (radius, height) every length / (count - 1), along headings [rad] below the horizontal of t in 0..1."""
    fine = 200
    t = (np.arange(fine * (count - 1)) + 0.5) / (fine * (count - 1))
    angle = np.array([heading(v) for v in t])
    steps = length / len(t) * np.column_stack([np.cos(angle), -np.sin(angle)])
    return np.vstack([start, start + np.cumsum(steps, axis=0)[fine - 1::fine]])


def stitch(inner, outer):
    """Triangles between two closed rings of any number of vertices, given as the numbers of their vertices."""
    faces, i, j = [], 0, 0
    while i < len(inner) or j < len(outer):
        a, b = inner[i % len(inner)], outer[j % len(outer)]
        if (i + 1) * len(outer) <= (j + 1) * len(inner) - 0.5 * (len(inner) - len(outer)) or j == len(outer):
            faces.append((a, b, inner[(i + 1) % len(inner)]))
            i += 1
        else:
            faces.append((a, b, outer[(j + 1) % len(outer)]))
            j += 1
    return faces


def dome(profile, counts, waves=lambda s: 0.0, lobes=0):
    """A pole, then rings of so many vertices along a profile, their radius times 1 + waves(s) cos(lobes angle)."""
    points, faces, before = [(0.0, 0.0, profile[0][1])], [], [0]
    for j, ((r, z), count) in enumerate(zip(profile[1:], counts), 1):
        ring = list(range(len(points), len(points) + count))
        for a in 2.0 * np.pi * np.arange(count) / count:
            w = r * (1.0 + waves(j / (len(profile) - 1)) * np.cos(lobes * a))
            points.append((w * np.cos(a), w * np.sin(a), z))
        faces += [(0, v, ring[(i + 1) % count]) for i, v in enumerate(ring)] if j == 1 else stitch(before, ring)
        before = ring
    return np.array(points), faces


def skirt(columns, rows, lobes, depth, contact_rows):
    """On a cone with its upper rows; below it flares, and hangs in lobes that deepen towards the hem."""
    slope, top, length = 0.35, 0.12, 0.42
    cone = np.arctan2(1.0, slope)
    on_body = (contact_rows - 1) / (rows - 1)

    def free(s):
        return np.clip((s - on_body) / (1.0 - on_body), 0.0, 1.0)

    profile = curve((top, 0.0), lambda s: cone if s <= on_body else cone - 0.5 + 0.4 * free(s), length, rows)
    angle = 2.0 * np.pi * np.arange(columns) / columns
    points = [(w * np.cos(a), w * np.sin(a), z) for j, (r, z) in enumerate(profile) for a in angle
              for w in [r * (1.0 + depth * free(j / (rows - 1)) ** 2 * np.cos(lobes * a))]]
    return np.array(points), grid_triangles(columns, rows, True), [f"cone:0,0,0,0,0,-1,{top},{top + slope}"]


def page(across, along, margin):
    """A half cylinder on two margins that lie on the page below, joined by a narrow bend."""
    radius, bend, length = 0.05, 0.012, 0.2
    arc = np.pi * radius + 2 * 0.5 * np.pi * bend
    step = arc / (across - 1 - 2 * (margin - 1))
    total = step * (across - 1)

    def heading(t):
        s = min(t, 1.0 - t) * total - step * (margin - 1)
        up = np.pi / 2 * np.clip(s / (0.5 * np.pi * bend), 0.0, 1.0)
        turned = max(0.0, s - 0.5 * np.pi * bend) / radius
        return (turned - up) * (1.0 if t < 0.5 else -1.0)

    profile = curve((0.0, 0.0), heading, total, across)
    points = [(x - 0.5 * profile[-1][0], length * j / (along - 1), z) for j in range(along) for x, z in profile]
    return np.array(points), grid_triangles(across, along, False), ["plane:0,0,0,0,0,1"]


HEAD = 0.1


def on_head(begin, end, count):
    polar = np.linspace(begin, end, count)
    return HEAD * np.column_stack([np.sin(polar), np.cos(polar)])


def spread(profile, edge):
    """How many vertices of that distance fit each ring."""
    return [max(6, round(2.0 * np.pi * r / edge)) for r, _ in profile]


def beret(rows):
    """A dome over the head, out to a soft edge, and back in to a band of two rings around the head."""
    band = on_head(np.radians(68.0), np.radians(75.0), 2)
    edge, rise, drop = 0.14, 0.045, 0.035
    arc = np.linspace(0.0, 1.0, 2000)
    upper = np.column_stack([edge * np.sin(np.pi / 2 * arc), rise * np.cos(np.pi / 2 * arc)])
    lower = np.column_stack([band[0][0] + (edge - band[0][0]) * (1.0 - arc ** 3), -drop * arc])
    outline = np.vstack([upper, lower[1:]]) + (0.0, band[0][1] + drop)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], rows)
    profile = np.column_stack([np.interp(at, along, outline[:, k]) for k in range(2)])
    points, faces = dome(np.vstack([profile, band[1:]]), spread(profile[1:-1], 0.0122) + [35, 34])
    return points, faces, [f"sphere:0,0,0,{HEAD}"]


def hat(crown, brim):
    """A crown that lies on the head, and a brim that flares out of it and hangs down in waves."""
    edge, width = 1.15, 0.12
    on_body = on_head(0.0, edge, crown + 1)
    # As steep as the head at its edge, then flatter, then hanging.
    free = curve(on_body[-1], lambda t: edge - 0.5 * smooth(t / 0.3) + 0.7 * smooth((t - 0.3) / 0.7), width, brim + 1)[1:]
    start = crown / (crown + brim)
    points, faces = dome(np.vstack([on_body, free]), [6 * (j + 1) for j in range(crown)] + spread(free, 0.0122),
                         lambda s: 0.12 * smooth((s - start) / (1.0 - start)), 5)
    return points, faces, [f"sphere:0,0,0,{HEAD}"]


def barrel(columns, rows, length, radius, bulge, top_rows, bottom_rows, end=0.0):
    """A tube on an upright, slightly conical body that it leaves between its ends, and below by `end` if that is not 0."""
    slope = 0.15

    def radius_at(s, angle):
        begin, last = (top_rows - 1) / (rows - 1), 1.0 - max(0, bottom_rows - 1) / (rows - 1)
        body = radius + slope * length * s
        if s <= begin or (s >= last and bottom_rows > 0):
            return body
        t = (s - begin) / (last - begin)
        return body + bulge * np.sin(np.pi * t) ** 2 + end * smooth(t)

    points, faces = tube(columns, rows, radius_at, lambda s: -length * s)
    return points, faces, [f"cone:0,0,0,0,0,-1,{radius},{radius + slope}"]


def sleeve(columns, rows):
    """Puffed between two cuffs, of two rings and of one, on an arm that is held out."""
    begin = 1.0 / (rows - 1)
    points, faces = tube(columns, rows, lambda s, a: 0.045 + 0.04 * np.sin(np.pi * np.clip((s - begin) / (1.0 - begin), 0, 1)) ** 2,
                         lambda s: -0.2 * s)
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
    "skirt": (lambda: skirt(20, 10, 5, 0.12, 1), 0.1, 3.0, 5e-3, 0.6),
    "page": (lambda: page(43, 19, 4), 10.0, 5.0, 2e-3, 0.4),
    "sleeve": (lambda: sleeve(22, 18), 1.0, 0.1, 1e-3, 0.7),
    "beret": (lambda: beret(19), 0.25, 5e-2, 5e-4, 0.3),
    "hat": (lambda: hat(7, 10), 2.5, 5.0, 5e-4, 0.6),
    "top": (lambda: barrel(29, 31, 0.4, 0.14, 0.04, 3, 1), 0.5, 0.2, 1e-1, 0.2),
    "saroual": (lambda: barrel(61, 41, 0.7, 0.11, 0.1, 1, 0, 0.02), 0.05, 1.0, 1e-2, 0.2),
    "gored": (lambda: skirt(42, 30, 7, 0.15, 4), 0.05, 0.8, 5e-3, 0.7),
    "shirt": (lambda: shirt(51, 50), 1.0, 3.0, 5e-4, 0.2),
}
MULTIPLES = [1, 2, 4, 8]
MARKER = "<!-- tables by bench/inversion_cases.py -->"
CONTACT_DISTANCE_MM = {"shirt": 0.6}  # The others lie on their bodies exactly.


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


def constants(name, factor):
    _, rho, stretch, bend, _ = CASES[name]
    return ["--rho", rho, "--k-stretch", stretch * factor, "--k-bend", bend * factor, "--contact-distance-mm",
            CONTACT_DISTANCE_MM.get(name, 0.01)]


def kept(path, make):
    """What was made before, or is made now."""
    if not path.exists():
        path.write_text(json.dumps(make()), encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))


def softest(program, name, points, target, bodies, options):
    """The first multiple that is certified, or the last."""
    for factor in MULTIPLES:
        answer = invert(program, target, options.out / name, bodies, CASES[name][4], options.time_budget, constants(name, factor))
        answer.update(name=name, factor=factor, vertices=len(points))
        if answer["status"] == "certified":
            break
    return answer


def resimulate(program, name, gravity, options):
    output = options.out / f"{name}-{gravity}.pvd"
    command = [program, "resimulate", options.out / name, "--seconds", 5, "--gravity-scale", gravity, "--time-budget",
               10 * options.time_budget, "-o", output, "--json"]
    done = subprocess.run([str(c) for c in command], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode not in (0, 5):
        sys.exit(f"{name}: exit {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def run(program, name, options):
    shape, _, _, _, mu = CASES[name]
    points, faces, bodies = shape()
    target = options.out / f"{name}.obj"
    write_obj(target, points, faces)
    answer = kept(options.out / f"{name}.answer.json", lambda: softest(program, name, points, target, bodies, options))
    if answer["status"] == "certified" and options.resimulate:
        answer["still"], answer["heavier"] = [
            kept(options.out / f"{name}-{g}.answer.json", lambda: resimulate(program, name, g, options)) for g in (1, 1.01)]
    if name in options.sweep.split(","):
        answer["sweep"] = {rest: [kept(options.out / f"{name}-sweep-{rest}-{k}.answer.json", lambda: invert(
            program, target, options.out / f"{name}-sweep", bodies, mu, options.sweep_seconds, constants(name, 2.0 ** -k) + ["--rest", rest]))
                                  for k in range(-1, 7)] for rest in ("mesh", "metric")}
    if name in options.range.split(","):
        answer["range"] = kept(options.out / f"{name}-range.answer.json", lambda: invert(
            program, target, options.out / f"{name}-range", bodies, mu, 4 * options.time_budget, constants(name, 1) + ["--range"]))["range"]
    if name in options.reference.split(","):
        answer["reference"] = kept(options.out / f"{name}-reference.answer.json", lambda: invert(
            program, target, options.out / f"{name}-reference", bodies, mu, options.reference_seconds,
            constants(name, answer["factor"]) + ["--method", "reference"]))
    return answer


GROWTH = [(17, 12), (35, 25), (61, 41), (110, 90), (235, 170)]


METRIC = (120, 83, 5)


def grow(program, columns, rows, options, contact_rows=1, rest="mesh"):
    """The saroual of the cases on that mesh, each edge as stiff as there: what it costs, not what it is."""
    points, faces, bodies = barrel(columns, rows, 0.7, 0.11, 0.1, contact_rows, 0, 0.02)
    out = options.out / f"growth-{len(points)}-{contact_rows}"
    target = out.with_suffix(".obj")
    write_obj(target, points, faces)
    answer = invert(program, target, out, bodies, CASES["saroual"][4], 10 * options.time_budget, constants("saroual", 1) + ["--rest", rest])
    answer.update(name="saroual", factor=1, vertices=len(points), memory=resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)
    return answer


def turned(uv):
    return np.column_stack([-uv[:, 1], uv[:, 0]])


def laid_on(points, others):
    """Points after the rigid motion that brings them nearest to others, since only contacts hold a rest shape's place."""
    a, b = points - points.mean(axis=0), others - others.mean(axis=0)
    u, _, v = np.linalg.svd(a.T @ b)
    u[:, -1] *= np.sign(np.linalg.det(u @ v))
    return a @ u @ v + others.mean(axis=0)


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
        change = np.linalg.norm(laid_on(rests[1], rests[0]) - rests[0], axis=1).max() / size
    answer.update(name=f"{material.stem}, {name}", vertices=len(points), factor=1, turned=change)
    return answer


def shown(value, form):
    return "-" if value is None else format(value, form)


def markdown(titles, rows):
    lines = ["| " + " | ".join(titles) + " |", "|" + "---|" * len(titles)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


COMMON = ["Vertices", "Contacts", "Status", "F / weight", "Smallest margin", "lambda_min [1/s^2]", "Re-draped, of size", "Stretch",
          "Bend [rad]", "Solved [s]", "Certified [s]"]


def common(r):
    return [r["vertices"], r["contacts"], r["status"], f"{r['force_residual_rel']:.1e}", f"{r['cone_margin_min']:.3f}",
            shown(r["lambda_min_per_s2"], ".3g"), shown(r["redrape_max_rel"], ".1e"), f"{r['stretch_max']:.4f}",
            f"{r['bend_max_rad']:.3f}", f"{r['solve_cpu_seconds']:.2f}", f"{r['cpu']:.2f}"]


def case_table(rows):
    return markdown(["Case", "Multiple"] + COMMON, [[r["name"], r["factor"]] + common(r) for r in rows])


def resimulation_table(rows):
    return markdown(["Case", "Multiple", "Moves in 5 s, of size", "Stuck / sliding / off", "1 % more gravity: moves, of size", "Of the linear prediction",
                     "Stuck / sliding / off"],
                    [[r["name"], r["factor"], f"{q['max_displacement_rel']:.1e}", f"{q['stuck']} / {q['sliding']} / {q['off']}",
                      f"{h['max_displacement_rel']:.1e}", shown((h["linear_response"] or {}).get("ratio"), ".2f"),
                      f"{h['stuck']} / {h['sliding']} / {h['off']}"] for r in rows for q, h in [(r["still"], r["heavier"])]])


def growth_rows(rows):
    return markdown(["Vertices", "Contacts", "Status", "F / weight", "Solved [s]", "Certified [s]", "Peak memory [MB]"],
                    [[r["vertices"], r["contacts"], r["status"], f"{r['force_residual_rel']:.1e}", f"{r['solve_cpu_seconds']:.2f}",
                      f"{r['cpu']:.2f}", f"{r['memory']:.0f}"] for r in rows])


def growth_table(rows):
    last, before = [[np.log(r[k]) for k in ("vertices", "solve_cpu_seconds")] for r in (rows[-1], rows[1])]
    return growth_rows(rows) + (
        f"\nFrom the second row to the last *Solved* grows as vertices to the power {(last[1] - before[1]) / (last[0] - before[0]):.2f}.\n")


def metric_table(rows):
    return markdown(["Vertices", "Contacts", "Status", "F / weight", "Smallest margin", "lambda_min [1/s^2]", "Re-draped, of size", "Solved [s]",
                     "With its certificate, wall clock [s]"],
                    [[r["vertices"], r["contacts"], r["status"], f"{r['force_residual_rel']:.1e}", f"{r['cone_margin_min']:.3f}",
                      shown(r["lambda_min_per_s2"], ".3g"), shown(r["redrape_max_rel"], ".1e"), f"{r['solve_cpu_seconds']:.2f}",
                      f"{r['seconds']:.2f}"] for r in rows])


def swept(answer):
    """Status, seconds, and of a proof the bound on lambda_min or that forces alone do it."""
    proof = answer["proof"]
    how = "" if not proof else ", forces" if proof["lambda_bound_per_s2"] is None else f", lambda <= {proof['lambda_bound_per_s2']:.2g}"
    return f"{answer['status']}{how} ({answer['seconds']:.1f} s)"


def sweep_table(rows):
    return markdown(["Case", "Rest"] + ["2", "1", "1/2", "1/4", "1/8", "1/16", "1/32", "1/64"],
                    [[r["name"], rest] + [swept(q) for q in r["sweep"][rest]] for r in rows for rest in ("mesh", "metric")])


def range_table(rows):
    return markdown(["Case", "Softest certified multiple", "Not certified", "Least friction, of mu", "Not certified", "Proved to slide below"],
                    [[r["name"], shown(q["stiffness_factor_min"], ".3g"), shown(q["stiffness_factor_below"], ".3g"),
                      shown(q["friction_factor_min"], ".3g"), shown(q["friction_factor_below"], ".3g"),
                      shown(q["friction_factor_proved_below"], ".3g")] for r in rows for q in [r["range"]]])


def reference_table(rows):
    return markdown(["Case", "Multiple", "Status", "F / weight", "Contacts outside", "lambda_min [1/s^2]", "Solved [s]", "Ours: solved [s]",
                     "Ours: F / weight", "Ours: lambda_min"],
                    [[r["name"], r["factor"], q["status"], f"{q['force_residual_rel']:.1e}", q["cone_violations"],
                      shown(q["lambda_min_per_s2"], ".3g"), f"{q['solve_cpu_seconds']:.1f}", f"{r['solve_cpu_seconds']:.2f}",
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
    parser.add_argument("--resimulate", action="store_true")
    parser.add_argument("--range", default="")
    parser.add_argument("--sweep", default="")
    parser.add_argument("--sweep-seconds", type=float, default=200.0)
    parser.add_argument("--growth", action="store_true")
    parser.add_argument("--metric", action="store_true")
    parser.add_argument("--reference", default="")
    parser.add_argument("--reference-seconds", type=float, default=60.0)
    parser.add_argument("--materials", type=Path, nargs="*", default=[])
    parser.add_argument("--table", type=Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows, fabrics, sizes = [], [], []
    for columns, count in GROWTH if options.growth else []:  # first, while no child has used more memory
        sizes.append(kept(options.out / f"growth-{columns * count}.answer.json", lambda: grow(options.program, columns, count, options)))
        print(growth_rows(sizes[-1:]).splitlines()[-1], flush=True)
    metric = [kept(options.out / "metric.answer.json", lambda: grow(options.program, *METRIC[:2], options, METRIC[2], "metric"))] if options.metric else []
    for name in filter(None, options.only.split(",")):
        rows.append(run(options.program, name, options))
        print(case_table(rows[-1:]).splitlines()[-1], flush=True)
    for material in options.materials:
        for name in FABRIC_TARGETS:
            fabrics.append(kept(options.out / f"{name}-{material.stem}.answer.json",
                                lambda: run_fabric(options.program, name, material, options)))
            print(fabric_table(fabrics[-1:]).splitlines()[-1], flush=True)
    parts = [(rows, "## The cases of [Inv18]", case_table),
             ([r for r in rows if "still" in r], "## Resimulated", resimulation_table),
             ([r for r in rows if "range" in r], "## Feasible range", range_table),
             (sizes, "## Growth", growth_table),
             (metric, "## A metric rest state", metric_table),
             ([r for r in rows if "sweep" in r], "## Softer and softer", sweep_table),
             ([r for r in rows if "reference" in r], "## The algorithm of [Inv18] on the same problems", reference_table),
             (fabrics, "## Fitted cloth", fabric_table)]
    if options.table:
        before = options.table.read_text(encoding="utf-8").split(MARKER)[0]
        tables = "\n".join(f"{title}\n{form(r)}" for r, title, form in parts if r)
        options.table.write_text(before + MARKER + "\n\n" + tables, encoding="utf-8")


if __name__ == "__main__":
    main()
