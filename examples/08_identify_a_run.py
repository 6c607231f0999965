"""A run of the bench as a log: does the identification find the parameters that only the simulation knows?

The identification gets the signals of a real log, measured position and force, and not the truth.
"""

import palpate
from palpate.bench import build, load, with_values
from palpate.records import Record

experiment = with_values(
    load("foam-hybrid"),
    {
        "force.first": 10.0,
        "force.second": 20.0,
        "force.period": 1.0,
        "force.amplitude": 2.0,
        "force.frequency": 2.0,
    },
)
bench = build(experiment)
run = bench.run(experiment.run.duration, seed=3, press=5.0)
columns = {"time": run["t"], "position": run["x_measured"], "force": run["force_measured"]}
found = palpate.identify(Record(columns, {"time": "s", "position": "m", "force": "N"}))

late = bench.loop.force.lag + bench.loop.conditioning.force.lag
said = "unknown" if found.lag is None else f"{1e3 * found.lag.value:.2f} ± {1e3 * found.lag.bound:.2f} ms"
print(f"{found.model}; force late by {said}, the instruments say {1e3 * late:.2f} ms")
for name, parameter in found.parameters.items():
    truth = bench.meta["truth"].get(name, {"value": 0.0})["value"]  # friction: the bench's surface has none
    value = "no number" if parameter.value is None else f"{parameter.value:.4g}"
    print(f"{name}: {value} {parameter.unit}, in truth {truth:g}: {parameter.verdict}")
