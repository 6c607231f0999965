"""The loop one tick at a time in plain Python: read any state, change it, continue."""

import numpy as np

from palpate.bench import COLUMNS, build, load, march, start_at, with_values

near = {
    "robot.start": (0.4635, 0.0, 0.0),
    "approach.hold": 0.05,
    "approach.first": 0.470,
    "approach.period": 0.1,
}
bench = build(with_values(load("foam-hybrid"), near))
noise = np.random.default_rng(1).standard_normal(260)
row = np.empty((1, len(COLUMNS)))

loop, state = bench.loop, start_at(bench.loop, bench.q)
for k in range(260):
    if k == 230:
        print("the foam slips back by half a millimetre")
        loop = loop._replace(plant=loop.plant._replace(wall=loop.plant.wall + 5e-4))
    state = march(loop, state, k, noise[k : k + 1], row)
    if k % 20 == 0 or k in {229, 230}:
        tip = loop.plant.arm.pose(state.plant.q)
        phase = int(state.sequence.phase)
        print(
            f"tick {k:3d}: phase {phase}, x {1e3 * tip.x:8.4f} mm, force on the foam {state.felt.normal:6.3f} N"
        )
