"""The typed edge of compiled code: what users give is cast and checked here before machine code is called.

Machine code trusts its arguments: an array of another dimension ends the process, and another type is read as if it
were the right one. Whatever a user gives passes through `cast_number` and `cast_array` first.
"""

from numbers import Real
from typing import Any

import numpy as np

from palpate._jit.kernels import Kernel, compiled_for
from palpate.arrays import Array
from palpate.errors import InputError

FLOAT = np.dtype(np.float64)
REAL_KINDS = "biuf"
"""NumPy's kinds of real numbers: truths, integers, floats."""
_NUMBERS = (float, int, np.floating, np.integer, np.bool_, Real)


def cast_number(name: str, value: Any) -> float:
    """A real number of any type as a float; may be infinite or not a number.

    Raises:
        InputError: text, a complex number, an array of one dimension or more, a number beyond every float.
    """
    if type(value) is float:
        return value
    try:
        number = value[()] if isinstance(value, np.ndarray) else value
        if isinstance(number, _NUMBERS):
            return float(number)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(
        f"{name} must be a real number within the range of a float, got one of type {_kind(value)}"
    )


def cast_array(name: str, values: Any, shape: tuple[int | None, ...] | None = None) -> Array:
    """Real numbers of any type as an aligned array of floats in one piece; no copy where they are one already.

    Args:
        name: of the array, for messages.
        values: what was given.
        shape: that it must have; None where a length is free, or all of it.

    Raises:
        InputError: numbers that are not real, or another shape.
    """
    if type(values) is np.ndarray and values.dtype is FLOAT and values.shape == shape and values.flags.carray:
        return values
    try:
        given = np.asarray(values)
        if given.dtype.kind == "O":  # fractions, or integers beyond those of NumPy
            given = np.array([cast_number(name, value) for value in given.flat]).reshape(given.shape)
    except Exception:  # noqa: BLE001 - a sequence with gaps, or an object whose own code fails
        given = np.array(None)
    fits = shape is None or (
        given.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, given.shape, strict=True))
    )
    if not fits or given.dtype.kind not in REAL_KINDS:
        wanted = "" if shape is None else f" of shape {shape}".replace("None", "k")
        got = f"shape {given.shape}" if given.dtype.kind in REAL_KINDS else f"one of type {_kind(values)}"
        raise InputError(f"{name} must be an array of real numbers{wanted}, got {got}")
    with np.errstate(over="ignore"):
        return np.require(given, FLOAT, ["C", "A"])


def _kind(value: Any) -> str:
    return f"array of {value.dtype}" if isinstance(value, np.ndarray) else type(value).__name__


def machine_code(kernel: Kernel, *example: Any) -> Any:
    """The compiled code for arguments of the example's types, without the look-up by type of each call.

    It checks nothing: pass it arrays of the example's dimensions alone, see `cast_array`.

    Args:
        kernel: is called once, so that it compiles now.
        example: arguments that change nothing.
    """
    kernel(*example)
    return compiled_for(kernel, example)
