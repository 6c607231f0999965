"""`palpate excite`: which force to ask for, so that a surface shows what it is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from palpate.cli._terminal import console, place, print_json
from palpate.errors import InputError
from palpate.files import check_place

if TYPE_CHECKING:
    from palpate.excitation import Design, ForceLoop, Question, Remedy, Sensors

_FLAG = Parameter(negative=())
_NUMBER = Parameter(allow_leading_hyphen=True)


def excite(
    *,
    stiffness: Annotated[str, _NUMBER],
    damping: Annotated[str, _NUMBER],
    mass: Annotated[str | None, _NUMBER] = None,
    force: Annotated[str, _NUMBER],
    peak: Annotated[str, _NUMBER],
    precision: Annotated[str, _NUMBER] = "10%",
    least: Annotated[str, _NUMBER] = "2",
    bandwidth: Annotated[str, _NUMBER] = "40",
    lowest: Annotated[str, _NUMBER] = "0.5",
    force_rate: Annotated[str | None, _NUMBER] = None,
    drive: Annotated[str | None, _NUMBER] = None,
    duration: Annotated[str | None, _NUMBER] = None,
    longest: Annotated[str, _NUMBER] = "60",
    settle: Annotated[str, _NUMBER] = "1",
    kind: str = "multisine",
    criterion: str = "worst",
    noise: Annotated[str, _NUMBER] = "0.6",
    sampling: Annotated[int, _NUMBER] = 480,
    force_filter: str = "butterworth3:120",
    rate: Annotated[int, _NUMBER] = 1000,
    position_step: Annotated[str, _NUMBER] = "1.6:um",
    lag_std: Annotated[str, _NUMBER] = "0",
    loop_bandwidth: Annotated[str | None, _NUMBER] = None,
    tip_mass: Annotated[str | None, _NUMBER] = None,
    tip_friction: Annotated[str | None, _NUMBER] = None,
    gain: Annotated[float | None, _NUMBER] = None,
    integral: Annotated[float | None, _NUMBER] = None,
    out: Path | None = None,
    experiment: Path | None = None,
    replace: Annotated[bool, _FLAG] = False,
    figure: Path | None = None,
    no_figure: Annotated[bool, _FLAG] = False,
    json: Annotated[bool, _FLAG] = False,
) -> int:
    """Design a force that shows what a surface is, and say how well, before the robot moves.

    Numbers are SI, or carry their unit after a colon; a range is LOW:HIGH or LOW:HIGH:UNIT:

    palpate excite --stiffness 3:8:N/mm --damping 50:300 --mass 0.1:0.3 --force 15 --peak 20 --precision K=5%,B=5%,M=25%

    Exit code 1 says that the precision cannot be had within the limits; what would help is printed.

    Parameters
    ----------
    stiffness
        Of the surfaces it shall serve, N/m; one value for a surface that is known.
    damping
        Of the surfaces, N s/m.
    mass
        Of the surfaces, kg; left out, they have none that matters.
    force
        Mean force, N.
    peak
        Highest force, N.
    precision
        Largest 95 % half-width of every parameter, 10% or 0.1, or of some, K=2%,M=25%.
    least
        Lowest force, N, so that contact is kept.
    bandwidth
        Highest frequency, Hz.
    lowest
        Lowest frequency, Hz.
    force_rate
        Fastest change of the desired force, N/s.
    drive
        How far the desired force may depart from its mean, N, if more than the force on the surface may.
    duration
        Of the excitation, s; the shortest that suffices if not given.
    longest
        That it may last, s.
    settle
        Before the part that counts, s.
    kind
        multisine or chirp.
    criterion
        What a multisine makes small: the worst parameter, or D, A or E as the theory of experiments has them.
    noise
        Standard deviation of one reading of the force sensor, N.
    sampling
        Independent readings of the force sensor a second.
    force_filter
        Low-pass before the sampling, as butterworth3:120, or none.
    rate
        Rows a second of the log, and of --out.
    position_step
        Quantisation of the position, m.
    lag_std
        Standard deviation of the calibrated lag between force and position, s.
    loop_bandwidth
        Of the robot's force control, Hz, if that is all that is known of it.
    tip_mass
        Effective mass of the robot at its tip, kg; of the bench's arm if not given, as all that follows.
    tip_friction
        Dry friction as felt at the tip, N.
    gain
        Of the force error.
    integral
        Of the force error, 1/s.
    out
        Where to write the desired force over time: .csv or .parquet.
    experiment
        Where to write an experiment for palpate run, a TOML file.
    replace
        Replace what stands at --out and --experiment.
    figure
        Where to write the figure, a PNG; excite.png in the current folder if not given.
    no_figure
        Write no figure.
    json
        Print one JSON object and nothing else; a figure is written only if --figure is given.
    """
    from palpate.excitation import Budget, Question, SurfaceRange
    from palpate.excitation.quantities import quantity, shares, spread

    picture = _picture(figure, wanted=not no_figure and (figure is not None or not json))
    _check_places(out, experiment, replace)
    surfaces = SurfaceRange(
        spread("--stiffness", stiffness, "stiffness"),
        spread("--damping", damping, "damping"),
        None if mass is None else spread("--mass", mass, "mass"),
    )
    budget = Budget(
        quantity("--force", force, "force"),
        quantity("--peak", peak, "force"),
        quantity("--least", least, "force"),
        quantity("--lowest", lowest, "frequency"),
        quantity("--bandwidth", bandwidth, "frequency"),
        float("inf") if force_rate is None else quantity("--force-rate", force_rate, "force rate"),
        None if drive is None else quantity("--drive", drive, "force"),
    )
    question = Question(
        surfaces,
        budget,
        shares("--precision", precision, surfaces.names),
        _sensors(noise, sampling, force_filter, rate, position_step, lag_std),
        _loop(loop_bandwidth, tip_mass, tip_friction, gain, integral),
        kind,
        criterion,
        None if duration is None else quantity("--duration", duration, "time"),
        quantity("--longest", longest, "time"),
        quantity("--settle", settle, "time"),
    )
    return _answer(question, rate, out, experiment, picture, json)


def _sensors(
    noise: str, sampling: int, force_filter: str, rate: int, position_step: str, lag_std: str
) -> Sensors:
    from palpate.excitation import Sensors
    from palpate.excitation.quantities import quantity
    from palpate.identification.information import ForceChain, phase_std
    from palpate.signals.low_pass import LowPass

    for option, value in (("--sampling", sampling), ("--rate", rate)):
        if value < 1:
            raise InputError(f"{option} must be at least 1 Hz, got {value}")
    # A sensor as fast as its log, or faster, gives one reading a row; its phase is then a part of the lag.
    open_phase = phase_std(sampling, rate) if sampling < rate else 0.0
    chain = ForceChain(
        LowPass.parse(force_filter),
        float(min(sampling, rate)),
        quantity("--noise", noise, "force"),
        open_phase,
    )
    step = quantity("--position-step", position_step, "length")
    return Sensors(chain, step, float(rate), quantity("--lag-std", lag_std, "time"))


def _loop(
    bandwidth: str | None, mass: str | None, friction: str | None, gain: float | None, integral: float | None
) -> ForceLoop:
    from palpate.excitation import HybridLoop, KnownBandwidth
    from palpate.excitation.quantities import quantity

    given = {
        "tip_mass": None if mass is None else quantity("--tip-mass", mass, "mass"),
        "friction": None if friction is None else quantity("--tip-friction", friction, "force"),
        "gain": gain,
        "integral": integral,
    }
    told: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if bandwidth is None:
        return HybridLoop(**told)
    if told:
        raise InputError(
            "--loop-bandwidth stands for the whole robot; leave out --tip-mass, --tip-friction, --gain, --integral"
        )
    return KnownBandwidth(quantity("--loop-bandwidth", bandwidth, "frequency"))


def _picture(figure: Path | None, wanted: bool) -> Path | None:
    """Where the figure goes; found wrong before any work is done."""
    if not wanted:
        return None
    path = figure if figure is not None else Path("excite.png")
    check_place(path, "--figure", ending=".png")
    return path


def _check_places(out: Path | None, experiment: Path | None, replace: bool) -> None:
    from palpate.report.excitation_files import check_ending

    if out is not None:
        check_ending(out)
        check_place(out, "--out")
    if experiment is not None:
        check_place(experiment, "--experiment", ending=".toml")
    for path in filter(None, (out, experiment)):
        if path.exists() and not replace:
            raise InputError(f"{path} exists; choose another place, or add --replace")


def _answer(
    question: Question, rate: int, out: Path | None, experiment: Path | None, picture: Path | None, json: bool
) -> int:
    from palpate.excitation import design, remedies

    found = design(question)
    helps = [] if found.feasible else remedies(found)
    if found.feasible:
        _write(found, rate, out, experiment)
    if picture is not None:
        from palpate.report.excitation import write_figure

        write_figure(found, picture)
    _print(found, helps, [out, experiment] if found.feasible else [], picture, json)
    return 0 if found.feasible else 1


def _write(found: Design, rate: int, out: Path | None, experiment: Path | None) -> None:
    from palpate.files import write_text
    from palpate.report import excitation_files as files

    if out is not None:
        files.write_force(found, out, float(rate))
    if experiment is not None:
        write_text(experiment, files.experiment(found))


def _print(
    found: Design, helps: list[Remedy], written: list[Path | None], picture: Path | None, json: bool
) -> None:
    if json:
        from palpate.report.excitation_files import summary

        print_json(summary(found, helps))
        return
    from palpate.report.excitation_table import show

    screen = console()
    screen.soft_wrap = True
    show(found, helps, screen)
    for path in (*filter(None, written), *([picture] if picture else [])):
        place(screen, "written:", path)
