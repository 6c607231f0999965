"""Figure 6.15: position along the surface and angle under the neural controller."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.bench import load, with_values
from palpate.records import Record
from palpate.report import style
from palpate.studies.metrics.window import rms
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.drawing import Axes, Figure, panels, strip
from palpate_thesis.force_control.tracking import FOAM, RUBBER, since_contact, slot
from palpate_thesis.runs import VARIED_SEEDS, Runs, rougher

NUMBER = "6.15"
PARAMETERS = with_values(load("foam-neural"), {"run.press": 15.0})
SHOWN, JUDGED = (0.0, 15.0), (10.0, 15.0)
VISIBLE = (0.5e-3, np.radians(0.2))
"""From where errors of y [m] and of the angle [rad] are not zero: some hundred times what an encoder resolves."""
SHARE = 0.25
"""Least relative reduction of the error by which a removed cause counts."""
STIFF = {"kp": 1600.0, "kv": 160.0}
CAUSES: Mapping[str, Mapping[str, Any]] = {
    "no sticking\nto the foam": {"wall.side_friction": 0.0},
    "friction\nhalf": rougher(FOAM, 0.5),
    "friction\ndouble": rougher(FOAM, 2.0),
    "friction\ncompensated": {"compensation.level": FOAM.friction.coulomb},
    "rubber": {"surface": RUBBER.surface},
    "kp 1600\nkv 160": {
        f"{who}.{gain}": v for who in ("controller", "approach") for gain, v in STIFF.items()
    },
    "hybrid control\nalone": {"controller": {"kind": "hybrid", "kf": 0.25, "ki": 0.0}},
}


class Errors(NamedTuple):
    """True errors: at the switch to force control, and RMS over the window in contact, where they may change sign."""

    y_switch: float  # [m]
    y: float  # [m]
    phi: float  # [rad]


class Data(NamedTuple):
    """Measured values for `check` and `plot`."""

    shown: Record
    varied: dict[str, list[Errors]]  # by cause; the first as chosen


def run(runs: Runs) -> Data:
    """The whole approach and fifteen seconds of contact; then with one cause changed at a time."""
    nominal = runs.over_seeds(PARAMETERS, measure_free_errors)
    changed = {name: with_values(PARAMETERS, by) for name, by in CAUSES.items()}
    varied = runs.by_name(changed, measure_free_errors, VARIED_SEEDS)
    return Data(slot(runs.record(PARAMETERS), *SHOWN), {"as\nchosen": nominal, **varied})


def check(data: Data) -> Sequence[ThesisClaim]:
    """The errors, and the two reasons that the thesis gives."""
    nominal, free = data.varied["as\nchosen"], data.varied["no sticking\nto the foam"]
    middle = {name: np.median([e.y for e in errors]) for name, errors in data.varied.items()}
    taken = 1.0 - middle["no sticking\nto the foam"] / middle["as\nchosen"]
    numbers = {"nominal": nominal, "visible": 1e3 * VISIBLE[0]}
    return [
        claim(
            "neural-free-directions",
            often(map(visible, nominal)),
            phi=[float(np.degrees(e.phi)) for e in nominal],
            visible_phi=np.degrees(VISIBLE[1]),
            gone=1 - middle["friction\nhalf"] / middle["as\nchosen"],
            **numbers,
        ),
        claim(
            "neural-free-directions.before", often(abs(e.y_switch) > VISIBLE[0] for e in nominal), **numbers
        ),
        claim("neural-free-directions.sticks", bool(taken >= SHARE), free=free, taken=taken, share=SHARE),
    ]


def plot(data: Data) -> Figure:
    """The four signals of the thesis' figure."""
    drawing, ((desired,), (force,), (y,), (phi,)) = panels([0.9, 1.3, 1.0, 1.0])
    shown, t = data.shown, data.shown["t"]
    _signal(desired, t, shown["force_desired"], "(a) desired\nforce [N]", style.INK)
    _signal(force, t, shown["force_measured"], "(b) measured\nforce [N]", style.MEASURED)
    _signal(y, t, 1e3 * shown["y_measured"], "(c) y error\n[mm]", style.SERIES[0])
    _signal(phi, t, np.degrees(shown["phi_measured"]), "(d) angle\nerror [degrees]", style.SERIES[0])
    for axis in (y, phi):
        axis.axhline(0.0, **style.KNOWN)
    phi.set_xlabel("time since contact [s]")
    return drawing


def beside(data: Data) -> Figure:
    """Error of y with one cause changed at a time."""
    drawing, ((axis,),) = panels([2.2])
    strip(axis, {name: [1e3 * e.y for e in runs] for name, runs in data.varied.items()}, "RMS of y [mm]")
    return drawing


def _signal(axis: Axes, t: Any, values: Any, label: str, color: str) -> None:
    axis.plot(t, values, color=color, linewidth=0.8)
    axis.set(ylabel=label, xlim=SHOWN)


def visible(e: Errors) -> bool:
    """True if both errors are visible."""
    return e.y > VISIBLE[0] and e.phi > VISIBLE[1]


def measure_free_errors(record: Record) -> Errors:
    """The errors of a run of fifteen seconds of contact."""
    t = since_contact(record)
    first = int(np.argmax(t >= 0.0))
    inside = (t >= JUDGED[0]) & (t < JUDGED[1])
    y, phi = record["y"], record["phi"]
    return Errors(float(y[first]), rms(y[inside]), rms(phi[inside]))
