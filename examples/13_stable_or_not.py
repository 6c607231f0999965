"""The linear model of a force loop: is it stable, with which margins, and on which surfaces?

The model is the derivative of the bench's own tick about a press at rest: three joints, the sensor's lag, sampling at
480 Hz under a loop of 1 kHz. Friction is left out; with it (friction=True) an oscillation may turn into sticking.
"""

from palpate.bench import load, with_values
from palpate.studies.analysis import linearise, margins, stable_intervals, stable_stiffness

foam = load("foam-hybrid")
loop = linearise(foam)
slowest = loop.modes[0]
print(
    f"foam: {'stable' if loop.stable else 'unstable'}, the slowest motion dies away at {-slowest.rate:.2f} /s"
)
for mode in loop.modes[:6]:
    if mode.frequency > 0.0:
        print(f"  it swings at {mode.frequency:.1f} Hz, damping ratio {mode.damping:.2f}")
found = margins(loop)
print(f"  it bears {found.gain:.1f} times the gain, or {1e3 * found.delay:.0f} ms more of lag")

low, high = stable_stiffness(foam, 1e3, 1e6)
print(f"the same gains are stable up to {high / 1e3:.0f} kN/m, B_e being {foam.surface.damping:g} N s/m")

stiff = with_values(foam, {"surface.stiffness": 1.2 * high})
print(f"a fifth beyond: {'stable' if linearise(stiff).stable else 'unstable'}")
for low, high in stable_intervals(stiff, "controller.kf", 0.0, 2.0):
    print(f"  there kf may lie in {low:.2f} ... {high:.2f}")
