"""Change one number of an experiment and run it: how large is the overshoot on a stiffer wall?"""

import msgspec

from palpate.bench import Run, build, load
from palpate.environments import KelvinVoigtSurface

foam = load("foam-hybrid")
for stiffness in (5e3, 1e4, 2e4):
    surface = KelvinVoigtSurface(stiffness=stiffness, damping=200.0, mass=0.1)
    experiment = msgspec.structs.replace(foam, surface=surface, run=Run(press=2.0))
    record = build(experiment).run(experiment.run.duration, seed=1, press=experiment.run.press)
    contact = record["phase"] == 1.0
    overshoot = record["force"][contact].max() - record["force_desired"][contact].max()
    last = record["force"][-500:].mean()
    print(f"{stiffness:8.0f} N/m: overshoot {overshoot:5.2f} N, last half second {last:5.2f} N")
