"""`palpate certify`: where a force loop is stable: a tuned one, with its proof, or another project's controller."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from palpate.cli.options.force import ColumnOptions, TuningOutputOptions, inner_loop
from palpate.cli.options.values import FLAG, SIGNED, Mass, StiffnessRange, Time, TimeRange, options
from palpate.cli.toolkit import console, print_lines, print_result
from palpate.errors import InputError
from palpate.files import read_text
from palpate.force import Certificate

if TYPE_CHECKING:
    from rich.console import Console

    from palpate.force import Certificate
    from palpate.force.certificate import CertificateVerdict


@options("Scope of the proof", 1)
class ProofOptions:
    """Surfaces, gains and delays of the proof."""

    stiffness: StiffnessRange | None = None
    """Range of surfaces, K + B/theta, LOW:HIGH in N/m; from a thousandth of the cap to 99 % of the stability
    limit if not given."""
    damping_time: TimeRange | None = None
    "Range of B/K, 0:T in s; up to theta if not given (for the adapting law of a torque arm, 0)."
    jitter: Annotated[int, SIGNED] = 1
    "Ticks by which a reading may be older than the sensor's period while the law adapts."
    held_only: Annotated[bool, FLAG] = False
    "Leave out the proof of the adapting law."
    loop_from: Path | None = None
    """A log of commanded and measured position in free motion: the proof uses the inner loop identified from
    it."""

    def check(self) -> None:
        """Finds numbers out of range."""
        if not 0 <= self.jitter <= 10:
            raise InputError(f"--jitter must be from 0 to 10 ticks, got {self.jitter}")

    @property
    def surfaces(self) -> tuple[float, float] | None:
        """K + B/theta [N/m]."""
        if self.stiffness is None:
            return None
        low, high = self.stiffness.si
        if not 0.0 < low < high:
            raise InputError(
                f"--stiffness must be an interval above 0 N/m with its lower end first, got {str(self.stiffness)!r}"
            )
        return low, high

    @property
    def longest(self) -> float | None:
        """Longest damping time B/K [s]."""
        if self.damping_time is None:
            return None
        low, high = self.damping_time.si
        if not 0.0 == low <= high:
            raise InputError(f"--damping-time must be 0:T in seconds, got {str(self.damping_time)!r}")
        return high


@options("Another controller", 2)
class OthersOptions:
    """A controller of others, by its parameter file."""

    controller: str | None = None
    """ros2-admittance, fzi, crisp, franka or ur: the kind of controller whose YAML file is given. --stiffness names the
    surfaces on which it has to be stable, --rate its rate where the file has none. --out writes a corrected file."""
    delay: Time | None = None
    """Total delay from a command to the reading of the force that it causes, as 24:ms."""
    mass: Mass | None = None
    """Mass of the arm at its tip along the axis, for a controller that gives torques."""

    def check(self) -> None:
        """Refuse what belongs to --controller where no controller is named."""
        for name in ("delay", "mass"):
            if getattr(self, name) is not None:
                raise InputError(
                    f"--{name} belongs to --controller; a gains file of palpate tune states its own"
                )


def certify(
    gains: Path | None = None,
    /,
    *,
    foreign: OthersOptions | None = None,
    proof: ProofOptions | None = None,
    columns: ColumnOptions | None = None,
    output: TuningOutputOptions | None = None,
    check: Path | None = None,
) -> int:
    """Prove where a tuned force loop is stable, or check such a proof.

    palpate certify gains.toml --out certificate.json

    palpate certify gains.toml --check certificate.json

    palpate certify force_loop/palpate_force.h --check certificate.json

    palpate certify FILE.yaml --controller ros2-admittance --delay 24:ms --stiffness 500:20000

    A check computes norms of matrices, without a solver. A second, independent program then repeats it in exact
    arithmetic. With gains given, the check also refuses a certificate of another arm, rate or law. Exit code 1: a
    part could not be proved, or the certificate does not hold.

    Parameters
    ----------
    gains
        The file of palpate tune, or the parameter file of --controller; for a check also the header of a law in C.
    check
        A certificate to check.
    """
    proof, output = proof or ProofOptions(), output or TuningOutputOptions()
    if check is not None:
        return _check(check, gains, output)
    if gains is None:
        raise InputError("nothing to certify; give the gains file of palpate tune, or --check CERTIFICATE")
    if foreign is not None and foreign.controller is not None:
        return _judge_controller(gains, foreign, proof, columns or ColumnOptions(), output)
    if foreign is not None:
        foreign.check()
    output.check_new(output.out, ending=".json")
    proof.check()
    return _prove(gains, proof, columns or ColumnOptions(), output)


def _judge_controller(
    path: Path,
    foreign: OthersOptions,
    proof: ProofOptions,
    columns: ColumnOptions,
    output: TuningOutputOptions,
) -> int:
    from palpate.certify.controller_answer import ControllerRequest, certify_controller
    from palpate.certify.controller_lines import answer_lines
    from palpate.files import MADE, write_text
    from palpate.report.page import Answer

    output.check_new(output.out, ending=".yaml")
    for name in ("damping_time", "loop_from"):
        if getattr(proof, name) is not None:
            raise InputError(
                f"--{name.replace('_', '-')} belongs to tuned gains; leave it out with --controller"
            )
    request = ControllerRequest(
        controller=str(foreign.controller),
        delay=None if foreign.delay is None else foreign.delay.si,
        rate=columns.rate,
        mass=None if foreign.mass is None else foreign.mass.si,
        surfaces=proof.surfaces,
    )
    verdict = certify_controller(path, request)
    written = None
    if output.out is not None and verdict.corrected is not None:
        write_text(output.out, f"{MADE} certify.\n{verdict.corrected}")
        written = output.out
    lines = answer_lines(verdict.answer, written)
    print_result(Answer(verdict.answer, show=lambda _: print_lines(*lines)), json=output.json)
    return 0 if verdict.holds else 1


def _prove(path: Path, proof: ProofOptions, columns: ColumnOptions, output: TuningOutputOptions) -> int:
    from palpate.force import certify as proved
    from palpate.force import load_gains
    from palpate.force.arm import PositionLoop

    gains = load_gains(path)
    surfaces, longest = proof.surfaces, proof.longest
    measured = None
    if proof.loop_from is not None:
        arm = inner_loop(proof.loop_from, columns).of(gains.arm, proof.loop_from.name)
        measured = arm.inner if isinstance(arm.inner, PositionLoop) else None
    with console(stderr=True).status("proving") as status:
        certificate = proved(
            gains,
            surfaces,
            longest,
            proof.jitter,
            adapting=not proof.held_only,
            measured=measured,
            progress=lambda step: status.update(f"proving {step}"),
        )
    if output.out is not None and certificate.claims:
        certificate.save(output.out)
    checked = certificate.check()
    _print(certificate, checked, output, output.out)
    kinds = {claim.kind for claim in certificate.claims}
    expected = {"one-sided" if measured is not None else "held"} | (
        set() if proof.held_only else {"adapting"}
    )
    missing = expected - kinds
    if kinds and missing and not output.json:
        names = {
            "adapting": "the adapting gain",
            "held": "the constant gain",
            "one-sided": "contact lost and found",
        }
        print_lines(f"Not proved: {', '.join(names[kind] for kind in sorted(missing))}.")
    return 0 if checked.holds and not missing else 1


def _check(path: Path, gains: Path | None, output: TuningOutputOptions) -> int:
    from palpate.force import Certificate, load_gains

    certificate = Certificate.load(path)
    if gains is not None and gains.suffix == ".h":
        check_header(certificate, gains)
    elif gains is not None:
        certificate.check_of(load_gains(gains))
    with console(stderr=True).status("checking"):
        verdict = confirm(path, certificate)
    _print(certificate, verdict, output)
    return 0 if verdict.holds else 1


def confirm(path: Path, certificate: Certificate) -> CertificateVerdict:
    """The verdict, if the independent check has the same."""
    from palpate.certify.force_certificate import RefusedError, check, check_slide
    from palpate.force.sliding.slide_proof import slide_proof

    verdict, slide = certificate.check(), slide_proof(certificate)
    try:
        check(path.read_bytes())
        if slide is not None and slide["felt_stiffness"] is not None:
            check_slide(path.read_bytes(), *slide["felt_stiffness"])
    except RefusedError as error:
        return replace(verdict, holds=False, why=verdict.why or f"by the independent check, {error}")
    return verdict


def _print(
    certificate: Certificate,
    verdict: CertificateVerdict,
    output: TuningOutputOptions,
    written: Path | None = None,
) -> None:
    from palpate.force.describe import as_json, proof_lines
    from palpate.report.page import Answer
    from palpate.text import print_hanging

    def display(console: Console) -> None:
        place = written if certificate.claims else None
        print_hanging(proof_lines(certificate, verdict, place, verbose=output.verbose), console)

    print_result(Answer(as_json(certificate, verdict), show=display), json=output.json)


def check_header(certificate: Certificate, path: Path) -> None:
    """Refuses a header that the certificate does not speak of.

    Args:
        certificate: of `palpate certify`.
        path: `palpate_force.h` of `palpate export --to c`.

    Raises:
        InputError: no such header, another law, other gains.
    """
    notes = dict(re.findall(r"^// (law|gains): (.*?)\r?$", read_text(path, "a header"), re.MULTILINE))
    if notes.keys() != {"law", "gains"}:
        raise InputError(
            f"{path}: no header of a force loop in C; give the palpate_force.h of palpate export"
        )
    gains = certificate.gains
    for difference, digest in (("another law", gains.law), ("other gains", gains.digest)):
        if notes[difference.split()[1]] != digest:
            raise InputError(
                f"{path} is of {difference} ({notes[difference.split()[1]]:.24}) than the certificate ({digest:.24}); "
                "export it from the certificate's gains, or certify its own"
            )
