"""How Numba compiles what only kernels call: to be put where it is called, and no further.

Left to itself it optimises every function for good and makes machine code of it, although only the kernel that swallows
it ever runs. Without that a kernel compiles in four fifths of the time, and is the same.
"""

from __future__ import annotations

import functools
from typing import Any

from palpate._jit.registry import INSIDE


@functools.cache
def inside() -> dict[str, Any]:
    """Numba's options for a function that only kernels call."""
    return {**INSIDE, "pipeline_class": _compiler()}


def _compiler() -> type:
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import Compiler

    class Unloaded:
        """The code generator, but that it looks for no environment of a function that is nowhere in memory."""

        def __init__(self, codegen: Any):
            self._codegen = codegen

        def __getattr__(self, name: str) -> Any:
            return getattr(self._codegen, name)

        def set_env(self, name: str, environment: Any) -> None:
            pass

    class Swallowed(JITCodeLibrary):
        """Code that is linked into other code, and never loaded itself."""

        @property
        def codegen(self) -> Any:
            return Unloaded(self._codegen)

        def _optimize_final_module(self) -> None:
            pass

        def _finalize_final_module(self) -> None:
            self._finalize_dynamic_globals()
            self._finalized = True

        def get_pointer_to_function(self, name: str) -> int:
            return 0

    class Inside(Compiler):
        """Numba's compiler, its result such code."""

        def __init__(self, typing: Any, target: Any, library: Any, *others: Any):
            super().__init__(typing, target, library or Swallowed(target.codegen(), "inside"), *others)

    return Inside
