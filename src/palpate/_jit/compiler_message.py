"""Numba's error about a function, in one line: the place, and the remedy."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate._jit.kernels import _hand_over
from palpate._jit.registry import ENTRY, PACKAGE

_PLACE = re.compile(r'File "([^"\n]+\.py)", line (\d+)')
_RAISED = re.compile(r"Raised from (\S+\.py) \((\d+)\)")
_PLAIN_FUNCTION = re.compile(
    r"Untyped global name '(\w+)': Cannot determine Numba type of <class 'function'>"
)
_UNTYPED = re.compile(r"Untyped global name '(\w+)': *(?:Cannot determine Numba type of )?<?([^>\n]*)>?")
_NO_FUNCTION = re.compile(r"No implementation of function Function\(<(?:built-in )?function (\w+)[^>]*>\)")
_CALL = re.compile(r"^ *>>> (\w+\(.*\))$", re.MULTILINE)
_LONGEST = 200
"""Letters of the compiler's own words that are passed on."""


def compiled_alone(method: Callable[..., Any], *arguments: Any) -> tuple[Any, str]:
    """Compiles one function by itself.

    Args:
        method: as it was written.
        arguments: for it.

    Returns:
        The Numba type that it returns and "", or None and why it cannot be compiled, in one line.
    """
    import numba

    _hand_over()
    dispatcher = numba.njit(**ENTRY)(method)
    try:
        dispatcher.compile(tuple(map(numba.typeof, arguments)))
    except Exception as error:
        if not type(error).__module__.startswith("numba."):
            raise
        return None, short(str(error))
    return dispatcher.overloads[tuple(map(numba.typeof, arguments))].signature.return_type, ""


def short(message: str) -> str:
    """The compiler's message in one line."""
    where = _place(message)
    words = _words(message)
    return f"{where}: {words}" if where else words


def _place(message: str) -> str:
    found = [*_PLACE.findall(message), *_RAISED.findall(message)]
    own = [(file, line) for file, line in found if PACKAGE not in Path(file).resolve().parents]
    return f"{Path(own[-1][0]).name}, line {own[-1][1]}" if own else ""


def _words(message: str) -> str:
    if plain := _PLAIN_FUNCTION.search(message):
        return f"{plain[1]} is a plain function; mark it with @law (from palpate.bench import law)"
    if unknown := _UNTYPED.search(message):
        return (
            f"the compiler cannot use {unknown[1]} ({unknown[2].strip()}); keep to numbers, vectors and laws"
        )
    if missing := _NO_FUNCTION.search(message):
        call = _CALL.search(message)
        told = call[1] if call else missing[1]
        return f"the compiler knows no {told[:_LONGEST]}; keep to numbers, vectors and laws"
    lines = [line.strip() for line in message.splitlines() if line.strip()]
    told = next((line for line in lines if not line.startswith("Failed in nopython")), "it does not compile")
    return _RAISED.sub("", told)[:_LONGEST].strip()
