#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sessions of all protocols through the virtual devices and tenterd, against the specimen's truth: one row of
docs/twin.md each. In real time, some minutes a protocol.

    bench/rig_sessions.py [--fabric knit-12] [--seed 5521] [--folder DIR] [PROTOCOL...]
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

PROTOCOLS = ["stretch-weft", "stretch-warp", "shear", "bend-weft", "bend-warp", "complex-shear", "corner-pull"]
LIMIT_N = 4e-3


def tenter(*arguments):
    program = os.environ.get("TENTER", str(pathlib.Path(__file__).parent.parent / "build/release/bin/tenter"))
    done = subprocess.run([program, *arguments, "--json"], stdout=subprocess.PIPE, text=True)
    return done.returncode, json.loads(done.stdout or "{}")


def measure(protocol, options, folder):
    session, truth = folder / protocol, folder / (protocol + "-truth")
    code, _ = tenter("twin", "capture", "--fabric", options.fabric, "--protocol", protocol, "--seed", str(options.seed),
                     "--session", "--through-daemon", "-o", str(session), "--truth", str(truth))
    if code != 0:
        return f"| {protocol} | the capture ended with {code} |", False
    code, report = tenter("session", "verify", str(session))
    whole = code == 0 and report["ok"] and report["closed"]
    code, compared = tenter("twin", "truth", str(session), "--mount", str(truth / "mount.json"),
                            "-o", str(folder / (protocol + ".csv")))
    if code != 0:
        return f"| {protocol} | its truth ended with {code} |", False
    live = [json.loads(line) for line in (truth / "truth.jsonl").read_text().splitlines()][-1]
    cords = compared["cords"]
    row = [protocol, f"{report['duration_s']:.0f}", str(report["samples"]), str(len(cords)),
           f"{max(c['highest_N'] for c in cords):.2f}", f"{1e3 * max(c['way_m'] for c in cords):.1f}",
           f"{1e3 * compared['rms_N']:.2f}", f"{1e3 * compared['rms_by_travel_N']:.2f}",
           f"{1e3 * max(abs(c['bias_N']) for c in cords):.2f}", f"{1e3 * live['foretold_rms_N']:.3f}",
           f"{1e3 * live['foretold_largest_N']:.2f}"]
    return "| " + " | ".join(row) + " |", whole and compared["rms_N"] <= LIMIT_N


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fabric", default="knit-12")
    parser.add_argument("--seed", type=int, default=5521)
    parser.add_argument("--folder", type=pathlib.Path, help="keeps sessions and curves there")
    parser.add_argument("protocols", nargs="*", default=PROTOCOLS)
    options = parser.parse_args()
    good = True
    with tempfile.TemporaryDirectory() as scratch:
        for protocol in options.protocols or PROTOCOLS:
            row, fine = measure(protocol, options, options.folder or pathlib.Path(scratch))
            good = good and fine
            print(row, flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
