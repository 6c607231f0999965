"""Registry of laws and parts to compile. Nothing is compiled here, and Numba is not imported."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from palpate._vector import Mat3, Vec3, Vec6

F = TypeVar("F", bound=Callable[..., Any])
C = TypeVar("C", bound=type)

laws: list[Callable[..., Any]] = []
foreign_laws: list[Callable[..., Any]] = []
parts: dict[type, None] = {}
stored: dict[Callable[..., Any], tuple[type, bool]] = {}
"""Functions that read (true), or write, a part's numbers in an array: `palpate._jit.overloads`."""
foreign_files: set[Path] = set()
"""Sources of the user's plug-ins, and what they import from beside them."""
PACKAGE = Path(__file__).resolve().parent.parent
# Division as NumPy's: no branch and no exception inside a loop.
ENTRY = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
# What only kernels call needs no way in from outside: making those would be half of all compiling. And it stands where
# it is called: handing a loop's hundred numbers on, and a state's back, costs as much as what is done with them.
INSIDE = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": True}


def law(function: F) -> F:
    """Marks a plain function as usable inside kernels. It stays a plain function."""
    laws.append(function)
    if PACKAGE not in Path(function.__code__.co_filename).parents:
        foreign_laws.append(function)
    return function


def part(cls: C) -> C:
    """Marks a NamedTuple whose methods are usable inside kernels. It stays a plain class."""
    parts[cls] = None
    return cls


part(Vec3)
part(Mat3)
part(Vec6)
