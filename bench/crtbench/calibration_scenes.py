"""Scenes of the calibration that are too long to write by hand: made from a fixed seed."""

import random

HEAD = """crt: 1
title: {title}
camera: {{position: [0, 1.6, 3.6], target: [0, 0.4, 0], fov: 45}}
film: {{resolution: [32, 32]}}
integrator: {{max_depth: 8}}
sampler: {{samples: 64}}
materials:
  floor: {{type: plastic, reflectance: 0.4, roughness: 0.4}}
  hair: {{type: diffuse, reflectance: {{rgb: [0.5, 0.35, 0.2]}}}}
  black: {{type: diffuse, reflectance: 0}}
objects:
  - name: floor
    material: floor
    rectangle: {{size: [6, 6]}}
    transform: [{{rotate: {{axis: [1, 0, 0], angle_deg: -90}}}}]
"""


def place(*position):
    return "{translate: [" + ", ".join(f"{x:.4f}" for x in position) + "]}"


def many_lights():
    """500 small lamps of very different powers over a glossy floor: found by the light tree."""
    chance = random.Random(1)
    text = HEAD.format(title="500 lights") + "lights:\n"
    for _ in range(500):
        x, y, z = chance.uniform(-2.5, 2.5), chance.uniform(0.05, 2), chance.uniform(-2.5, 2.5)
        text += (f"  - {{type: point, position: [{x:.4f}, {y:.4f}, {z:.4f}], "
                 f"luminous_intensity_cd: {10 ** chance.uniform(-2, 1):.4f}}}\n")
    return text


def fur():
    """400 thin cylinders under a sky and a sun."""
    chance = random.Random(2)
    text = HEAD.format(title="Fur") + ("  - name: fur\n    material: hair\n    transforms:\n")
    for _ in range(400):
        lean, turn = chance.uniform(-115, -65), chance.uniform(0, 360)
        x, z = chance.uniform(-1, 1), chance.uniform(-1, 1)
        text += (f"      - [{{rotate: {{axis: [1, 0, 0], angle_deg: {lean:.2f}}}}}, "
                 f"{{rotate: {{axis: [0, 1, 0], angle_deg: {turn:.2f}}}}}, {place(x, 0, z)}]\n")
    return text + ("    cylinder: {radius: 0.012, from_z: 0, to_z: 0.5}\n"
                   "environment: {radiance: 0.3}\n"
                   "lights:\n  - {type: sun, direction: [-0.5, -1, -0.4], illuminance_lx: 20000}\n")


MADE = {"500 lights": many_lights, "fur": fur}
