"""A press along one direction: one TOML file with every number of a run, read and checked at the edge."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from palpate.signals.types import NotNegative, Positive, Table


class TouchedSurface(Table):
    """A spring and a damper; they may change under the force, and the surface may sway by itself."""

    stiffness: Positive
    """K [N/m]."""
    damping_ratio: NotNegative = 0.1
    """B/(2 sqrt(K m)), m the mass of a torque arm's tip, or 1 kg."""
    later: Positive | None = None
    """K from `changes` on [N/m], the force kept; as before when left out."""
    changes: NotNegative = 2.0
    """Seconds after the touch."""
    sway: NotNegative = 0.0
    """Amplitude of the surface's own motion [m]."""
    sway_frequency: NotNegative = 0.5
    """Of that [Hz]."""


class StepsAndSine(Table):
    """Desired force from the touch on: steps between two forces [N] each period [s], and a sine [N], [Hz]."""

    first: Positive = 20.0
    second: Positive | None = None
    """Of every other interval; as the first when left out."""
    period: Positive = 2.0
    amplitude: NotNegative = 0.0
    frequency: NotNegative = 0.5


class Priors(Table):
    """Factors of the law's prior over the truth; 1 is the truth."""

    cap: Positive = 1.0
    """Of the stiffest surface that there may be."""
    lag: Positive = 1.0
    """Of the loop's whole lag."""


class Duration(Table):
    """Duration."""

    press: Positive = 4.0
    """Seconds from the touch on."""
    duration: Annotated[float, Meta(gt=0, le=3600)] = 60.0
    """Seconds after which it ends in any case."""


class OneDirection(Table, kw_only=True):
    """Every number of a press along one direction."""

    title: str
    about: str = ""
    arm: str
    """ur5e, fr3, ... or a TOML file, as `palpate tune --arm` takes it."""
    surface: TouchedSurface
    force: StepsAndSine = StepsAndSine()
    priors: Priors = Priors()
    noise: NotNegative | None = None
    """Of the force sensor [N], standard deviation of a reading; as the arm's file has it when left out."""
    run: Duration = Duration()
