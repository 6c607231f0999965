"""`palpate excite`: a desired force that identifies a surface."""

from __future__ import annotations

from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.cli.options import values
from palpate.cli.options.common import WRITTEN, FigureFile, FileOptions
from palpate.cli.options.values import FLAG, SIGNED, options, si
from palpate.cli.toolkit import OutputFile, print_result
from palpate.errors import InputError
from palpate.files import write_text

if TYPE_CHECKING:
    from palpate.excitation import Budget, DesignProblem, ExcitedLoop, Sensors, SurfaceRange


_FASTEST = 200_000
"""Rows or readings a second [Hz]: no sensor of force is read faster."""


@options("The surfaces", 1)
class SurfaceRangeOptions:
    """Range of the surfaces."""

    stiffness: values.StiffnessRange
    "Stiffness of the surfaces, N/m: a range, or one value if it is known."
    damping: values.DampingRange
    "Damping of the surfaces, N s/m, likewise."
    mass: values.MassRange | None = None
    "Mass of the surfaces, kg, likewise; without it they have none."

    def range(self) -> SurfaceRange:
        """Range of stiffness, damping and mass."""
        from palpate.excitation import SurfaceRange

        return SurfaceRange(
            self.stiffness.si,
            self.damping.si,
            si(self.mass),
        )


@options("Limits", 2)
class BudgetOptions:
    """Limits of force and frequency."""

    force: values.Force
    "Mean force, N."
    peak: values.Force
    "Highest force, N."
    least: values.Force = values.quantity_default("2", "force")
    "Lowest force, N, so that contact is kept."
    bandwidth: values.Frequency = values.quantity_default("40", "frequency")
    "Highest frequency, Hz."
    lowest: values.Frequency = values.quantity_default("0.5", "frequency")
    "Lowest frequency, Hz."
    force_rate: values.ForceRate | None = None
    "Fastest change of the desired force, N/s."
    drive: values.Force | None = None
    """Largest departure of the desired force from its mean, N, if it may exceed that of the force on the
    surface."""

    def budget(self) -> Budget:
        """Limits of force, frequency and speed."""
        from palpate.excitation import Budget

        return Budget(
            self.force.si,
            self.peak.si,
            self.least.si,
            self.lowest.si,
            self.bandwidth.si,
            inf if self.force_rate is None else self.force_rate.si,
            si(self.drive),
        )


@options("Goals", 3)
class GoalOptions:
    """Wanted precision, and the time for it."""

    precision: Annotated[str, SIGNED] = "10%"
    "Largest 95 % half-width of every parameter, 10% or 0.1, or of some, K=2%,M=25%."
    duration: values.Time | None = None
    "Duration of the excitation, s; the shortest sufficient one if not given."
    longest: values.Time = values.quantity_default("60", "time")
    "Longest duration, s."
    settle: values.Time = values.quantity_default("1", "time")
    "Initial time that does not count, s."


@options("The sensors", 4)
class SensorOptions:
    """Sensors of force and position."""

    noise: values.Force = values.quantity_default("0.6", "force")
    "Standard deviation of one reading of the force sensor, N."
    sampling: Annotated[int, SIGNED] = 480
    "Independent readings of the force sensor per second."
    force_filter: str = "butterworth3:120"
    "Low-pass before the sampling, as butterworth3:120, or none."
    rate: Annotated[int, SIGNED] = 1000
    "Rows per second of the log, and of --out."
    position_step: values.Length = values.quantity_default("1.6:um", "length")
    "Quantisation of the position, m."
    lag_std: values.Time = values.quantity_default("0", "time")
    "Standard deviation of the calibrated lag between force and position, s."

    def sensors(self) -> Sensors:
        """Sensors of force and position."""
        from palpate.excitation.sensors import ForceChain, Sensors, phase_std
        from palpate.signals.low_pass import LowPass

        for option, value in (("--sampling", self.sampling), ("--rate", self.rate)):
            if not 1 <= value <= _FASTEST:
                raise InputError(f"{option} must be between 1 and {_FASTEST} Hz, got {value}")
        # A sensor as fast as its log, or faster, gives one reading a row; its phase is then a part of the lag.
        open_phase = phase_std(self.sampling, self.rate) if self.sampling < self.rate else 0.0
        chain = ForceChain(
            LowPass.parse(self.force_filter),
            float(min(self.sampling, self.rate)),
            self.noise.si,
            open_phase,
        )
        step = self.position_step.si
        return Sensors(chain, step, float(self.rate), self.lag_std.si)


@options("The robot", 5)
class LoopOptions:
    """Force control of the arm."""

    loop_bandwidth: values.Frequency | None = None
    "Bandwidth of the robot's force control, Hz, if nothing else is known of it."
    tip_mass: values.Mass | None = None
    "Effective mass of the robot at its tip, kg; this and the following default to the bench's arm."
    tip_friction: values.Force | None = None
    "Dry friction as felt at the tip, N."
    gain: Annotated[float | None, SIGNED] = None
    "Proportional gain of the force error."
    integral: Annotated[float | None, SIGNED] = None
    "Integral gain of the force error, 1/s."

    def loop(self) -> ExcitedLoop:
        """Force loop that follows the desired force."""
        from palpate.excitation import HybridLoop, KnownBandwidth

        given = {
            "tip_mass": si(self.tip_mass),
            "friction": si(self.tip_friction),
            "gain": self.gain,
            "integral": self.integral,
        }
        numbers: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
        if self.loop_bandwidth is None:
            return HybridLoop(**numbers)
        if numbers:
            raise InputError(
                "--loop-bandwidth models the whole robot; leave out --tip-mass, --tip-friction, --gain, "
                "--integral"
            )
        return KnownBandwidth(self.loop_bandwidth.si)


@options(WRITTEN)
class ExcitationOutput(FigureFile, FileOptions):
    """Where the excitation is written."""

    out: Path | None = None
    "Where to write the desired force over time: .csv or .parquet."
    experiment: Path | None = None
    "Where to write an experiment for palpate run, a TOML file."
    replace: Annotated[bool, FLAG] = False
    "Replace the files at --out and --experiment."
    figure: Path | None = None
    "Where to write the figure, a PNG."

    def check_all(self) -> None:
        """Check every path before any work is done."""
        from palpate.excitation.report import check_ending

        if self.out is not None:
            check_ending(self.out)
        self.check_new(self.out)
        self.check_new(self.experiment, "--experiment", ".toml")


def excite(
    *,
    surface: SurfaceRangeOptions,
    limits: BudgetOptions,
    goal: GoalOptions | None = None,
    sensor: SensorOptions | None = None,
    robot: LoopOptions | None = None,
    output: ExcitationOutput | None = None,
) -> int:
    """Design a force that identifies a surface, and predict the uncertainty.

    Numbers are SI, or carry their unit after a colon; a range is LOW:HIGH or LOW:HIGH:UNIT:

    palpate excite --stiffness 3:8:N/mm --damping 50:300 --mass 0.1:0.3 --force 15 --peak 20 --precision K=5%,B=5%,M=25%

    Exit code 1: the precision cannot be reached within the limits; the remedies are printed.
    """
    from palpate.cli.options.values import shares
    from palpate.excitation import DesignProblem

    goal, sensor = goal or GoalOptions(), sensor or SensorOptions()
    robot, output = robot or LoopOptions(), output or ExcitationOutput()
    picture = output.picture()
    output.check_all()
    surfaces = surface.range()
    problem = DesignProblem(
        surfaces,
        limits.budget(),
        shares("--precision", goal.precision, surfaces.names),
        sensor.sensors(),
        robot.loop(),
        si(goal.duration),
        goal.longest.si,
        goal.settle.si,
    )
    return _answer(problem, sensor.rate, output, picture)


def _answer(problem: DesignProblem, rate: int, output: ExcitationOutput, picture: Path | None) -> int:
    from palpate.excitation import design, remedies
    from palpate.excitation.report import build_answer, experiment, write_figure, write_force

    result = design(problem)
    files: list[OutputFile] = []
    if result.feasible and output.out is not None:
        write_force(result, output.out, float(rate))
        files.append(OutputFile("written:", output.out))
    if result.feasible and output.experiment is not None:
        write_text(output.experiment, experiment(result))
        files.append(OutputFile("written:", output.experiment))
    if picture is not None:
        files.append(OutputFile("written:", picture, partial(write_figure, result, picture)))
    helpful = [] if result.feasible else remedies(result)
    print_result(build_answer(result, helpful), json=output.json, files=files)
    return 0 if result.feasible else 1
