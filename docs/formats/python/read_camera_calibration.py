#!/usr/bin/python3
# SPDX-License-Identifier: CC0-1.0
"""Reads a Tenter camera calibration (docs/formats/camera-calibration.md) and projects points, with numpy."""
import json
import sys

import numpy as np


def read_camera_calibration(path):
    """The file's content, poses and covariance as arrays, cameras by name."""
    with open(path, encoding="utf-8") as file:
        c = json.load(file)
    assert c["format"] == "tenter-camera-calibration" and c["schema_version"] == 1
    assert c["verdict"] == "accepted", c["reasons"]
    for camera in c["cameras"]:
        pose = camera["camera_from_world"]
        camera["R"], camera["t"] = np.array(pose["rotation"]), np.array(pose["translation_m"])
    c["cameras"] = {camera["name"]: camera for camera in c["cameras"]}
    return c


def project(camera, points):
    """Pixels (n, 2) of points (n, 3) of the world in metres."""
    X = np.asarray(points) @ camera["R"].T + camera["t"]
    x, y = X[:, 0] / X[:, 2], X[:, 1] / X[:, 2]
    k1, k2, p1, p2, k3, k4, k5, k6 = camera["distortion"]
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([camera["fx_px"] * xd + camera["cx_px"], camera["fy_px"] * yd + camera["cy_px"]], axis=1)


if __name__ == "__main__":
    calibration = read_camera_calibration(sys.argv[1])
    point = [[float(value) for value in sys.argv[2:5]]] if len(sys.argv) >= 5 else [[0, 0, 1]]
    for name, camera in calibration["cameras"].items():
        print(name, *project(camera, point)[0])
