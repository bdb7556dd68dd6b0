#!/usr/bin/python3
# SPDX-License-Identifier: CC0-1.0
"""Reads a Tenter calibration of load cells or of cords (docs/formats/cell-calibration.md, cord-calibration.md)."""
import json
import sys


def read_force_calibration(path):
    """The file's content; cells or cords by name. Nothing may be measured with a rejected one."""
    with open(path, encoding="utf-8") as file:
        c = json.load(file)
    assert c["format"] in ("tenter-cell-calibration", "tenter-cord-calibration") and c["schema_version"] == 1
    assert c["verdict"] == "accepted", c["reasons"]
    if "cells" in c:
        c["cells"] = {cell["cell"]: cell for cell in c["cells"]}
    else:
        c["cords"] = {cord["axis"]: cord for cord in c["cords"]}
    return c


def force(calibration, cell, reading_N):
    """The force on a cell [N] that its amplifier calls reading_N."""
    line = calibration["cells"][cell]
    return line["gain"] * (reading_N - line["offset_N"])


if __name__ == "__main__":
    calibration = read_force_calibration(sys.argv[1])
    if len(sys.argv) > 3:  # CELL READING: the force that it means
        print(force(calibration, sys.argv[2], float(sys.argv[3])))
    else:
        print(json.dumps(calibration, indent=1))
