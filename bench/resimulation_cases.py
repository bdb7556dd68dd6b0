#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Inversion results, resimulated in several ways, into a table with seconds per simulated second.

    bench/resimulation_cases.py build/release/bin/tenter OUT [--only skirt,page] [--ways still,gravity] [--table FILE.md]

OUT is the folder that bench/inversion_cases.py filled; results go beside each case as CASE-WAY.pvd.
"""
import argparse
import json
import subprocess
import sys
from pathlib import Path

WAYS = {
    "still": ["--seconds", "5"],
    "gravity": ["--seconds", "5", "--gravity-scale", "1.01"],
    "sag": ["--seconds", "2", "--rest", "target"],
    "perturbed": ["--seconds", "2", "--perturb", "1e-3"],
    "wind": ["--seconds", "2", "--wind", "5,0,1"],
}


def run(program, folder, way, budget):
    output = folder.parent / f"{folder.name}-{way}.pvd"
    command = [program, "resimulate", folder, *WAYS[way], "--time-budget", budget, "-o", output, "--json"]
    done = subprocess.run([str(c) for c in command], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode not in (0, 5):
        sys.exit(f"{folder} {way}: exit {done.returncode}: {done.stderr}")
    answer = json.loads(done.stdout)
    certificate = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))
    answer.update(name=folder.name, way=way, vertices=certificate["vertices"], inversion=certificate["status"])
    return answer


def line(r):
    linear = r["linear_response"]
    ratio = f"{linear['ratio']:.3f}" if linear else "-"
    per_second = f"{r['seconds_per_simulated_second']:.2f}" if r["simulated_s"] > 0 else "-"
    return (f"| {r['name']} ({r['inversion']}) | {r['vertices']} | {r['way']} | {r['status']} | {r['max_displacement_rel']:.1e} | {ratio} | "
            f"{r['stuck']} / {r['sliding']} / {r['off']} / {r['landed']} | {r['steps']} + {r['rejected_steps']} | {r['iterations']} | "
            f"{per_second} | {r['peak_memory_MB']:.0f} |")


HEAD = ("| Case | Vertices | Way | Status | Moved, of size | Over linear | Stuck / sliding / off / landed | Steps + rejected | Iterations | "
        "s per simulated s | MB |\n" + "|" + "---|" * 11)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("out", type=Path)
    parser.add_argument("--only")
    parser.add_argument("--ways", default=",".join(WAYS))
    parser.add_argument("--time-budget", type=float, default=60.0)
    parser.add_argument("--table", type=Path)
    options = parser.parse_args()
    found = sorted(p.parent for p in options.out.glob("*/problem.json"))
    names = options.only.split(",") if options.only else [p.name for p in found]
    lines = [HEAD]
    print(HEAD)
    for folder in (options.out / name for name in names):
        for way in options.ways.split(","):
            lines.append(line(run(options.program, folder, way, options.time_budget)))
            print(lines[-1], flush=True)
    if options.table:
        options.table.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
