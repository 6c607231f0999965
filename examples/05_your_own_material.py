"""Your own material on the bench: a cushion whose stiffness grows with penetration.

A part is a NamedTuple of numbers with methods of plain arithmetic. It runs in plain Python and compiled. The
compilation takes some ten seconds: once for a part in an imported module, at each run for a part in a script like this.
"""

from typing import NamedTuple

from palpate.bench import build, load, part, with_values
from palpate.environments import UNTOUCHED, SurfaceState


@part
class Cushion(NamedTuple):
    """f = (K + K3 p^2) p + B v, without mass."""

    stiffness: float  # K [N/m]
    hardening: float  # K3 [N/m^3]
    damping: float  # B [N s/m]
    mass: float = 0.0  # every surface states its mass [kg]

    def start(self):
        return UNTOUCHED

    def force(self, state, p, v):
        return (self.stiffness + self.hardening * p * p) * p + self.damping * v

    def relax(self, state, p, v, dt):
        return SurfaceState(p, v, 0.0, 1.0)  # in contact it goes where the tip goes

    def free(self, state, dt):
        # Let go, it comes back as a spring pulls a damper; implicit, so that no step is too long.
        s = state.deflection / (1.0 + dt * self.stiffness / self.damping)
        return SurfaceState(s, (s - state.deflection) / dt, 0.0, 0.0)

    def stored_energy(self, state):
        p = state.deflection
        return 0.5 * self.stiffness * p * p + 0.25 * self.hardening * p**4

    def truth(self):
        return {"K": (self.stiffness, "N/m"), "B": (self.damping, "N s/m")}


experiment = with_values(
    load("foam-hybrid"), {"force.first": 8.0, "force.second": 20.0, "force.period": 2.0, "run.press": 8.0}
)
cushion = Cushion(2000.0, 4e8, 150.0)
bench = build(experiment).with_surface(cushion)
record = bench.run(experiment.run.duration, seed=1, press=experiment.run.press)

contact = record["t"][record["phase"] == 1.0][0]
for level in (8.0, 20.0):
    # The last half second of the first interval at this force.
    end = contact + (2.0 if level == 8.0 else 4.0)
    last = (record["t"] > end - 0.5) & (record["t"] < end)
    depth, force = record["penetration"][last].mean(), record["force"][last].mean()
    slope = cushion.stiffness + 3 * cushion.hardening * depth**2
    print(
        f"at {force:5.2f} N: {1e3 * depth:.2f} mm deep, f/x {force / depth:5.0f} N/m, slope {slope:5.0f} N/m"
    )
