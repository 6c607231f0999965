"""Design a force that identifies stiffness, damping and mass, press with it, and check the predicted uncertainty.

The surface is known here, so that the result can be checked. For an unknown surface, give ranges: the design is valid
for all of a range. `palpate excite` does the same from the command line. The touch itself, which a design neglects,
gives additional information about K.
"""

import palpate
from palpate.bench import build, parse
from palpate.excitation import Budget, DesignProblem, SurfaceRange, design, experiment
from palpate.records import Record
from palpate.signals import LowPass

truth = {"K": 5200.0, "B": 200.0, "M": 0.3}
surfaces = SurfaceRange(*((value, value) for value in truth.values()))
precision = {"K": 0.05, "B": 0.05, "M": 0.2}
found = design(DesignProblem(surfaces, Budget(mean=15.0, peak=20.0), precision))
print(f"{len(found.wave.frequencies)} sines for {found.seconds:g} s")

press = parse(experiment(found), "the design")  # the same text that `palpate excite --experiment` writes
run = build(press).run(press.run.duration, seed=1, press=press.run.press)
rows = run["phase"] == 1.0
columns = {"time": run["t"][rows], "position": run["x"][rows], "force": run["force_sampled"][rows]}
sensor = LowPass.parse("butterworth3:120")
told = palpate.identify(
    Record(columns, {"time": "s", "position": "m", "force": "N"}),
    model="kelvin-voigt-mass",
    force_filter=sensor,
    lag=sensor.lag + run.meta["instruments"]["force"]["delay_s"],
    bonded=True,
)
for name, predicted in found.worst().items():
    p = told.parameters[name]
    half = (p.ci95[1] - p.ci95[0]) / 2 / truth[name]
    print(
        f"{name}: {p.value:.4g} {p.unit}, in truth {truth[name]:g}; ± {half:.1%}, predicted ± {predicted:.1%}"
    )
