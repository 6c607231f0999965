"""Map a surface with a stiff lump: forty presses at places that the map itself chooses, and an interval everywhere."""

import numpy as np

from palpate.maps import StiffnessMap

rng = np.random.default_rng(1)


def press(places):
    """A press at each place (n, 2) [m], as a robot would report it: stiffness and half-width of its interval [N/m]."""
    lump = 1.0 / (1.0 + np.exp((np.hypot(*(places - [0.035, 0.02]).T) - 0.012) / 0.0015))
    stiffness = 900.0 * np.exp(1.3 * lump + 0.03 * rng.normal(size=len(places)))
    return stiffness, 0.04 * stiffness


# Sixteen presses on a grid, then three at a time where the map is worst known: at the edge of what is above 1.7 kN/m.
places = np.stack(np.meshgrid(np.linspace(0.0, 0.06, 4), np.linspace(0.0, 0.06, 4)), axis=-1).reshape(-1, 2)
surface = StiffnessMap()
surface.update(places, *press(places))
while len(surface) < 40:
    places = np.asarray(surface.next(3, stiffer_than=1700.0))
    surface.update(places, *press(places))

at = np.array([[0.035, 0.02], [0.01, 0.05]])
seen = surface.predict(at)
for place, stiffness, (low, high), chance in zip(
    at, seen.stiffness, seen.ci95, seen.exceeds(1700.0), strict=True
):
    x, y = 1e3 * place
    print(
        f"at ({x:.0f}, {y:.0f}) mm: {stiffness:.0f} N/m ({low:.0f} to {high:.0f}); above 1.7 kN/m: {100 * chance:.0f} %"
    )
print(f"{surface.presses_until(0.15)} more presses bring the interval under 15 % on 95 % of the surface")
