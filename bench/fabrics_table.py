#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits every virtual fabric with every model and variant and writes what is left over as tables.

    bench/fabrics_table.py --out DIR [--frames 30] [--nodes 31] [--write docs/results.md]

Captures the seven protocols of [Est12] sec. 3.2 on the virtual rig, fits five of them, predicts the other two,
and puts the tables between the two markers of the page. What exists in DIR is used again, so that an interrupted run goes
on. Needs the standard library only.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import tempfile

FABRICS = ["satin-4", "knit-12", "denim-14", "wool-18"]
MODELS = ["stvk", "soft", "springs"]
VARIANTS = ["orthotropic", "isotropic", "linear", "linear-isotropic"]
FITTED = ["stretch-weft", "stretch-warp", "shear", "bend-weft", "bend-warp"]
HELD_OUT = ["complex-shear", "corner-pull"]
BEGIN, END = "<!-- fabrics: begin -->", "<!-- fabrics: end -->"
NOT_CONVERGED = 5


def run(arguments, *words):
    """The program's JSON answer, or None if it ended badly; and the seconds of processor time it took."""
    with tempfile.TemporaryFile("w+") as errors:
        with subprocess.Popen([arguments.tenter, *map(str, words), "--json"], stdout=subprocess.PIPE, stderr=errors, text=True) as child:
            output = child.stdout.read()
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
        seconds = usage.ru_utime + usage.ru_stime
        if child.returncode in (0, NOT_CONVERGED):
            return json.loads(output), seconds
        errors.seek(0)
        print(f"{' '.join(map(str, words))}: exit {child.returncode}: {errors.read().strip()[-300:]}", file=sys.stderr)
        return None, seconds


def capture(arguments, fabric, protocol):
    folder = arguments.out / f"{fabric}-{protocol}"
    if folder.exists():
        return
    run(arguments, "twin", "capture", "--fabric", fabric, "--protocol", protocol, "--seed", arguments.seed,
        "--nodes", arguments.nodes, "--frames", arguments.frames, "--measurement", "-o", folder)


def fit(arguments, fabric, model, variant):
    answer = arguments.out / f"{fabric}-{model}-{variant}.answer.json"
    if answer.exists():
        return json.loads(answer.read_text())
    material = arguments.out / f"{fabric}-{model}-{variant}.json"
    folders = {p: arguments.out / f"{fabric}-{p}" for p in FITTED + HELD_OUT}
    missing = [p for p in FITTED if not folders[p].exists()]
    if missing:
        return {"fabric": fabric, "model": model, "variant": variant, "missing": missing}
    fitted, seconds = run(arguments, "fit", *(folders[p] for p in FITTED), "--model", model, "--variant", variant,
                 "--threads", 1, "--no-law-uncertainty", "-o", material)
    row = {"fabric": fabric, "model": model, "variant": variant, "seconds": seconds,
           "converged": bool(fitted and fitted["converged"]), "tests": {}}
    if fitted:
        row["factorizations"] = fitted["factorizations"]
        tests = list(fitted["tests"])
        held = [folders[p] for p in HELD_OUT if folders[p].exists()]
        predicted = run(arguments, "evaluate", material, *held, "--threads", 1)[0] if held else None
        tests += predicted["tests"] if predicted else []
        row["tests"] = {t["protocol"]: t for t in tests}
    answer.write_text(json.dumps(row, indent=1))
    print(f"{fabric} {model} {variant}: {'converged' if row['converged'] else 'NOT converged'}, {seconds:.0f} s", flush=True)
    return row


def cell(test):
    if test is None:
        return "-"
    lost = test.get("unconverged_frames", 0)
    mark = f" ({lost} frames lost)" if lost else ""
    if test.get("force_nrmse") is not None:
        return f"{100 * test['force_nrmse']:.1f} %, {test['force_rms_N']:.2f} N{mark}"
    return f"{1000 * test['position_rms_m']:.2f} mm{mark}"


def table(arguments, rows):
    lines = [f"Captures: {arguments.frames} frames a protocol, specimen of {arguments.nodes} nodes a side, seed {arguments.seed}, all "
             "noise and friction on. Replica of 25 x 25 nodes. Each cell: NRMSE and RMS of the stacked clip forces, all components, or "
             "RMS of the vertices' positions; `complex-shear` and `corner-pull` took no part in the fit. Seconds are processor time of the fit.", ""]
    for fabric in arguments.fabrics:
        lines += [f"### {fabric}", "", "| model, variant | " + " | ".join(FITTED + HELD_OUT) + " | converged | s |",
                  "|---|" + "---|" * (len(FITTED + HELD_OUT) + 2)]
        for row in rows:
            if row["fabric"] != fabric:
                continue
            cells = [cell(row.get("tests", {}).get(p)) for p in FITTED + HELD_OUT]
            verdict = "no capture: " + ", ".join(row["missing"]) if "missing" in row else "yes" if row["converged"] else "**no**"
            lines.append(f"| {row['model']}, {row['variant']} | " + " | ".join(cells) + f" | {verdict} | {row.get('seconds', 0):.0f} |")
        lines.append("")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    root = pathlib.Path(__file__).resolve().parent.parent
    parser.add_argument("--tenter", default=str(root / "build/release/bin/tenter"))
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--nodes", type=int, default=31)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--fabrics", nargs="+", default=FABRICS)
    parser.add_argument("--models", nargs="+", default=MODELS)
    parser.add_argument("--variants", nargs="+", default=VARIANTS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--write", type=pathlib.Path, help="page whose marked part is replaced")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        list(pool.map(lambda k: capture(arguments, *k), [(f, p) for f in arguments.fabrics for p in FITTED + HELD_OUT]))
        keys = [(f, m, v) for m in arguments.models for v in arguments.variants for f in arguments.fabrics]
        rows = list(pool.map(lambda k: fit(arguments, *k), keys))
    text = table(arguments, rows)
    if not arguments.write:
        print(text)
        return
    page = arguments.write.read_text()
    before, rest = page.split(BEGIN)
    after = rest.split(END)[1]
    arguments.write.write_text(before + BEGIN + "\n" + text + "\n" + END + after)


if __name__ == "__main__":
    main()
