#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""From rendered images to a measurement, against the truth: boards, calibration, images, reconstruction. One row of
docs/results-images.md for each protocol; with all five fit protocols also the material, from images and without errors.

    bench/end_to_end.py [--fabric knit-12] [--seed 5521] [--frames 6] [--width 1936] [--boards 20] [--folder DIR]
                        [--table FILE] [PROTOCOL...]

A folder that is kept is gone on with. Needs numpy.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "docs/formats/python"))
from read_material import read_material, stiffness  # noqa: E402
from read_measurement import read_measurement  # noqa: E402

PROTOCOLS = ["stretch-weft", "stretch-warp", "shear", "bend-weft", "bend-warp", "complex-shear", "corner-pull"]
LIMIT_M = 0.03e-3
FITTED = ["stretch-weft", "stretch-warp", "shear", "bend-weft", "bend-warp"]
BAND = 1.96  # standard deviations that hold 95 %
MARKER = "<!-- table by bench/end_to_end.py -->"
HEAD = """| protocol | frames | vertices valid | error | one sigma holds x, y, z | worst valid vertex | clamped: RMS, worst | clips: place; turn | cords | s a frame |
|---|---|---|---|---|---|---|---|---|---|
"""
MATERIAL_HEAD = """Material, StVK orthotropic, at most two knots a curve, fitted to the five tests: every knot that the images give (N/m, N m), its 95 % band, and
the curve that the same frames without errors give there.

| component | strain | from images | from the truth | within the images' band |
|---|---|---|---|---|
"""


def tenter(*arguments, folder):
    program = os.environ.get("TENTER", str(ROOT / "build/release/bin/tenter"))
    done = subprocess.run([program, *arguments, "--json"], stdout=subprocess.PIPE, text=True, cwd=folder)
    if done.returncode != 0:
        raise RuntimeError(f"tenter {' '.join(arguments)} ended with {done.returncode}\n{done.stdout}")
    return json.loads(done.stdout)


def made(path, *arguments, folder):
    """The answer of the command that makes a path; kept beside it."""
    answer = folder / (path + ".answer.json")
    if not answer.exists():
        answer.write_text(json.dumps(tenter(*arguments, folder=folder)))
    return json.loads(answer.read_text())


def rms(values):
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")


def turned(a, b):
    """Angle between two rotations [rad]."""
    return float(np.arccos(np.clip((np.trace(np.array(a).T @ np.array(b)) - 1.0) / 2.0, -1.0, 1.0)))


def compare(measured, true):
    """Errors of all frames: of what is valid, and of what is clamped, beside the truth."""
    out = {"errors": [], "sigmas": [], "valid": 0, "all": 0, "clamped": [], "place": [], "turn": [], "cords": []}
    assert len(measured["frames"]) == len(true["frames"])
    order = np.lexsort(np.round(measured["rest"]["uv"], 7).T)
    order_true = np.lexsort(np.round(true["rest"]["uv"], 7).T)
    assert np.allclose(measured["rest"]["uv"][order], true["rest"]["uv"][order_true], atol=1e-6), "other meshes"
    for m, t in zip(measured["frames"], true["frames"]):
        if "mesh" not in m:
            out["all"] += len(order)
            continue
        error = np.full_like(m["points"], np.nan)
        error[order] = m["points"][order] - t["points"][order_true]
        valid = np.array(m["valid"])
        held = np.array(sorted({v for c in m["clips"] for v in c["clamped_vertices"]}), dtype=int)
        if len(held):
            out["clamped"].append(np.linalg.norm(error[held], axis=1))
        out["valid"] += int(valid.sum())
        out["all"] += len(valid)
        free = valid.copy()
        free[held] = False
        out["errors"].append(error[free])
        out["sigmas"].append(m["sigma_axes_m"][free])
        poses = {c["clip"]: c for c in t["clips"]}
        for clip in m["clips"]:
            pose = poses[clip["clip"]]
            difference = np.subtract(clip["translation_m"], pose["translation_m"])
            out["place"].append(float(np.linalg.norm(difference)))
            out["turn"].append(turned(clip["rotation"], pose["rotation"]))
        directions = {c["cord"]: c["direction"] for c in t["cords"]}
        for cord in m["cords"]:
            cosine = np.dot(cord["direction"], directions[cord["cord"]])
            out["cords"].append(float(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return out


def row(protocol, options, folder):
    seed = str(options.seed)
    cameras = ("--cameras", "4", "--image-width", str(options.width), "--protocol", protocol, "--seed", seed)
    boards, session, measurement = f"{protocol}-boards", f"{protocol}-session", f"{protocol}-measurement"
    made(boards, "twin", "capture", "--boards", str(options.boards), *cameras, "-o", boards, folder=folder)
    names = [x for i in range(4) for x in ("--camera", f"cam-{i + 1}")]
    calibration = f"{protocol}-calibration.json"
    made(calibration, "calibrate", "cameras", "--board", "charuco", "--corners", "11x8", "--square-mm", "12",
         "--marker-mm", "9", "--dictionary", "4x4_100", *names, "--images", boards + "/{camera}-{index:06}.png",
         "--rig-board", "0", "-o", calibration, folder=folder)
    made(session, "twin", "capture", "--fabric", options.fabric, *cameras, "--frames", str(options.frames), "--session",
         "--calibration", calibration, "-o", session, "--truth", f"{protocol}-truth", folder=folder)
    answer = made(measurement, "reconstruct", session, "-o", measurement, "--report", f"{protocol}.html", folder=folder)
    got = compare(read_measurement(folder / measurement), read_measurement(folder / f"{protocol}-truth/exact"))
    errors, sigmas = np.concatenate(got["errors"]), np.concatenate(got["sigmas"])
    inside = np.mean(np.abs(errors) <= sigmas, axis=0)
    error = rms(np.linalg.norm(errors, axis=1))
    clamped = np.concatenate(got["clamped"]) if got["clamped"] else np.array([np.nan])
    cells = [protocol, str(answer["frames"]), f"{100.0 * got['valid'] / got['all']:.1f} %", f"{1e3 * error:.4f} mm",
             ", ".join(f"{100.0 * share:.0f} %" for share in inside),
             f"{1e3 * np.max(np.linalg.norm(errors, axis=1)):.3f} mm", f"{1e3 * rms(clamped):.4f}, {1e3 * np.max(clamped):.4f} mm",
             f"{1e3 * rms(got['place']):.4f} mm; {np.degrees(rms(got['turn'])):.3f} deg",
             f"{np.degrees(rms(got['cords'])):.3f} deg" if got["cords"] else "-", f"{answer['seconds_per_frame']:.1f}"]
    return "| " + " | ".join(cells) + " |", error <= LIMIT_M


def band(component, strain):
    """Half a 95 % band, linear between knots; None where a knot beside it is not observed."""
    knots = component["knots"]
    strains = [k["strain"] for k in knots]
    right = min(int(np.searchsorted(strains, strain)), len(knots) - 1)
    left = max(right - 1, 0) if strains[right] > strain else right
    if knots[left]["std"] is None or knots[right]["std"] is None:
        return None
    return BAND * float(np.interp(strain, strains, [k["std"] or 0.0 for k in knots]))


def compare_materials(folder):
    """Rows: every observed knot of the material from images beside the curve that was fitted to the truth."""
    fits = {}
    for name, place in (("images", "{}-measurement"), ("truth", "{}-truth/exact")):
        made(f"{name}-material.json", "fit", *[place.format(p) for p in FITTED], "--model", "stvk", "--variant", "orthotropic",
             "--max-knots", "2", "-o", f"{name}-material.json", folder=folder)
        fits[name] = {c["name"]: c for c in read_material(folder / f"{name}-material.json")["components"]}
    rows = []
    for name, seen in fits["images"].items():
        for knot in seen["knots"]:
            true, own = stiffness(fits["truth"][name], knot["strain"]), band(seen, knot["strain"])
            other = band(fits["truth"][name], knot["strain"])
            verdict = "not observed" if own is None else "yes" if abs(knot["stiffness"] - true) <= own else "no"
            shown = [f"{value:.3g}" + (f" +- {half:.2g}" if half is not None else "")
                     for value, half in ((knot["stiffness"], own), (true, other))]
            rows.append(f"| {name} | {knot['strain']:.4g} | {shown[0]} | {shown[1]} | {verdict} |")
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fabric", default="knit-12")
    parser.add_argument("--seed", type=int, default=5521)
    parser.add_argument("--frames", type=int, default=6)
    parser.add_argument("--width", type=int, default=1936)
    parser.add_argument("--boards", type=int, default=20)
    parser.add_argument("--folder", type=pathlib.Path, help="keeps everything there")
    parser.add_argument("--table", type=pathlib.Path, help="page whose table, after the marker, is replaced")
    parser.add_argument("protocols", nargs="*")
    options = parser.parse_args()
    good, rows, material = True, [], []
    with tempfile.TemporaryDirectory() as scratch:
        folder = (options.folder or pathlib.Path(scratch)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        for protocol in options.protocols or PROTOCOLS:
            text, fine = row(protocol, options, folder)
            good = good and fine
            rows.append(text)
            print(text, flush=True)
        if set(FITTED) <= set(options.protocols or PROTOCOLS):
            material = compare_materials(folder)
            print("\n".join(material))
    if options.table:
        before = options.table.read_text().split(MARKER)[0]
        text = before + MARKER + "\n\n" + HEAD + "\n".join(rows) + "\n"
        if material:
            text += "\n" + MATERIAL_HEAD + "\n".join(material) + "\n"
        options.table.write_text(text)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
