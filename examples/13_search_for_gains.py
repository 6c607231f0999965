"""A search in place of a grid: each round is a study of random gains, in a narrower range about the best so far."""

from palpate.studies import run

STUDY = """
title = "Gains by search, round {round}"
experiment = "foam-pi"
seeds = 2
samples = 16
samples_seed = {round}
metrics = ["force_rms"]

[fixed]                           # the arm starts near the wall
run = {{ press = 1.0, duration = 4.0 }}
robot.start = [0.462, 0.0, 0.0]
approach = {{ hold = 0.3, first = 0.467 }}

[parameters]
"controller.kf" = {{ log = [{kf[0]}, {kf[1]}], random = true }}
"controller.ki" = {{ log = [{ki[0]}, {ki[1]}], random = true }}
"""
GAINS = ["controller.kf", "controller.ki"]

ranges = {"kf": (0.05, 4.0), "ki": (0.5, 64.0)}
trials = {}
for number in range(3):
    frame = run(
        STUDY.format(round=number, **ranges), f"a-search/round-{number}"
    )  # killed, it goes on from there
    for setting, runs in frame.group_by(GAINS):
        if (runs["result"] == "done").all():
            trials[setting] = runs["force_rms"].mean()
    best = min(trials, key=trials.get)
    for name, value in zip(ranges, best, strict=True):
        factor = (ranges[name][1] / ranges[name][0]) ** 0.25  # half of the range, in its logarithm
        ranges[name] = value / factor, value * factor
    print(f"round {number}: K_fp {best[0]:.2f}, K_i {best[1]:5.1f} 1/s, rms {trials[best]:.3f} N")
