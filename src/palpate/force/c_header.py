"""The header of a force loop in C beside a certificate: whether both are of one law and of the same gains."""

from __future__ import annotations

import re
from pathlib import Path

from palpate.errors import InputError
from palpate.files import read_text
from palpate.force import Certificate


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
    own = certificate.gains
    for what, mine in (("another law", own.law), ("other gains", own.digest)):
        if notes[what.split()[1]] != mine:
            raise InputError(
                f"{path} is of {what} ({notes[what.split()[1]]:.24}) than the certificate ({mine:.24}); "
                "export it from the certificate's gains, or certify its own"
            )
