"""`palpate certify`: the proof of where a tuned force loop is stable, and its check."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from palpate.cli._terminal import console, print_json, print_lines
from palpate.cli.tune import _one_thread
from palpate.errors import InputError
from palpate.files import check_place

if TYPE_CHECKING:
    from palpate.force import Certificate
    from palpate.force.certificate import Verdict

_FLAG = Parameter(negative=())
_NUMBER = Parameter(allow_leading_hyphen=True)


# More than seven arguments: each is a flag of the command.
def certify(
    gains: Path | None = None,
    /,
    *,
    stiffness: Annotated[str | None, _NUMBER] = None,
    damping_time: Annotated[str | None, _NUMBER] = None,
    jitter: Annotated[int, _NUMBER] = 1,
    margin: Annotated[float, _NUMBER] = 1.0,
    held_only: Annotated[bool, _FLAG] = False,
    out: Path | None = None,
    replace: Annotated[bool, _FLAG] = False,
    check: Path | None = None,
    json: Annotated[bool, _FLAG] = False,
) -> int:
    """Prove where a tuned force loop is stable, or check such a proof.

    palpate certify gains.toml --out certificate.json

    palpate certify gains.toml --check certificate.json

    A check needs no solver: it takes norms of matrices. With gains beside it, it also refuses a certificate of another
    arm, rate or law. Exit code 1 says that something could not be proved, or that the certificate does not hold.

    Parameters
    ----------
    gains
        What palpate tune wrote.
    stiffness
        Range of surfaces, K + B/theta, LOW:HIGH in N/m; from a thousandth of the cap to 99 % of what is stable if not
        given.
    damping_time
        Range of B/K, 0:T in s; up to theta for a position arm, 0 for a torque arm if not given.
    jitter
        Ticks by which the age of a reading may change from tick to tick while the law adapts.
    margin
        Factor that the gains may grow by.
    held_only
        Leave out the proof of the adapting law, which takes a torque arm a minute.
    out
        Where to write the certificate, a JSON file.
    replace
        Replace what stands at --out.
    check
        A certificate to check.
    json
        Print one JSON object and nothing else.
    """
    _one_thread()
    if check is not None:
        return _checked(check, gains, json)
    if gains is None:
        raise InputError("certify what? Give the gains that palpate tune wrote, or --check CERTIFICATE")
    if out is not None:
        check_place(out, "--out")
        if out.suffix.lower() != ".json":
            raise InputError(f"{out}: a certificate is a .json file; name it so")
        if out.exists() and not replace:
            raise InputError(f"{out} exists; choose another place, or add --replace")
    if not 0 <= jitter <= 10:
        raise InputError(f"--jitter must be from 0 to 10 ticks, got {jitter}")
    if not 1.0 <= margin <= 10.0:
        raise InputError(f"--margin must be from 1 to 10, got {margin:g}")
    return _made(gains, stiffness, damping_time, jitter, margin, held_only, out, json)


# More than seven arguments: the flags of the command.
def _made(
    path: Path,
    stiffness: str | None,
    damping_time: str | None,
    jitter: int,
    margin: float,
    held_only: bool,
    out: Path | None,
    json: bool,
) -> int:
    from palpate.excitation.quantities import spread
    from palpate.force import certify as proved
    from palpate.force import load_gains

    gains = load_gains(path)
    surfaces = None if stiffness is None else spread("--stiffness", stiffness, "stiffness")
    if surfaces is not None and not 0.0 < surfaces[0] < surfaces[1]:
        raise InputError(
            f"--stiffness must be an interval above 0 N/m with its lower end first, got {stiffness!r}"
        )
    time = None if damping_time is None else spread("--damping-time", damping_time, "time")
    if time is not None and not 0.0 == time[0] <= time[1]:
        raise InputError(f"--damping-time must be 0:T in seconds, got {damping_time!r}")
    with console(stderr=True).status("proving") as status:
        made = proved(
            gains,
            surfaces,
            None if time is None else time[1],
            jitter,
            margin,
            adapting=not held_only,
            progress=lambda what: status.update(f"proving {what}"),
        )
    if out is not None and made.claims:
        made.save(out)
    _print(made, made.check(), json)
    return 0 if len(made.claims) == (1 if held_only else 2) else 1


def _checked(path: Path, gains: Path | None, json: bool) -> int:
    from palpate.force import Certificate, load_gains

    certificate = Certificate.load(path)
    if gains is not None:
        certificate.check_of(load_gains(gains))
    verdict = certificate.check()
    _print(certificate, verdict, json)
    return 0 if verdict.holds else 1


def _print(certificate: Certificate, verdict: Verdict, json: bool) -> None:
    if json:
        from palpate.force.telling import told

        print_json(told(certificate, verdict))
        return
    from palpate.force.telling import lines

    print_lines(*lines(certificate, verdict))
