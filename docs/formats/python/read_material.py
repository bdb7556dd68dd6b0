#!/usr/bin/env python3
# SPDX-License-Identifier: CC0-1.0
"""Reads a Tenter material file (../material.md) with the standard library alone.

    read_material.py FILE                         components and their knots
    read_material.py FILE COMPONENT STRAIN...     stiffness, stress and energy at strains
"""
import json
import sys


def read_material(path):
    with open(path, encoding="utf-8") as file:
        material = json.load(file)
    if material["schema_version"] != 1:
        raise ValueError(f"{path}: schema_version {material['schema_version']} is not 1")
    return material


def component(material, name):
    return next(c for c in material["components"] if c["name"] == name)


def stiffness(curve, strain):
    """k(e): cubic between knots, constant beyond them."""
    e = abs(strain) if curve["even"] else strain
    knots = curve["knots"]
    if e <= knots[0]["strain"]:
        return knots[0]["stiffness"]
    for a, b in zip(knots, knots[1:]):
        if e <= b["strain"]:
            h = b["strain"] - a["strain"]
            s = (e - a["strain"]) / h
            return ((1 + 2 * s) * (1 - s) ** 2 * a["stiffness"] + s * (1 - s) ** 2 * h * a["tangent"]
                    + s**2 * (3 - 2 * s) * b["stiffness"] - s**2 * (1 - s) * h * b["tangent"])
    return knots[-1]["stiffness"]


def stress(curve, strain):
    return stiffness(curve, strain) * strain


def energy(curve, strain):
    """Integral of the stress from 0: between knots of degree 4, for which three Gauss points are exact."""
    end = abs(strain) if curve["even"] else strain
    inner = [k["strain"] for k in curve["knots"] if min(0, end) < k["strain"] < max(0, end)]
    cuts = sorted([0.0, end] + inner)
    total = 0.0
    for a, b in zip(cuts, cuts[1:]):
        middle, half = (a + b) / 2, (b - a) / 2
        for node, weight in ((-(0.6**0.5), 5 / 9), (0.0, 8 / 9), (0.6**0.5, 5 / 9)):
            total += weight * half * stress(curve, middle + node * half)
    return total if end >= 0 else -total


def main(arguments):
    if not arguments:
        sys.exit(__doc__)
    material = read_material(arguments[0])
    if len(arguments) > 2:
        curve = component(material, arguments[1])
        for e in map(float, arguments[2:]):
            print(repr(e), repr(stiffness(curve, e)), repr(stress(curve, e)), repr(energy(curve, e)))
        return
    print(f"{material['fabric']}: {material['law']}, {material['areal_density_kg_per_m2']} kg/m^2")
    for c in material["components"]:
        print(f"{c['name']} ({c['status']}) [{c['stiffness_unit']}]:",
              ", ".join(f"{k['stiffness']:.4g} at {k['strain']:.4g}" for k in c["knots"]))


if __name__ == "__main__":
    main(sys.argv[1:])
