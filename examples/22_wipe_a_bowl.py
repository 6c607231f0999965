"""Wipe a bowl with 10 N: the loop learns normal and friction on the way, from force and position alone."""

import numpy as np
from msgspec.structs import replace

from palpate.force import Slide, SlidingLoop, gains_for, load_arm

RADIUS, STIFFNESS, FRICTION, TICK = 0.15, 5e3, 0.3, 0.002
gains = gains_for(load_arm("ur5e"), 10.0, cap=2e4)
loop = SlidingLoop(replace(gains, slide=Slide(speed=0.04, mu_max=0.9)), into=(0.1, 0.0, -1.0))

# A bowl whose lowest point is the origin, and an arm that is where it is told to be 40 ms later.
rng, centre, command = np.random.default_rng(0), np.array([0.0, 0.0, RADIUS]), np.array([0.0, 0.0, 0.002])
tip, sponge, forces = command.copy(), command.copy(), []
for k in range(6000):
    outwards = (tip - centre) / np.linalg.norm(tip - centre)
    depth = np.linalg.norm(tip - centre) - RADIUS
    normal_force = max(STIFFNESS * depth, 0.0)
    bent = tip - sponge - ((tip - sponge) @ outwards) * outwards  # a bristle that sticks, then slips
    most = FRICTION * normal_force / (0.85 * STIFFNESS)
    bent *= min(1.0, most / max(np.linalg.norm(bent), 1e-12))
    sponge = tip - bent
    force = normal_force * outwards + 0.85 * STIFFNESS * bent + rng.normal(0.0, 0.1, 3)
    angle = 0.5 * k * TICK
    command = command + TICK * loop.update(force, tip, [np.cos(angle), np.sin(angle), 0.0])
    tip = tip + TICK / 0.04 * (command - tip)
    if loop.sliding:
        forces.append(normal_force)

error = np.degrees(np.arccos(min(loop.normal @ outwards, 1.0)))
held = np.array(forces[250:]) / 10.0 - 1.0
print(f"wiped for {TICK * len(forces):.1f} s: 10 N within {100 * np.sqrt(np.mean(held**2)):.1f} % rms")
print(f"normal off by {error:.2f} deg (95 % cone {np.degrees(loop.normal_cone95):.2f})")
low, high = loop.friction.ci95
print(f"friction {loop.friction:.2f} ({low:.2f} to {high:.2f}), truth {FRICTION}")
