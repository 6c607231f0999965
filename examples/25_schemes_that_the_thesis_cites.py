"""The schemes that the thesis cites, each pressing on foam: the force reached, and how far y and the angle stray.

Raibert and Craig's controller knows no dynamics, impedance control asks for no force, decoupled control needs the
stiffness, and a network tunes the gains of the last.
"""

import numpy as np

from palpate.bench import build, load, with_values

NEAR = {"robot.start": (0.462, 0.0, 0.0), "approach.first": 0.467, "approach.hold": 0.3, "run.press": 4.0}

for scheme in ("raibert-craig", "impedance", "decoupled", "self-tuning"):
    experiment = with_values(load(f"foam-{scheme}"), NEAR)
    record = build(experiment).run(experiment.run.duration, 0, press=experiment.run.press)
    last = record["t"] > record["t"][-1] - 1.0
    force, y, angle = (float(record[name][last].mean()) for name in ("force", "y", "phi"))
    print(
        f"{scheme:<14} {force:5.1f} N, y off by {1e3 * y:5.2f} mm, angle by {np.degrees(angle):5.2f} degrees"
    )
