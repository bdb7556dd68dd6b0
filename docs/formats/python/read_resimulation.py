#!/usr/bin/env python3
# SPDX-License-Identifier: CC0-1.0
"""Reads a resimulation: what is known of it, and the positions of every frame from the point cache."""
import json
import sys
from pathlib import Path

import numpy as np


def read_resimulation(pvd):
    """resimulation.json as a dictionary, and positions, frames x vertices x 3 [m]."""
    pvd = Path(pvd)
    summary = json.loads((pvd.parent / f"{pvd.stem}-frames" / "resimulation.json").read_text(encoding="utf-8"))
    if summary["schema_version"] != 1:
        raise ValueError("another schema_version")
    cache = pvd.with_suffix(".pc2").read_bytes()
    version, vertices = np.frombuffer(cache, "<i4", 2, 12)
    samples = int(np.frombuffer(cache, "<i4", 1, 28)[0])
    if cache[:12] != b"POINTCACHE2\0" or version != 1:
        raise ValueError("no point cache of version 1")
    return summary, np.frombuffer(cache, "<f4", samples * vertices * 3, 32).reshape(samples, vertices, 3)


if __name__ == "__main__":
    run, positions = read_resimulation(sys.argv[1])
    moved = np.linalg.norm(positions - positions[0], axis=2).max()
    print(run["status"], f"{run['simulated_s']:.4g} s, {positions.shape[0]} frames of {positions.shape[1]} vertices, moved by up to {moved:.4g} m")
