"""A page shared on the network: this machine's address there, and its QR code."""

from __future__ import annotations

import socket
from io import StringIO

from palpate.errors import InputError

_ANYWHERE = ("192.0.2.1", 9)
"""An address of documentation (RFC 5737): asking for the way there sends nothing."""
WARNING = (
    "shared: everybody on this network who has the address can watch, and nothing is encrypted; the first page that "
    "opens it steers, all others only watch"
)


def network_address() -> str:
    """This machine's own address on its network.

    Raises:
        InputError: it is on none.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ANYWHERE)
            found = str(probe.getsockname()[0])
        except OSError:
            found = ""
    if not found or found.startswith("127.") or found == "0.0.0.0":  # noqa: S104 - compared, not listened on
        raise InputError("--share: this machine is on no network; connect it, or leave --share out")
    return found


def qr_code(text: str) -> str:
    """A text as a QR code of half-height blocks, for a terminal.

    Raises:
        InputError: segno is not installed.
    """
    try:
        import segno
    except ImportError:
        raise InputError('--share draws a QR code, which needs segno: pip install "palpate[live]"') from None
    drawn = StringIO()
    segno.make(text, error="l").terminal(drawn, compact=True)
    return drawn.getvalue()
