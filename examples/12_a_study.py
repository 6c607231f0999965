"""A study from Python: a grid over two numbers, five seeds each, and its table."""

import polars

from palpate.studies import run

STUDY = """
title = "Force gain and noise"
experiment = "foam-hybrid"
seeds = 5
metrics = ["force_std", "force_rms", "follows"]
window = [1.0, 2.0]               # [s] after the first contact

[fixed]                           # the arm starts near the wall
run = { press = 2.0, duration = 6.0 }
robot.start = [0.462, 0.0, 0.0]
approach = { hold = 0.3, first = 0.467 }

[parameters]
"controller.kf" = [0.25, 0.5, 1.0]
"force_sensor.noise" = { range = [0.0, 1.2], points = 3 }
"""

frame = run(STUDY, "a-study")  # killed half-way, it goes on from there
shaking = frame.group_by("controller.kf", "force_sensor.noise", maintain_order=True).agg(
    polars.col("force_std").mean().alias("shaking [N]"), polars.col("force_std").std().alias("over seeds")
)
for kf, noise, mean, spread in shaking.iter_rows():
    print(
        f"K_fp {kf:<5g} sensor noise {noise:.1f} N: the force shakes by {1e3 * mean:5.1f} +- {1e3 * spread:.1f} mN"
    )
