#!/usr/bin/env python3
# SPDX-License-Identifier: CC0-1.0
"""Reads an inversion result and checks what can be checked without a simulator: forces against weight and cones."""
import json
import sys
from pathlib import Path

import numpy as np


def read_inversion(folder):
    """The certificate as a dictionary, rest positions (n x 3) and triangles (m x 3) of rest.obj."""
    certificate = json.loads((Path(folder) / "certificate.json").read_text(encoding="utf-8"))
    if certificate["schema_version"] != 1:
        raise ValueError("another schema_version")
    rest, triangles = [], []
    for line in (Path(folder) / "rest.obj").read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            rest.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            triangles.append([int(w.split("/")[0]) - 1 for w in words[1:4]])
    return certificate, np.array(rest), np.array(triangles)


def cone_margins(certificate):
    """1 - |r_T| / (mu r_N) of every contact with a force."""
    margins = []
    for contact in certificate["contacts"]:
        force, normal = np.array(contact["force_N"]), np.array(contact["normal"])
        along = force @ normal
        if np.linalg.norm(force) > 1e-12 * certificate["weight_N"]:
            margins.append(1.0 - np.linalg.norm(force - along * normal) / (contact["friction"] * along))
    return np.array(margins)


if __name__ == "__main__":
    result, positions, faces = read_inversion(sys.argv[1])
    print(result["status"], f"{len(positions)} vertices, {len(faces)} triangles, {len(result['contacts'])} contacts")
    if result["contacts"]:
        print(f"smallest margin {cone_margins(result).min():.4f}")
