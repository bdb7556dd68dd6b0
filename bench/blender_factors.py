# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what Blender's cloth settings mean in newtons: blender -b --python bench/blender_factors.py

A strip of square quads hangs from its first row: its extension gives the stiffness of an edge. Two quads in a row, the
first pinned, the second loaded by its own far vertices: the angle at which it rests gives the torque of a hinge.
Prints both over what docs/exports.md says.
"""
import math

import bpy

GRAVITY = 9.81  # m/s^2


def simulate(edge_m, across, along, hanging, pinned_rows, mass_kg, frames, quality, **stiffness):
    """Rows of vertices at rest after `frames` steps of 1/24 s, as (x, y, z)."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    row = across + 1
    vertices = [(i * edge_m, 0, -j * edge_m) if hanging else (i * edge_m, j * edge_m, 0)
                for j in range(along + 1) for i in range(row)]
    quads = [(a, a + 1, a + row + 1, a + row) for j in range(along) for a in range(j * row, j * row + across)]
    mesh = bpy.data.meshes.new("strip")
    mesh.from_pydata(vertices, [], quads)
    sheet = bpy.data.objects.new("strip", mesh)
    bpy.context.collection.objects.link(sheet)
    sheet.vertex_groups.new(name="pinned").add(list(range(row * pinned_rows)), 1.0, "REPLACE")
    cloth = sheet.modifiers.new("cloth", "CLOTH")
    settings = cloth.settings
    settings.bending_model = "ANGULAR"
    settings.vertex_group_mass, settings.mass, settings.quality = "pinned", mass_kg, quality
    settings.compression_stiffness = stiffness["tension_stiffness"]
    for name, value in stiffness.items():
        setattr(settings, name, value)
    # Damped enough to come to rest, little enough to get there.
    settings.tension_damping = settings.compression_damping = settings.shear_damping = 0.002
    settings.bending_damping, settings.air_damping = 0.0, 0.1
    cloth.collision_settings.use_collision = cloth.collision_settings.use_self_collision = False
    cloth.point_cache.frame_end = frames
    scene = bpy.context.scene
    scene.gravity, scene.frame_end = (0, 0, -GRAVITY), frames
    for frame in range(1, frames + 1):
        scene.frame_set(frame)
    at_rest = sheet.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices
    return [[tuple(at_rest[j * row + i].co) for i in range(row)] for j in range(along + 1)]


def tension():
    edge_m, along, mass_kg = 0.01, 20, 1e-4
    for setting in (0.0005, 0.002):
        rows = simulate(edge_m, 4, along, True, 1, mass_kg, 400, 20, tension_stiffness=setting, shear_stiffness=0.0,
                        bending_stiffness=0.0)
        stiffness_N_per_m = 1000 * setting / edge_m
        wanted_m = sum((along - j) * mass_kg * GRAVITY / stiffness_N_per_m for j in range(along))
        print(f"tension {setting}: {wanted_m / (-rows[-1][2][2] - along * edge_m):.5f} of 1000 tension / h")


def bending():
    for edge_m, setting, mass_kg in ((0.01, 0.01, 1e-4), (0.01, 0.04, 1e-4), (0.02, 0.01, 1e-4), (0.02, 0.04, 1e-4),
                                     (0.01, 0.02, 1e-3)):
        stiff = 5000 * edge_m / 1000
        rows = simulate(edge_m, 1, 2, False, 2, mass_kg, 2000, 20, tension_stiffness=stiff, shear_stiffness=stiff,
                        bending_stiffness=setting)
        y, z = rows[2][0][1], rows[2][0][2]
        angle = math.atan2(-z, y - edge_m)
        torque_N_m = 2 * mass_kg * GRAVITY * edge_m * math.cos(angle)
        print(f"bending {setting}, h {edge_m} m: {torque_N_m / (setting * edge_m**2 * angle):.4f} bending h^2 theta "
              f"at {angle:.3f} rad")


tension()
bending()
