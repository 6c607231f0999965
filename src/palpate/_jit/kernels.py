"""Kernels: from the cache where it has them, and else compiled when first called."""

import functools
import gc
import importlib
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import Any

from palpate._jit.cache_files import hashed_files
from palpate._jit.compile_lock import CompileLock
from palpate._jit.inline_compiler import entry, inside
from palpate._jit.interrupts import interrupts_later
from palpate._jit.overloads import operators_and_members
from palpate._jit.registry import laws
from palpate._jit.stamp import home_of, sources_stamp, stamp_of, text_of
from palpate._jit.stored import hand_over

_MAKING = threading.Lock()


class NotCompiled(Exception):
    """Numba could not compile a kernel; the cause has its own account of it, which is long."""


class Kernel:
    """A function that runs compiled; `plain` is the same function as it was written."""

    def __init__(self, function: Callable[..., Any]):
        self.plain = function
        self._waiting: Callable[[], None] | None = None
        self._dispatcher: Any = None
        functools.update_wrapper(self, function)

    @property
    def compiled(self) -> Any:
        """The Numba dispatcher, made when first asked for; by one thread, or each would compile its own."""
        with _MAKING:
            if self._dispatcher is None:
                self._dispatcher = _dispatcher(self.plain, self._wait)
        return self._dispatcher

    def __call__(self, *args: Any) -> Any:
        collects = gc.isenabled()
        with interrupts_later():
            try:
                return self.compiled(*args)
            except Exception as error:
                if type(error).__module__.startswith("numba."):
                    raise NotCompiled(error) from error
                raise
            finally:
                if collects:
                    gc.enable()

    def run(self, waiting: Callable[[], None] | None, *args: Any) -> Any:
        """Calls the kernel; calls `waiting` before, if it has to be compiled, which takes seconds."""
        self._waiting = waiting
        try:
            return self(*args)
        finally:
            self._waiting = None

    def _wait(self) -> None:
        """Called before it is compiled, while millions of small objects live and none of them is garbage."""
        gc.disable()
        if self._waiting is not None:
            self._waiting()

    @property
    def from_cache(self) -> bool:
        """Whether every compiled version so far came out of the cache."""
        return not self.compiled.stats.cache_misses


def kernel(function: Callable[..., Any]) -> Kernel:
    """Marks the entry of a compiled loop."""
    return Kernel(function)


def _dispatcher(function: Callable[..., Any], wait: Callable[[], None]) -> Any:
    import numba

    dispatcher, lock = numba.njit(**entry())(function), CompileLock(home_of(function))
    compiling = dispatcher._compiler.compile

    def compiled(*words: Any) -> Any:
        try:
            return compiling(*words)
        except BaseException:
            lock.release()
            raise

    dispatcher._compiler.compile = compiled
    try:
        dispatcher._cache = _cache(function, wait, lock)
    except RuntimeError:  # nowhere to write: every process compiles anew
        _hand_over()
    return dispatcher


def _cache(function: Callable[..., Any], wait: Callable[[], None], lock: CompileLock) -> Any:
    """Numba's cache of one kernel, its entries stamped by what they depend on, one process at a time adding to it."""
    from numba.core import caching
    from numba.core.runtime import rtsys

    class PackageCache(caching.FunctionCache):
        def __init__(self, py_func: Callable[..., Any]):
            super().__init__(py_func)
            stamp = sources_stamp(home_of(py_func))
            self._cache_file = hashed_files()(self._cache_path, self._impl.filename_base, stamp)

        def _index_key(self, sig: Any, codegen: Any) -> Any:
            # The types as text: an index that holds a user's class cannot be read where that class is not.
            _, *machine_and_code = super()._index_key(sig, codegen)
            return (text_of(sig), *machine_and_code, stamp_of(function, sig))

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            # Without what Numba imports to compile, which takes as long again as importing Numba.
            rtsys.initialize(target_context)
            return self._kept(sig, target_context) or self._waited_for(sig, target_context)

        def _waited_for(self, sig: Any, target_context: Any) -> Any:
            """The kernel that another process has compiled; None, with the lock held, to compile it here."""
            wait()
            lock.wait()
            with ExitStack() as undone:
                undone.callback(lock.release)
                found = self._kept(sig, target_context)
                if found is None:
                    target_context.refresh()
                    _hand_over()
                    undone.pop_all()
            return found

        def _kept(self, sig: Any, target_context: Any) -> Any:
            if stamp_of(function, sig) is None:
                return None
            # Those errors where another version of these sources has written it.
            with suppress(ImportError, AttributeError), self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)
            return None

        def save_overload(self, sig: Any, data: Any) -> None:
            try:
                if stamp_of(function, sig) is not None:
                    with suppress(OSError):  # where there is no room, every process compiles anew
                        super().save_overload(sig, data)
            finally:
                lock.release()

    return PackageCache(function)


def _hand_over() -> None:
    """Gives Numba the laws registered since the last time, and once and for all the way to ask parts."""
    operators_and_members()
    hand_over()
    while laws:
        importlib.import_module("numba.extending").register_jitable(**inside())(laws.pop())
