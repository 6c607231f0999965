"""The [controller] table of an experiment: one kind for each controller, and the part that it makes."""

from __future__ import annotations

from functools import singledispatch
from typing import Annotated, Any, Literal

from msgspec import Meta

from palpate._vector import Vec3
from palpate.bench.experiments.part_table import (
    NotNegative,
    NotNegativeTriple,
    Part,
    Positive,
    PositiveTriple,
    Triple,
)
from palpate.controllers import (
    CautiousPress,
    DecoupledHybrid,
    Hybrid,
    Impedance,
    Neural,
    ProportionalIntegral,
    RaibertCraig,
    SelfTuning,
    cautious_on_bench,
    join,
    self_tuning,
)
from palpate.controllers.neural import INPUTS, OUTPUTS
from palpate.controllers.proportional_integral import integral_gain
from palpate.errors import InputError
from palpate.networks import Network, network, random_layers, thesis_layers
from palpate.signals.parameters import alike, triple

Size = Annotated[int, Meta(ge=1, le=1000)]


class HybridController(Part, tag="hybrid", tag_field="kind"):
    """Hybrid control with the robot's dynamics, the integral gain per sample as in the thesis."""

    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 1.0
    ki: NotNegative = 0.003
    """Per sample."""


class NeuralController(Part, tag="neural", tag_field="kind"):
    """The hybrid controller without integral, and a network that learns what it lacks."""

    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 0.25
    learning_rate: Annotated[float, Meta(gt=0, le=1e300)] = 5e-5
    """5e-5 in the thesis' text, 1e-4 in its listing."""
    layers: tuple[Size, ...] = (12,)
    """Neurons of each hidden layer."""
    weights: Literal["thesis", "random"] = "thesis"
    """At the start: those of the listing, or drawn evenly from -scale ... scale."""
    weights_seed: Annotated[int, Meta(ge=0)] = 0
    scale: NotNegative = 0.01
    amplitude: PositiveTriple = (20.0, 10.0, 1.0)
    """Of the outputs [N, N, N m]."""
    offset: Triple = (0.0, 0.01, 0.01)
    """Added to the poses that the network sees [m, m, rad]."""


class ProportionalIntegralController(Part, tag="proportional-integral", tag_field="kind"):
    """PI on the force, hybrid control in all else: what other force controllers are judged by."""

    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 0.25
    ki: NotNegative | None = None
    """[1/s]; 5 when left out, which is what the neural controller amounts to."""
    bandwidth: Positive | None = None
    """Of the force loop [Hz], instead of ki."""


class RaibertCraigController(Part, tag="raibert-craig", tag_field="kind"):
    """The original hybrid control: joint by joint, no dynamics. One number a joint."""

    stiffness: NotNegativeTriple = (414.0, 47.0, 1.15)
    """[N m/rad]; 400 times each joint's own inertia where the thesis' arm starts."""
    damping: NotNegativeTriple = (83.0, 9.4, 0.23)
    """[N m s/rad]; 80 times."""
    integral: NotNegativeTriple = (0.0, 0.0, 0.0)
    """[N m/(rad s)]."""
    kf: NotNegative = 1.0
    ki: NotNegative = 3.0
    """[1/s]."""
    feed_forward: NotNegative = 1.0
    """Share of the desired force that is fed forward."""


class DecoupledHybridController(Part, tag="decoupled-hybrid", tag_field="kind"):
    """Force and position by accelerations, with the identified stiffness of the surface."""

    stiffness: Positive
    """K_e [N/m]."""
    form: Literal["corrected", "printed"] = "corrected"
    """The printed one multiplies by K_e, damps nothing and feeds the desired force forward."""
    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: NotNegative = 3000.0
    """[1/s^2]; as printed it multiplies K_e."""
    kfv: NotNegative = 110.0
    """Of the force's rate [1/s]; not used as printed."""


class ImpedanceController(Part, tag="impedance", tag_field="kind"):
    """A target impedance in x [m], y [m] and phi [rad]."""

    mass: PositiveTriple = (5.0, 11.0, 0.25)
    damping: NotNegativeTriple = (600.0, 880.0, 20.0)
    stiffness: NotNegativeTriple = (2000.0, 4400.0, 100.0)
    beyond: float = 0.0138
    """How far beyond the wall the desired x lies [m]."""


class SelfTuningController(Part, tag="self-tuning", tag_field="kind"):
    """PID on the force; a network tunes its gains in the loop, each between 0 and twice its middle value."""

    kp: NotNegative = 400.0
    kv: NotNegative = 80.0
    kf: Positive = 0.25
    ki: Positive = 5.0
    """[1/s]."""
    kd: Positive = 0.004
    """[s]."""
    learning_rate: Positive = 1e-3
    layers: tuple[Size, ...] = (6,)
    """Neurons of each hidden layer."""
    weights_seed: Annotated[int, Meta(ge=0)] = 0
    scale: NotNegative = 0.3
    """The weights are drawn evenly from -scale ... scale."""
    inputs: PositiveTriple = (10.0, 5.0, 100.0)
    """What the network's inputs are divided by: force error [N], the integral's share [N], force rate [N/s]."""
    dead_zone: NotNegative = 1.0
    """Force error that is not learned from [N]."""
    smoothing: Positive = 0.01
    """Time constant of the force rate [s]."""


class CautiousController(Part, tag="cautious", tag_field="kind"):
    """A stiff spring whose far end the cautious force law moves; it learns the surface and needs to be told none."""

    spring: PositiveTriple = (1e5, 2e4, 4.0)
    """K_p, K_y, K_phi [N/m, N/m, N m/rad]."""
    damping: NotNegativeTriple = (1450.0, 1000.0, 0.1)
    """Of the three."""
    force: Positive = 20.0
    """The smallest that is asked for [N]."""
    cap: Positive = 4e5
    """The stiffest surface that there may be [N/m]."""
    room: Positive = 80.0
    """Farthest that the spring is drawn beyond what is felt [N]."""


ControllerTable = (
    CautiousController
    | HybridController
    | NeuralController
    | ProportionalIntegralController
    | RaibertCraigController
    | DecoupledHybridController
    | ImpedanceController
    | SelfTuningController
)


def controller_of(table: ControllerTable, tick: float, wall: float) -> Any:
    """The controller of a table. Three have a compiled loop of their own; all others share one.

    Args:
        table: of the experiment.
        tick: time between ticks [s].
        wall: x of the undeformed surface [m].
    """
    one = made(table, tick, wall)
    return one if isinstance(one, CautiousPress | Hybrid | SelfTuning) else join(one)


@singledispatch
def made(table: Any, tick: float, wall: float) -> Any:
    """The part that a table describes."""
    raise TypeError(f"no controller for {type(table).__name__}")


@made.register
def _(c: HybridController, tick: float, wall: float) -> Hybrid:
    return Hybrid(alike(c.kp), alike(c.kv), alike(c.kf), alike(c.ki))


@made.register
def _(c: NeuralController, tick: float, wall: float) -> Neural:
    return Neural(alike(c.kp), alike(c.kv), alike(c.kf), triple(c.offset), _network(c))


@made.register
def _(c: ProportionalIntegralController, tick: float, wall: float) -> ProportionalIntegral:
    if c.ki is not None and c.bandwidth is not None:
        raise InputError("ki and bandwidth in [controller] say the same thing; leave one out")
    wanted = 5.0 if c.ki is None else float(c.ki)
    ki = wanted if c.bandwidth is None else integral_gain(c.bandwidth, c.kf)
    return ProportionalIntegral(alike(c.kp), alike(c.kv), alike(c.kf), alike(ki), tick)


@made.register
def _(c: RaibertCraigController, tick: float, wall: float) -> RaibertCraig:
    stiffness, damping, integral = triple(c.stiffness), triple(c.damping), triple(c.integral)
    return RaibertCraig(stiffness, damping, integral, float(c.kf), float(c.ki), float(c.feed_forward), tick)


@made.register
def _(c: DecoupledHybridController, tick: float, wall: float) -> DecoupledHybrid:
    kp, kv, kf = alike(c.kp), alike(c.kv), alike(c.kf)
    if c.form == "printed":
        return DecoupledHybrid.printed(kp, kv, kf, float(c.stiffness))
    return DecoupledHybrid.corrected(kp, kv, kf, alike(c.kfv), float(c.stiffness))


@made.register
def _(c: ImpedanceController, tick: float, wall: float) -> Impedance:
    target = Vec3(float(wall + c.beyond), 0.0, 0.0)
    return Impedance(triple(c.mass), triple(c.damping), triple(c.stiffness), target)


@made.register
def _(c: CautiousController, tick: float, wall: float) -> CautiousPress:
    return cautious_on_bench(tick, c.spring, c.damping, c.force, c.cap, c.room)


@made.register
def _(c: SelfTuningController, tick: float, wall: float) -> SelfTuning:
    middle = (c.kf, c.ki, c.kd)
    layers = random_layers((self_tuning.INPUTS, *c.layers, self_tuning.OUTPUTS), c.weights_seed, c.scale)
    net = network(list(layers), middle, c.learning_rate)
    numbers = (float(c.dead_zone), float(c.smoothing), tick)
    return SelfTuning(alike(c.kp), alike(c.kv), triple(middle), triple(c.inputs), *numbers, net)


def _network(c: NeuralController) -> Network:
    sizes = (INPUTS, *c.layers, OUTPUTS)
    if c.weights == "random":
        layers = random_layers(sizes, c.weights_seed, c.scale)
    elif c.layers == (12,):
        layers = thesis_layers()
    else:
        raise InputError(
            f'weights = "thesis" are for layers = [12], got {list(c.layers)} in [controller]; set weights = "random"'
        )
    return network(list(layers), c.amplitude, c.learning_rate)
