"""Kernels: from the cache where it has them, and else compiled when first called; or why they cannot be compiled."""

from __future__ import annotations

import functools
import gc
import importlib
import re
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

from palpate._jit.cache import (
    PACKAGE,
    CompileLock,
    hashed_files,
    home_of,
    laws,
    sources_stamp,
    stamp_of,
    text_of,
)
from palpate._jit.inline_compiler import ENTRY, entry, inside
from palpate._jit.overloads import hand_over, operators_and_members

_Call = tuple[int, FrameType | None]


@contextmanager
def interrupts_later() -> Iterator[None]:
    """Keep a Ctrl-C back until the block is done, then hand it to who would have had it.

    Numba makes a kernel's result by calling the classes of its NamedTuples, where Python would raise KeyboardInterrupt;
    Numba does not look whether they raised, and the process ends with a segmentation fault.
    """
    if threading.current_thread() is not threading.main_thread():  # no signal gets here
        yield
        return
    held: list[_Call] = []
    before = signal.signal(signal.SIGINT, lambda *call: held.append(call))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
    if held and callable(before):
        before(*held[-1])


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

    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        from palpate.errors import InputError

        raise InputError("NUMBA_DISABLE_JIT is set, and palpate's laws run compiled alone; unset it")
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


def compiled_for(kernel: Kernel, example: tuple[Any, ...]) -> Any:
    """Machine code of a kernel that was called with such arguments."""
    import numba

    return kernel.compiled.overloads[tuple(map(numba.typeof, example))].entry_point


class BoundKernel:
    """Calls a kernel; from the second call on straight at its machine code, a call costing a third or less.

    Arguments of other types or dimensions than those of the first call take the way of every kernel, and compile.

    Args:
        kernel: what is called.
    """

    def __init__(self, kernel: Kernel):
        self._kernel, self._entry = kernel, None
        self._forms: tuple[Any, ...] = ()

    def __call__(self, *args: Any) -> Any:
        forms = tuple(map(_form, args))
        if forms == self._forms:
            return self._entry(*args)  # type: ignore[misc]
        result = self._kernel(*args)
        if self._entry is None:
            self._entry, self._forms = compiled_for(self._kernel, args), forms
        return result


def _form(value: Any) -> Any:
    """Type of an argument as far as machine code depends on it, without what a part holds."""
    if hasattr(value, "dtype"):
        return value.ndim, value.dtype, value.flags.carray
    return type(value)


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


class TypingRules:
    """Numba's inference on laws and parts, as kernels have it."""

    def __init__(self) -> None:
        from numba.core.registry import cpu_target

        from palpate._jit.inline_compiler import _flags

        _hand_over()
        self.context = cpu_target.typing_context
        cpu_target.target_context.refresh()
        self.context.refresh()
        self._shared = _flags()[0]

    def result(self, function: Callable[..., Any], kinds: tuple[Any, ...]) -> Any:
        """The type of what a law or a method returns, given arguments of such types."""
        from palpate._jit.overloads import _compiled_member

        return self._within(
            lambda: _compiled_member(function).get_call_type(self.context, kinds, {}).return_type
        )

    def implementation(self, callee: Any, kinds: tuple[Any, ...]) -> Callable[..., Any] | None:
        """The function that stands for a call of `callee` with such types; None if there is none."""
        from numba.core.errors import TypingError

        def find() -> Callable[..., Any] | None:
            for template in getattr(self.context.resolve_value_type(callee), "templates", ()):
                dispatcher = None
                with suppress(AttributeError, TypingError):  # it is no overload, or one for other types
                    dispatcher, _ = template(self.context)._get_impl(kinds, {})
                if dispatcher is not None:
                    function: Callable[..., Any] = dispatcher.py_func
                    return function
            return None

        return self._within(find)

    def signature(self, callee: Any, kinds: tuple[Any, ...]) -> Any:
        """The types that a call on numbers casts its arguments to, and that of its value."""
        kind = self.context.resolve_value_type(callee)
        return self._within(lambda: self.context.resolve_function_type(kind, kinds, {}))

    def _within(self, ask: Callable[[], Any]) -> Any:
        """Asks as a law would that a kernel calls, so that nothing is compiled twice."""
        from numba.core.targetconfig import ConfigStack

        with ConfigStack().enter(self._shared):
            return ask()
