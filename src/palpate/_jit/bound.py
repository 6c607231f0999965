"""A kernel that is called again and again with arguments of the same types: they are looked up once."""

from __future__ import annotations

from typing import Any

from palpate._jit.kernels import Kernel


class BoundKernel:
    """Calls a kernel; from the second call on straight at its machine code, a call costing a third or less.

    Args:
        kernel: what is called; the types of its arguments are those of the first call for ever.
    """

    def __init__(self, kernel: Kernel):
        self._kernel, self._entry = kernel, None

    def __call__(self, *args: Any) -> Any:
        if self._entry is not None:
            return self._entry(*args)
        import numba

        types = tuple(map(numba.typeof, args))
        result = self._kernel(*args)
        self._entry = self._kernel.compiled.overloads[types].entry_point
        return result
