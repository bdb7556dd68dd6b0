#!/usr/bin/python3
# SPDX-License-Identifier: CC0-1.0
"""Reads a Tenter session folder (docs/formats/session.md) with the standard library alone."""
import hashlib
import json
import pathlib
import re
import sys
import zlib

IMAGE = {"frame": re.compile(r"frames/[0-9]{6,16}-[A-Za-z0-9_-]{1,64}\.[a-z0-9]{1,8}"),
         "rest": re.compile(r"rest/[A-Za-z0-9_-]{1,64}\.png")}


def whole(line):
    """The record of a line without its line end, or None if the CRC does not fit."""
    text, tab, crc = line.rpartition(b"\t")
    return json.loads(text) if tab and crc == b"%08x" % zlib.crc32(text) else None


def read_session(folder):
    """The header with "records", "cut_bytes" of a torn tail, and "problems" as a list of texts."""
    folder = pathlib.Path(folder)
    session = json.loads((folder / "session.json").read_text(encoding="utf-8"))
    assert session["format"] == "tenter-session" and session["schema_version"] == 1
    records, problems, bad, tail, expected = [], [], [], 0, 0
    with open(folder / "journal.jsonl", "rb") as journal:
        for number, line in enumerate(journal, 1):
            record = whole(line.rstrip(b"\n"))
            if record is None:
                bad.append(f"line {number}: its CRC does not fit")
                tail += len(line)
                continue
            problems += bad  # A whole line behind bad ones: damage, not a torn tail.
            if not bad and record["seq"] != expected:
                problems.append(f"line {number}: has sequence number {record['seq']} instead of {expected}")
            bad, tail, expected = [], 0, record["seq"] + 1
            records.append(record)
    session["records"], session["cut_bytes"], session["problems"] = records, tail, problems
    for record in records:
        named = record["data"] if record["kind"] == "rest" else record
        for file in named["files"] if record["kind"] in ("frame", "rest") else []:
            image = folder / file["name"]
            if not IMAGE[record["kind"]].fullmatch(file["name"]) or not image.is_file():
                problems.append(f"{file['name']}: is missing")
            elif hashlib.sha256(image.read_bytes()).hexdigest() != file["sha256"]:
                problems.append(f"{file['name']}: has another SHA-256 than its record")
    return session


if __name__ == "__main__":
    s = read_session(sys.argv[1])
    print(f"{s['fabric']}, {s['protocol']}: {len(s['records'])} records, {s['cut_bytes']} bytes cut")
    for problem in s["problems"]:
        print("problem:", problem)
    for r in s["records"]:
        if r["kind"] == "sample":
            print(r["time_ns"], *r["positions_m"], *r["tensions_N"], *r["status"])
