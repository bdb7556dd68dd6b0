#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the cost of a fit grows with the replica's nodes a side; rows for docs/results.md.

    bench/fit_growth.py --out DIR [--fabric knit-12] [--nodes 25,50,100] [--frames 60] [--specimen-nodes 50] [--threads 2]

Captures the five fit protocols on the virtual specimen where DIR does not hold them yet, fits StVK, orthotropic, at each
size, and prints seconds, peak memory, factorizations and the exponent of growth in the number of nodes. The material files
stay in DIR. Needs the standard library only.
"""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

TENTER = pathlib.Path(os.environ.get("TENTER_BIN", pathlib.Path(__file__).parent.parent / "build/release/bin")) / "tenter"
PROTOCOLS = ["stretch-weft", "stretch-warp", "shear", "bend-weft", "bend-warp"]
NOT_CONVERGED = 5


def run(*words):
    """Answer, wall clock [s], processor time [s], peak memory [KiB] of one run of the program."""
    begin = time.monotonic()
    with tempfile.TemporaryFile("w+") as errors:
        with subprocess.Popen([TENTER, *map(str, words), "--json"], stdout=subprocess.PIPE, stderr=errors, text=True) as child:
            output = child.stdout.read()
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode not in (0, NOT_CONVERGED):
            errors.seek(0)
            sys.exit(f"tenter {' '.join(map(str, words))}: exit {child.returncode}: {errors.read().strip()[-500:]}")
    return json.loads(output), time.monotonic() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss


def captured(options):
    folders = []
    for protocol in PROTOCOLS:
        folder = options.out / f"{options.fabric}-{protocol}-{options.frames}-{options.specimen_nodes}"
        folders.append(folder)
        if not folder.exists():
            run("twin", "capture", "--fabric", options.fabric, "--protocol", protocol, "--seed", options.seed, "--nodes",
                options.specimen_nodes, "--frames", options.frames, "--measurement", "-o", folder)
    return folders


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--fabric", default="knit-12")
    parser.add_argument("--nodes", default="25,50,100")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--specimen-nodes", type=int, default=50)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=7)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    folders = captured(options)
    print("| nodes a side | converged | wall clock | processor time | peak memory | factorizations | outer iterations | exponent |")
    print("|---|---|---|---|---|---|---|---|")
    before = None
    for nodes in map(int, options.nodes.split(",")):
        material = options.out / f"{options.fabric}-{options.frames}-{nodes}.json"
        answer, wall_s, cpu_s, memory_kib = run("fit", *folders, "--model", "stvk", "--variant", "orthotropic", "--nodes", nodes,
                                                "--threads", options.threads, "-o", material)
        exponent = "-" if before is None else f"{math.log(cpu_s / before[1]) / (2.0 * math.log(nodes / before[0])):.2f}"
        print(f"| {nodes} | {'yes' if answer['converged'] else 'no'} | {wall_s:.1f} s | {cpu_s:.0f} s | {memory_kib / 1024:.0f} MiB | "
              f"{answer['factorizations']} | {answer['outer_iterations']} | {exponent} |", flush=True)
        before = (nodes, cpu_s)


if __name__ == "__main__":
    main()
