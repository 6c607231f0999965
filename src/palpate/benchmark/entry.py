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
from math import inf
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_type_hints

import msgspec

from palpate._jit import part
from palpate.bench.toml_parts import Role, check_protocol
from palpate.errors import InputError, unknown
from palpate.files import read_table, read_text
from palpate.force import load_arm
from palpate.force.ceiling import usual_force_max
from palpate.force.gains import Gains, gains_for
from palpate.plugins import is_plugin, look_in, plugin, reason

CAUTIOUS = "cautious"
"""Kind of palpate's own law, that of `palpate.force.ForceLoop`."""
CONTROLLER = Role(
    "controller", {"start": ("", "state"), "step": ("state, desired, force, position", "(speed, state)")}
)
NOISE_LEVELS = 4.0
"""Standard deviations of the noise that end the approach of the test."""


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
        arm = load_arm(self.arm)
        return gains_for(arm, force, force_max=usual_force_max(force, arm.sensor))

    def build(self, gains: Gains) -> Any:
        """The controller as the simulator takes it.

        Raises:
            InputError: an unknown kind, a plug-in that is no controller or refuses its numbers.
        """
        numbers = {name: value for name, value in self.controller.items() if name != "kind"}
        if is_plugin(self.kind):
            noise = gains.arm.sensor.noise if self.approach == "given" else -inf
            return ApproachThenControl(_load_controller(self.kind, numbers, gains), gains.approach, noise)
        if self.kind != CAUTIOUS:
            raise unknown("controller", self.kind, [CAUTIOUS, "module:Class"])
        if numbers:
            raise InputError(
                f"{self.kind} takes no numbers here, got {', '.join(numbers)}; it is tuned for the arm"
            )
        return gains.cautious()


@part
class ApproachThenControl(NamedTuple):
    """A controller behind an approach at a constant speed.

    Args:
        law: the controller.
        approach: speed in free motion [m/s].
        noise: standard deviation of a reading [N]; minus infinity if the controller approaches by itself.
    """

    law: Any
    approach: float
    noise: float

    def start(self):
        return 0.0, self.law.start()

    def step(self, state, desired, force, position):
        touched, inner = state
        if touched == 0.0 and force < NOISE_LEVELS * self.noise:
            return self.approach, state
        speed, inner = self.law.step(inner, desired, force, position)
        return speed, (1.0, inner)

    def stiffness_bound(self, state):
        """No bound is known of another controller."""
        return 0.0


def load_entry(name: str | Path) -> ForceEntry:
    """An entry from its file; modules are looked for beside it.

    Raises:
        InputError: no such file, an unknown key, a controller without a kind.
    """
    path = Path(name)
    entry = read_table(read_text(path, "an entry"), str(path), ForceEntry)
    look_in(path.parent)
    if not entry.kind:
        raise InputError(f'{path}: [controller] needs kind = "module:Class", or "{CAUTIOUS}"')
    arm = path.parent / entry.arm
    return msgspec.structs.replace(entry, arm=str(arm)) if arm.is_file() else entry


def _load_controller(name: str, numbers: Mapping[str, Any], gains: Gains) -> Any:
    cls = plugin(name).value()
    check_protocol(CONTROLLER, cls, name)
    part(cls)
    unknown_keys = [key for key in numbers if key not in cls._fields]
    if unknown_keys:
        raise unknown(f"key of [controller] for {name}", unknown_keys[0], cls._fields)
    numbers_by_name = {
        "tick": gains.arm.tick,
        "theta": gains.theta,
        "approach": gains.approach,
        "noise": gains.arm.sensor.noise,
        "force": gains.force,
        **numbers,
    }
    values = {key: value for key, value in numbers_by_name.items() if key in cls._fields}
    missing = [key for key in cls._fields if key not in values and key not in cls._field_defaults]
    if missing:
        raise InputError(f"{name} needs {missing[0]}; give it in [controller]")
    hints = get_type_hints(cls)
    values = {key: float(value) if hints.get(key) is float else value for key, value in values.items()}
    try:
        return cls(**values)
    except Exception as error:  # whatever the user's own code raises
        raise InputError(f"{name} refuses its numbers: {reason(error)}") from error
