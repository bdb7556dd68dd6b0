#!/usr/bin/python3
# SPDX-License-Identifier: CC0-1.0
"""Reads a Tenter mounting file (docs/formats/mounting.md) with numpy."""
import json
import sys

import numpy as np


def read_mounting(path):
    """The file's content, clips by id, and the corners (4, 3) of each tag in its clip's frame."""
    with open(path, encoding="utf-8") as file:
        m = json.load(file)
    assert m["format"] == "tenter-mounting" and m["schema_version"] == 1
    for clip in m["clips"]:
        for tag in clip["tags"]:
            pose, s = tag["clip_from_tag"], 0.5 * tag["size_m"]
            corners = np.array([[-s, -s, 0], [s, -s, 0], [s, s, 0], [-s, s, 0]])
            tag["corners"] = corners @ np.array(pose["rotation"]).T + pose["translation_m"]
    m["clips"] = {clip["id"]: clip for clip in m["clips"]}
    return m


if __name__ == "__main__":
    mounting = read_mounting(sys.argv[1])
    for name, clip in mounting["clips"].items():
        for tag in clip["tags"]:
            print(name, tag["family"], tag["id"], *tag["corners"][0])
