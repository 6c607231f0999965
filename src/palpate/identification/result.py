"""The result of an identification."""

from dataclasses import asdict, dataclass, field
from math import isclose, pi, sqrt
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.identification.causes import Warn
from palpate.identification.uncertainty import Input, Measurement, Parameter, Verdict
from palpate.records import Compared, Readable, Result


@dataclass(frozen=True)
class DynamicStiffness(Readable):
    """Force over position about one frequency: storage in phase with the position, loss in quadrature.

    Args:
        frequency: middle of the octave [Hz].
        in_phase, in_quadrature: storage and loss [N/m].
        blocks: how many there are.
        share: of the position's variance in contact.
    """

    frequency: float
    in_phase: Measurement
    in_quadrature: Measurement
    blocks: int
    share: float

    @property
    def storage(self) -> float:
        """Value of the storage [N/m]."""
        return self.in_phase.value

    @property
    def storage_half(self) -> float:
        """Its 95 % half-width [N/m], from the variance between blocks."""
        return self.in_phase.half

    @property
    def loss(self) -> float:
        """Value of the loss [N/m]."""
        return self.in_quadrature.value

    @property
    def loss_half(self) -> float:
        """Its 95 % half-width [N/m]."""
        return self.in_quadrature.half

    def to_json(self) -> dict[str, float]:
        """Plain values that JSON can hold."""
        names = ("storage", "storage_half", "loss", "loss_half", "blocks")
        return {"Hz": self.frequency} | {name: getattr(self, name) for name in names}


@dataclass(frozen=True)
class Relaxation:
    """Relaxation of the force in a hold.

    Args:
        share: of the force at the begin of the hold that is gone at its end.
        half_time: after which half of that is gone [s].
        duration: of the hold [s].
    """

    share: float
    half_time: float
    duration: float


@dataclass(frozen=True)
class Tangent:
    """Slope of force over depth in loading [N/m], at one force [N]."""

    force: float
    slope: Measurement

    @property
    def stiffness(self) -> float:
        """Value of the slope [N/m]."""
        return self.slope.value

    @property
    def half(self) -> float:
        """Its 95 % half-width [N/m]."""
        return self.slope.half


@dataclass(frozen=True, eq=False)
class Press(Compared):
    """Force over depth.

    Args:
        tangent: in loading, by force.
        loading, unloading: depth [m] and force [N] in loading and unloading, shape (2, n); empty if it is not there.
        hysteresis_loss: share of the work put in that does not come back; None without an unloading.
        relaxation: None without a hold.
        pull_off: largest force with which the surface holds the probe as it leaves [N]; None if none shows.
        late: by how much the force is read after the position by the work that comes back beyond what went in, and its
            half-width [s]; None if no more comes back.
    """

    tangent: tuple[Tangent, ...]
    loading: Array
    unloading: Array
    hysteresis_loss: float | None = None
    relaxation: Relaxation | None = None
    late: tuple[float, float] | None = None
    pull_off: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain values that JSON can hold."""
        tangent = [{"force_N": t.force, "stiffness": t.stiffness, "half": t.half} for t in self.tangent]
        relaxation = None
        if self.relaxation:
            relaxation = {
                "share": self.relaxation.share,
                "half_time_s": self.relaxation.half_time,
                "duration_s": self.relaxation.duration,
            }
        loss = {"hysteresis_loss": self.hysteresis_loss, "pull_off_N": self.pull_off}
        return {"tangent": tangent, **loss, "relaxation": relaxation}


@dataclass(frozen=True)
class WorkingPoint(Readable):
    """The stiffness that the log shows, whatever the model, and what it belongs to.

    Args:
        stiffness: storage of an octave, or slope of the loading.
        force_N, depth_m: mean in contact.
        frequency_Hz: middle of the octave; of a press, one over four times its rise.
        source: octave or press.
        prediction95: interval for the same measured once more; None if it was measured once.
        from_surface: whether the depth counts from the surface, which free motion shows; else from the middle of the
            motion.
        each: stiffness of each press, in the order of time.
        differs: whether these lie farther apart than the tolerance, and it is not identified for that.
    """

    stiffness: Parameter
    force_N: float
    depth_m: float
    frequency_Hz: float
    source: str
    prediction95: tuple[float, float] | None = None
    from_surface: bool = True
    each: tuple[float, ...] = ()
    differs: bool = False

    def to_json(self) -> dict[str, Any]:
        """Plain values that JSON can hold."""
        interval = list(self.prediction95) if self.prediction95 else None
        return {
            "stiffness": self.stiffness.to_json() | {"prediction95": interval},
            "force_N": self.force_N,
            "depth_m": self.depth_m,
            "frequency_Hz": self.frequency_Hz,
            "source": self.source,
            "each": list(self.each),
        }


@dataclass(frozen=True)
class Comparison:
    """Fit of one model to the same filtered force, by its name, and the comment on it."""

    model: str
    r2: float
    rmse: float
    note: str


@dataclass(frozen=True, eq=False)
class Traces(Compared):
    """Data of the figure: filtered signals of the whole log, shape (n,), and the fit in contact, shape (m,).

    Args:
        time, force: of the whole log [s], [N].
        fitted_time, fitted_position, fitted_force: of the samples that were fitted [s], [m], [N].
        predicted: the force by the model [N].
        columns: by linear parameter, what one unit of it adds to the predicted force, shape (m,).
        theta: the fit's own number of each of them, also where no number is given to the user.
        prior: standard deviation of the prior of some of them.
        matched: whether the samples are the force sensor's own, with noise as white as its; else all have passed a
            filter chain.
        position_unit, force_unit: of the log.
    """

    time: Array
    force: Array
    fitted_time: Array
    fitted_position: Array
    fitted_force: Array
    predicted: Array
    columns: dict[str, Array] = field(default_factory=dict)
    theta: dict[str, float] = field(default_factory=dict)
    prior: dict[str, float] = field(default_factory=dict)
    matched: bool = False
    position_unit: str = "m"
    force_unit: str = "N"


@dataclass(frozen=True)
class SlideFound:
    """A slide along the surface, as `palpate.contact_frame` finds it in a log.

    Args:
        sentence: the answer.
        facts: sentences on normal and stiffness.
        values: the same and the places of the path, as plain values.
    """

    sentence: str
    facts: tuple[str, ...]
    values: dict[str, Any]


@dataclass(frozen=True)
class LagFound:
    """Delay of the force behind the position.

    Args:
        value, std: [s].
        bound: half-width of its 95 % interval, whatever the model [s].
        kind: told (calibrated), measured (the log narrows the prior to half or less) or prior.
    """

    value: float
    std: float
    bound: float
    kind: str


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Result):
    """The contact's model, its parameters with verdicts, and warnings.

    Args:
        model: name of the contact model that the parameters belong to.
        parameters: by name.
        contacts: start and end of each contact [s], on the log's clock from its first row.
        lag: how much later the force is read than the position; None if nothing is known of it.
        r2, rmse, n: of the fit to the filtered force [N], and the number of samples fitted.
        warnings: what was seen on the way.
        comparison: all the models that were tried.
        cutoff: of the filter chain [Hz].
        traces: for the figure.
        working_point: the stiffness that the log shows whatever the model; None without a contact.
        dynamic_stiffness: by octave, lowest first.
        press: force over depth; None if the log does not show one.
        options: what was told, as plain values.
        depth: penetration that K, B and K1 belong to, of a model in which they grow with it [m]; else None.
        inputs: input quantities of the uncertainties, by cause.
        correlation: of the estimates of K, B and M, each pair by its names.
        slide: where the tip slides; parameters are then mu and K.
        source: name of the log, for titles.
    """

    model: str
    parameters: dict[str, Parameter]
    contacts: tuple[tuple[float, float], ...]
    lag: LagFound | None
    r2: float
    rmse: float
    n: int
    warnings: tuple[Warn, ...]
    comparison: tuple[Comparison, ...] = ()
    cutoff: float = float("nan")
    traces: Traces | None = field(default=None, repr=False)
    working_point: WorkingPoint | None = None
    dynamic_stiffness: tuple[DynamicStiffness, ...] = ()
    press: Press | None = field(default=None, repr=False)
    options: dict[str, Any] = field(default_factory=dict, repr=False)
    depth: float | None = None
    inputs: dict[str, Input] = field(default_factory=dict, repr=False)
    correlation: dict[str, float] = field(default_factory=dict, repr=False)
    slide: SlideFound | None = field(default=None, repr=False)
    source: str = field(default="a log", repr=False, compare=False)

    def __getattr__(self, name: str) -> Parameter:
        """A parameter by its name: `found.K`."""
        parameters = self.__dict__.get("parameters", {})
        if name not in parameters:
            known = ", ".join(parameters) or "none"
            raise AttributeError(f"an Identification has no {name!r}; its parameters are {known}")
        return parameters[name]

    @property
    def codes(self) -> tuple[str, ...]:
        """The stable words of the warnings."""
        return tuple(warn.code.word for warn in self.warnings)

    @property
    def identified(self) -> bool:
        """True if the stiffness at the working point or a parameter is identified."""
        point = [self.working_point.stiffness] if self.working_point else []
        return any(
            parameter.verdict is Verdict.IDENTIFIED for parameter in (*point, *self.parameters.values())
        )

    @property
    def resonance(self) -> tuple[float, float] | None:
        """Undamped resonance [Hz] and damping ratio, if mass, damping and stiffness are all identified."""
        parameters = [self.parameters.get(name) for name in ("K", "B", "M")]
        if not all(parameter and parameter.verdict is Verdict.IDENTIFIED for parameter in parameters):
            return None
        k, b, m = (parameter.value or 0.0 for parameter in parameters if parameter)
        return sqrt(k / m) / (2 * pi), b / (2 * sqrt(k * m))

    def to_json(self) -> dict[str, Any]:
        """The plain values that `palpate identify --json` prints."""
        # The chosen one is called as the parameters' model, whose mass may be left out.
        chosen = [isclose(comparison.rmse, self.rmse, rel_tol=1e-9) for comparison in self.comparison]
        models = [
            {
                "model": self.model if comparison else m.model,
                "r2": _plain(m.r2),
                "note": m.note,
                "chosen": comparison,
            }
            for m, comparison in zip(self.comparison, chosen, strict=True)
        ]
        return {
            "model": self.model,
            "depth_m": self.depth,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "working_point": self.working_point.to_json() if self.working_point else None,
            "dynamic_stiffness": [octave.to_json() for octave in self.dynamic_stiffness],
            "press": self.press.to_json() if self.press else None,
            "slide": self.slide.values if self.slide else None,
            "contacts": [{"start_s": start, "end_s": end} for start, end in self.contacts],
            "lag_s": None if self.lag is None else asdict(self.lag),
            "fit": {"r2": _plain(self.r2), "rmse_N": _plain(self.rmse), "n": self.n},
            "warnings": [{"code": warn.code.word, "text": warn.text} for warn in self.warnings],
            "models": models,
            "options": self.options,
            "uncertainty": self.uncertainty_json(),
        }

    def uncertainty_json(self) -> dict[str, Any]:
        """Uncertainty budgets of the working point and of each parameter with a number, as plain values."""
        point_parameter = {"working_point": self.working_point.stiffness} if self.working_point else {}
        budgets = {
            name: measurement.budget_json(self.inputs) | {"value": measurement.value, "unit": parameter.unit}
            for name, parameter in (point_parameter | self.parameters).items()
            if (measurement := parameter.measurement) is not None
        }
        return {
            "working_point": budgets.pop("working_point", None),
            "parameters": budgets,
            "correlation": self.correlation,
        }


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
