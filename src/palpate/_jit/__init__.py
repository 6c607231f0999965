"""The bridge to Numba: laws and parts, written once in plain Python, compiled when a kernel is first needed.

`law` and `part` only register. The first call of a `kernel` imports Numba and loads the kernel from the
cache; only where the cache has none does it hand Numba every law as it stands and every part's own methods as
overloads, and compile.
"""

from palpate._jit.bound import BoundKernel
from palpate._jit.kernels import Kernel, NotCompiled, kernel
from palpate._jit.registry import law, part
from palpate._jit.stamp import sources_stamp
from palpate._jit.stored import reader, writer

__all__ = [
    "BoundKernel",
    "Kernel",
    "NotCompiled",
    "kernel",
    "law",
    "part",
    "reader",
    "sources_stamp",
    "writer",
]
