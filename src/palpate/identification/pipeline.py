"""From a record to an Identification: the stages one after the other."""

from __future__ import annotations

from dataclasses import replace

from palpate.identification import in_series
from palpate.identification.causes import Code, Warn
from palpate.identification.contacts import contacts_of
from palpate.identification.estimators.fit import fit
from palpate.identification.evidence import evidence_of
from palpate.identification.options import Options
from palpate.identification.outcome import nothing, outcome
from palpate.identification.problem import problem_of, reduced
from palpate.identification.result import Identification
from palpate.identification.sampling import channels_of, thinned
from palpate.identification.selection import choose
from palpate.identification.verdicts import Terms, verdicts
from palpate.records import Record
from palpate.signals.low_pass import LowPass

_MOST_SAMPLES = 2_000_000
_FOLLOWS = 0.3


# More than seven arguments: the options of a user's call.
def identify(
    record: Record,
    *,
    model: str | None = None,
    lag: float | None = None,
    lag_std: float = 0.0,
    tolerance: float = 0.25,
    calibration: float = 0.0,
    series_stiffness: float | None = None,
    series_std: float = 0.0,
    series_mass: tuple[float, float] | None = None,
    bonded: bool | None = None,
    cutoff: float | None = None,
    force_filter: LowPass | str | None = None,
    mass: tuple[float, float] | None = None,
    force_sign: int | None = None,
) -> Identification:
    """Find what a probe touched, and how far to trust it.

    First what the log shows without a model: dynamic stiffness by octave, the press, the stiffness at the working
    point. Then f = M a + B v + K x + offset or one of its relatives, beside other causes of force whose size the log
    tells. Each parameter gets a verdict; a number that the log does not carry is not given.

    Args:
        record: with the columns `time` [s], `position` [m] and `force` [N], of shape (n,); NaN means no reading.
        model: kelvin-voigt, kelvin-voigt-mass, standard-linear-solid, hunt-crossley or quasi-linear-viscoelastic;
            None to choose.
        lag: how much later the force is read than the position [s], if it is calibrated.
        lag_std: standard deviation of that [s].
        tolerance: largest half-width of an identified parameter's 95 % interval, as a share of its value.
        calibration: relative standard deviation of the scales of force and position together.
        series_stiffness: of what lies between the position sensor and the surface [N/m]; it is taken out.
        series_std: standard deviation of that [N/m].
        series_mass: mass between that and the surface, which swings on it, and its standard deviation [kg].
        bonded: True if the probe is fixed to the surface, False if it is not, None to find out.
        cutoff: of the filter chain [Hz]; None to choose.
        force_filter: what the force sensor low-passes the force with before it is sampled, as `butterworth3:120`.
            The position then goes through the same, and is read at the sensor's own samples. The lag, if it is given,
            is that of a fresh reading, this low-pass included.
        mass: prior of the mass, value and standard deviation [kg]; 0 fixes it.
        force_sign: 1 if the force grows as the probe presses, -1 if it falls; None to find out.

    Raises:
        InputError: the record or an argument is wrong, in one line.
    """
    options = Options.of(
        model=model, lag=lag, lag_std=lag_std, tolerance=tolerance, calibration=calibration,
        series_stiffness=series_stiffness, series_std=series_std, series_mass=series_mass, bonded=bonded,
        cutoff=cutoff, force_filter=force_filter, mass=mass, force_sign=force_sign,
    )  # fmt: skip
    channels = channels_of(record)
    options.check_lag(channels.duration)
    channels = thinned(channels, -(-len(channels.position) // _MOST_SAMPLES))
    channels, chain, contacts = contacts_of(channels, options)
    warnings = (*channels.warnings, *contacts.warnings)
    terms = Terms(tolerance, calibration, record.units["force"], record.units["position"])
    if not contacts.spans:
        return nothing(channels, chain, options, terms, warnings)
    problem = reduced(problem_of(channels, chain, contacts, options))
    terms = replace(terms, band=problem.band)
    choice = choose(problem, options)
    problem, fitted = choice.problem, choice.answer.fit
    holds = fit(fitted.model, problem.motion, problem.force, problem.lag, fitted.lag)
    follows = max(choice.answer.fit.r2, holds.r2) > _FOLLOWS
    if not (contacts.clear or bonded or follows or contacts.press):
        rms = f"rms {choice.answer.unexplained:.3g} N"
        text = f"the force ({rms}) does not follow the position: there seems to be no contact"
        return nothing(channels, chain, options, terms, (*channels.warnings, Warn(Code.NO_CONTACT, text)))
    evidence = evidence_of(problem, options, terms.stiffness_unit, choice.answer.hidden)
    if series_stiffness is not None:
        choice = replace(choice, answer=in_series.without_series(choice.answer, series_stiffness, series_std))
        holds = in_series.without_series(holds, series_stiffness, series_std)
    if series_mass is not None:
        choice = replace(choice, answer=in_series.without_swing(choice.answer, *options.swing, problem.band))
        holds = in_series.without_swing(holds, *options.swing, problem.band)
    if contacts.payload is not None:
        choice = replace(choice, answer=in_series.with_payload(choice.answer, contacts.payload.std))
    parameters, told = verdicts(choice, holds, evidence[2], terms)
    return outcome(channels, chain, choice, holds, evidence, parameters, (*warnings, *told), options, terms)
