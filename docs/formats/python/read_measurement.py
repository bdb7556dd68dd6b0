#!/usr/bin/python3
# SPDX-License-Identifier: CC0-1.0
"""Reads a Tenter measurement folder (docs/formats/measurement.md) with numpy alone."""
import base64
import json
import pathlib
import sys
import xml.etree.ElementTree as ET
import zlib

import numpy as np

TYPES = {"Float64": "f8", "Float32": "f4", "Int64": "i8", "Int32": "i4", "UInt8": "u1", "UInt64": "u8", "UInt32": "u4"}


def decode(text, dtype, header_dtype):
    """One inline array: base64 of a header (block count, block size, last size, packed sizes), then of zlib blocks."""
    text = "".join(text.split())
    count = int(np.frombuffer(base64.b64decode(text[:12])[:header_dtype.itemsize], header_dtype)[0])
    header_chars = -(-(3 + count) * header_dtype.itemsize // 3) * 4
    sizes = np.frombuffer(base64.b64decode(text[:header_chars]), header_dtype)[3:3 + count]
    packed, out, start = base64.b64decode(text[header_chars:]), b"", 0
    for size in sizes:
        out += zlib.decompress(packed[start:start + int(size)])
        start += int(size)
    return np.frombuffer(out, dtype)


def read_vtp(path):
    """Points (n, 3), triangles (m, 3) and a dictionary of point arrays of a VTP file as Tenter writes it."""
    root = ET.parse(path).getroot()
    order = "<" if root.get("byte_order") == "LittleEndian" else ">"
    header_dtype = np.dtype(order + TYPES[root.get("header_type", "UInt32")])
    piece = root.find("PolyData/Piece")

    def array(element):
        values = decode(element.text, np.dtype(order + TYPES[element.get("type")]), header_dtype)
        components = int(element.get("NumberOfComponents", "1"))
        return values.reshape(-1, components) if components > 1 else values

    triangles = array(piece.find("Polys/DataArray[@Name='connectivity']")).reshape(-1, 3)
    point_data = {a.get("Name"): array(a) for a in piece.findall("PointData/DataArray")}
    return array(piece.find("Points/DataArray")), triangles, point_data


def read_measurement(folder):
    """The header with "frames"; frames with a mesh get "points", "sigma_m" and "valid", the header gets "rest"."""
    folder = pathlib.Path(folder)
    measurement = json.loads((folder / "measurement.json").read_text(encoding="utf-8"))
    assert measurement["format"] == "tenter-measurement" and measurement["schema_version"] == 1
    if "rest_mesh" in measurement:
        points, triangles, data = read_vtp(folder / measurement["rest_mesh"])
        measurement["rest"] = {"points": points, "triangles": triangles, "uv": data["uv"]}
    lines = (folder / "frames.jsonl").read_text(encoding="utf-8").splitlines()
    measurement["frames"] = [json.loads(line) for line in lines]
    for frame in measurement["frames"]:
        if "mesh" in frame:
            frame["points"], _, data = read_vtp(folder / frame["mesh"])
            frame["sigma_m"], frame["valid"] = data["sigma_m"], data["valid"] != 0
            if "sigma_axes_m" in data:
                frame["sigma_axes_m"] = data["sigma_axes_m"]
    return measurement


if __name__ == "__main__":
    m = read_measurement(sys.argv[1])
    print(f"{m['fabric']}, {m['protocol']}: {len(m['frames'])} frames")
    for f in m["frames"]:
        tensions = " ".join(f"{c['cord']}={c['tension_N']:.17g}" for c in f.get("cords", []))
        checksum = f"{f['points'].sum():.17g} {f['sigma_m'].sum():.17g} {f['valid'].sum()}" if "points" in f else "no mesh"
        print(f["time_ns"], checksum, tensions, f.get("tensile", f.get("cantilever", "")))
