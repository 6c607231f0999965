"""The bridge to Numba: laws and parts, written once in plain Python, compiled when a kernel is first needed.

`law` and `part` only register. The first call of a `kernel` imports Numba and loads the kernel from the
cache; only where the cache has none does it hand Numba every law as it stands and every part's own methods as
overloads, and compile.
"""

from palpate._jit.cache import law, part, sources_stamp
from palpate._jit.kernels import BoundKernel, Kernel, NotCompiled, kernel
from palpate._jit.overloads import reader, writer

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
