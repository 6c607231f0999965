"""Press a rubber ball in many places with a ball of steel: the mean, the next press, and Young's modulus.

The places differ by a tenth, and the truth is known here. `palpate identify presses/ --indenter sphere:10:mm` does the
same with a folder of logs.
"""

import numpy as np

import palpate
from palpate.identification import Indenter, pool, with_modulus
from palpate.records import Record

rng = np.random.default_rng(1)
radius, poisson, modulus = 0.010, 0.48, 5e5  # m, 1, Pa
ball = Indenter("sphere", radius)
time = np.arange(6000) / 1000
depth = 1e-3 * np.interp(time, [0, 1.0, 2.0, 3.0, 4.0, 6.0], [-0.3, -0.3, 0.6, 0.6, -0.3, -0.3])

found = []
for _ in range(6):
    here = modulus * (1 + 0.1 * rng.normal())
    force = 4 / 3 * here / (1 - poisson**2) * np.sqrt(radius) * np.maximum(depth, 0) ** 1.5
    log = Record(
        {"time": time, "position": depth, "force": force + rng.normal(0, 0.01, len(time))},
        {"time": "s", "position": "m", "force": "N"},
    )
    found.append(with_modulus(palpate.identify(log, lag=0.0), ball, (poisson, 0.01)))

together = pool(found)
own = together.parameters["E"]
mean = own.parameter
if mean.value is None or mean.ci95 is None or own.prediction95 is None:
    raise SystemExit(f"E: {mean.reason}")
print(
    f"E = {mean.value / 1e3:.0f} kPa, 95 %: {mean.ci95[0] / 1e3:.0f} to {mean.ci95[1] / 1e3:.0f}; in truth 500"
)
print(f"the next place: {own.prediction95[0] / 1e3:.0f} to {own.prediction95[1] / 1e3:.0f} kPa")
