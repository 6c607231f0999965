"""An entry of the test of force control: an arm and a controller, from one TOML file.

    title = "An integral of the error"
    arm = "ur5e"

    [controller]
    kind = "mine:Integral"
    gain = 2e-5

A controller turns a desired force, a reading and a position into a speed of the commanded position. Its class is a
NamedTuple of numbers with `start() -> state` and `step(state, desired, force, position) -> (speed, state)`; the test
fills in the fields `tick`, `theta`, `approach`, `noise` and `force`, where it has them.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_type_hints

import msgspec
import numpy as np

from palpate._jit import part
from palpate.bench.toml_parts import Role, check_protocol
from palpate.errors import InputError, unknown
from palpate.files import read_table, read_text
from palpate.force import load_arm
from palpate.force.gains import Gains, gains_for
from palpate.plugins import is_plugin, look_in, plugin, reason
from palpate_benchmark.rivals import AfterTouch, rivals

OWN = "cautious"
"""The law of `palpate.force.ForceLoop`."""
CONTROLLER = Role(
    "controller", {"start": ("", "state"), "step": ("state, desired, force, position", "(speed, state)")}
)
GIVEN = {
    "tick": "time between ticks [s]",
    "theta": "whole lag of the loop [s]",
    "approach": "speed of the approach [m/s]",
    "noise": "standard deviation of a reading [N]",
    "force": "F_d [N]",
}
"""Fields of a controller that the test fills in where its table does not give them."""


class ForceEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An entry.

    Args:
        controller: its `kind` and its numbers.
        title: of the entry; that of the controller if left out.
        arm: name of a shipped arm, or its file.
        approach: `given` lets the test approach at the speed that is safe for the arm until a reading exceeds four
            standard deviations of the noise; `own` gives the controller the free motion too.
    """

    controller: dict[str, Any]
    title: str = ""
    arm: str = "ur5e"
    approach: Literal["given", "own"] = "given"

    @property
    def kind(self) -> str:
        """Kind of the controller."""
        return str(self.controller.get("kind", ""))

    @property
    def name(self) -> str:
        """Title, or the kind of the controller."""
        return self.title or self.kind

    def gains(self, force: float) -> Gains:
        """Numbers of the arm and of the law that is tuned for it, for a desired force [N]."""
        return gains_for(load_arm(self.arm), force)

    def build(self, gains: Gains, seed: int) -> Any:
        """The controller as the simulator takes it.

        Raises:
            InputError: a kind that there is not, a plug-in that is no controller or refuses its numbers.
        """
        numbers = {name: value for name, value in self.controller.items() if name != "kind"}
        if is_plugin(self.kind):
            own = _plug_in(self.kind, numbers, gains)
            if self.approach == "own":
                return OwnApproach(own)
            return AfterTouch(own, gains.approach, gains.arm.sensor.noise)
        laws = rivals(gains, np.random.default_rng(seed))
        if self.kind not in laws:
            raise unknown("controller", self.kind, laws)
        if numbers:
            raise InputError(
                f"{self.kind} takes no numbers here, got {', '.join(numbers)}; it is tuned for the arm"
            )
        return laws[self.kind]


@part
class OwnApproach(NamedTuple):
    """A controller that has the free motion too.

    Args:
        law: the controller.
    """

    law: Any

    def start(self):
        return self.law.start()

    def step(self, state, desired, force, position):
        return self.law.step(state, desired, force, position)

    def stiffness_bound(self, state):
        """None is known of it."""
        return 0.0


def shipped_controllers(arm: str) -> list[str]:
    """Controllers that come with the test, without the law's own ablations."""
    laws = rivals(gains_for(load_arm(arm), 20.0), np.random.default_rng(0))
    return [name for name, one in laws.items() if name == OWN or isinstance(one, AfterTouch)]


def load_entry(name: str | Path) -> ForceEntry:
    """An entry from its file; modules are looked for beside it.

    Raises:
        InputError: no such file, a key that there is not, a controller without a kind.
    """
    path = Path(name)
    entry = read_table(read_text(path, "an entry"), str(path), ForceEntry)
    look_in(path.parent)
    if not entry.kind:
        raise InputError(
            f'{path}: [controller] needs kind = "module:Class", or one of those that are shipped'
        )
    arm = path.parent / entry.arm
    return msgspec.structs.replace(entry, arm=str(arm)) if arm.is_file() else entry


def _plug_in(name: str, numbers: Mapping[str, Any], gains: Gains) -> Any:
    own = plugin(name).value()
    check_protocol(CONTROLLER, own, name)
    part(own)
    given = {
        "tick": gains.arm.tick,
        "theta": gains.theta,
        "approach": gains.approach,
        "noise": gains.arm.sensor.noise,
        "force": gains.force,
    }
    hints = get_type_hints(own)
    strange = [key for key in numbers if key not in own._fields]
    if strange:
        raise unknown(f"key of [controller] for {name}", strange[0], own._fields)
    values = {key: value for key, value in (given | dict(numbers)).items() if key in own._fields}
    missing = [key for key in own._fields if key not in values and key not in own._field_defaults]
    if missing:
        raise InputError(f"{name} needs {missing[0]}; give it in [controller]")
    values = {key: float(value) if hints.get(key) is float else value for key, value in values.items()}
    try:
        return own(**values)
    except Exception as error:  # whatever the user's own code raises
        raise InputError(f"{name} refuses its numbers: {reason(error)}") from error
