"""The bridge to Numba: laws and parts, written once in plain Python, compiled when a kernel is first needed.

`law` and `part` only register. The first call of a `kernel` imports Numba and loads the kernel from the
cache; only where the cache has none does it hand Numba every law as it stands and every part's own methods as
overloads, and compile.
"""

import functools
import hashlib
import importlib
import inspect
import operator
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from palpate import _vector

F = TypeVar("F", bound=Callable[..., Any])
C = TypeVar("C", bound=type)

_laws: list[Callable[..., Any]] = []
_foreign_laws: list[Callable[..., Any]] = []
_parts: dict[type, None] = {}
_PACKAGE = Path(__file__).resolve().parent
# Division as NumPy's: no branch and no exception inside a loop.
_OPTIONS = {"error_model": "numpy", "nogil": True}
# What only kernels call needs no way in from outside: making those would be half of all compiling.
_INSIDE = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def law(function: F) -> F:
    """Marks a plain function as usable inside kernels. It stays a plain function."""
    _laws.append(function)
    if _PACKAGE not in Path(function.__code__.co_filename).parents:
        _foreign_laws.append(function)
    return function


def part(cls: C) -> C:
    """Marks a NamedTuple whose methods are usable inside kernels. It stays a plain class."""
    _parts[cls] = None
    return cls


part(_vector.Vec3)
part(_vector.Mat3)


class Kernel:
    """A function that runs compiled; `plain` is the same function as it was written."""

    def __init__(self, function: Callable[..., Any]):
        self.plain = function
        self._waiting: Callable[[], None] | None = None
        functools.update_wrapper(self, function)

    @functools.cached_property
    def compiled(self) -> Any:
        """The Numba dispatcher, made when first asked for."""
        return _dispatcher(self.plain, self._wait)

    def __call__(self, *args: Any) -> Any:
        return self.compiled(*args)

    def run(self, waiting: Callable[[], None] | None, *args: Any) -> Any:
        """Calls the kernel; calls `waiting` before, if it has to be compiled, which takes seconds."""
        self._waiting = waiting
        try:
            return self.compiled(*args)
        finally:
            self._waiting = None

    def _wait(self) -> None:
        if self._waiting is not None:
            self._waiting()

    @property
    def from_cache(self) -> bool:
        """Whether every compiled version so far came out of the cache."""
        return not self.compiled.stats.cache_misses


def kernel(function: Callable[..., Any]) -> Kernel:
    """Marks the entry of a compiled loop."""
    return Kernel(function)


_IMPORT = re.compile(r"^\s*from (palpate[\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


def sources_stamp(*files: Path) -> str:
    """A hash of these files and of all of the package's that they import, directly or not.

    A kernel is stale when any file that it may call has changed, which Numba, left alone, does not see.
    """
    reached: dict[Path, bytes] = {}
    waiting = [f.resolve() for f in files]
    while waiting:
        file = waiting.pop()
        if file not in reached and file.exists():
            reached[file] = file.read_bytes()
            waiting.extend(_imported(reached[file].decode("utf-8", "replace")))
    digest = hashlib.sha256()
    for file in sorted(reached):
        digest.update(str(file).encode() + b"\0" + reached[file])
    return digest.hexdigest()


def _imported(text: str) -> list[Path]:
    """The package's files that a source imports names from, or as modules."""
    root = _PACKAGE.parent
    found = []
    for module, names in _IMPORT.findall(text):
        place = root.joinpath(*module.split("."))
        modules = [place, *(place / name.split(" as ")[0].strip(" ()\n\t") for name in names.split(","))]
        for m in modules:
            found += [p for p in (m.with_suffix(".py"), m / "__init__.py") if m.name and p.is_file()]
    return found


def _stamp_of(function: Callable[..., Any], types_of_arguments: tuple[Any, ...]) -> str | None:
    """A hash of all that a kernel given such arguments may depend on; None where it cannot be kept.

    A kernel of the package that is given only the package's parts depends on its own file, theirs, and what those
    import. With something of the user's among them it may call any law and part registered from outside. Without a
    file there is nothing to ask; and a class of a script is another class the next time that the script runs.
    """
    classes = set(_classes(types_of_arguments))
    if any(cls.__module__ == "__main__" for cls in classes):
        return None
    things = {function, *classes}
    if any(_PACKAGE not in _home_of(x).parents for x in things):
        things |= {*_foreign_laws, *_parts}
    files = {_home_of(x) for x in things}
    return sources_stamp(*files) if all(f.is_file() for f in files) else None


def _home_of(thing: Any) -> Path:
    """The file that defines a function or a class."""
    return Path(getattr(sys.modules.get(thing.__module__), "__file__", None) or "nowhere").resolve()


def _classes(numba_types: Any) -> Any:
    for kind in numba_types:
        cls = getattr(kind, "instance_class", None)
        if cls is not None and cls in _parts:
            yield cls
        members = getattr(kind, "types", None)
        if members is not None:
            yield from _classes(members)


def _text_of(numba_types: Any) -> str:
    classes = (f"{cls.__module__}.{cls.__qualname__}" for cls in _classes(numba_types))
    return "; ".join([*map(str, numba_types), *classes])


def _dispatcher(function: Callable[..., Any], wait: Callable[[], None]) -> Any:
    import numba
    from numba.core import caching

    class PackageCache(caching.FunctionCache):
        def __init__(self, py_func: Callable[..., Any]):
            super().__init__(py_func)
            self._cache_file._source_stamp = sources_stamp(_home_of(py_func))

        def _index_key(self, sig: Any, codegen: Any) -> Any:
            # The types as text: an index that holds a user's class cannot be read where that class is not.
            _, *machine_and_code = super()._index_key(sig, codegen)
            return (_text_of(sig), *machine_and_code, _stamp_of(function, sig))

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            known = _stamp_of(function, sig) is not None
            found = super().load_overload(sig, target_context) if known else None
            if found is None:
                wait()
                _hand_over()
            return found

        def save_overload(self, sig: Any, data: Any) -> None:
            if _stamp_of(function, sig) is not None:
                super().save_overload(sig, data)

    dispatcher = numba.njit(**_OPTIONS)(function)
    try:
        dispatcher._cache = PackageCache(function)
    except RuntimeError:  # nowhere to write: every process compiles anew
        _hand_over()
    return dispatcher


def _hand_over() -> None:
    """Gives Numba the laws registered since the last time, and once and for all the way to ask parts."""
    _operators_and_members()
    while _laws:
        importlib.import_module("numba.extending").register_jitable(**_INSIDE)(_laws.pop())


@functools.cache
def _operators_and_members() -> None:
    _operators()
    _members()


def _is_part(kind: Any) -> bool:
    return getattr(kind, "instance_class", None) in _parts


def _method(kind: Any, name: str) -> Any:
    return getattr(kind.instance_class, name, None) if _is_part(kind) else None


def _overload(function: Any) -> Callable[[Callable[..., Any]], Any]:
    """Numba's decorator for what a function means, given the types of its arguments."""
    from numba.extending import overload

    return overload(function, strict=False, jit_options=_INSIDE)


def _operators() -> None:
    """Overloads of the operators and of `_vector`'s functions: each is the class's own method."""
    for name in ("add", "sub", "mul", "truediv", "matmul"):
        _overload(getattr(operator, name))(_binary(name))
        _overload(getattr(operator, f"i{name}"))(_binary(name))  # a += b is a = a + b on values
    _overload_method_of_first(operator.neg, "__neg__", "a")
    _overload_method_of_first(abs, "__abs__", "a")
    for function, name in _vector.METHODS.items():
        _overload_method_of_first(function, name, *inspect.signature(function).parameters)
    _scalar_functions()


def _binary(name: str) -> Callable[..., Any]:
    def typer(a: Any, b: Any) -> Any:
        from numba import types
        from numba.extending import register_jitable

        if _method(a, f"__{name}__"):
            return _method(a, f"__{name}__")
        reflected = _method(b, f"__r{name}__")
        if reflected and isinstance(a, types.Number):
            swapped = register_jitable(**_INSIDE)(reflected)
            return lambda a, b: swapped(b, a)
        return None

    return typer


def _overload_method_of_first(function: Any, name: str, *names: str) -> None:
    """Overloads a function with the method `name` of its first argument's class."""

    def typer(*args: Any) -> Any:
        return _method(args[0], name)

    # Numba calls a typer by its signature; a bare *args would be folded into one tuple.
    typer.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [inspect.Parameter(n, inspect.Parameter.POSITIONAL_OR_KEYWORD) for n in names]
    )
    _overload(function)(typer)


def _scalar_functions() -> None:
    """What `_vector`'s functions mean on plain numbers."""
    import math

    from numba import types

    def numbers(function: Any, body: Callable[..., Any]) -> None:
        def typer(*args: Any) -> Any:
            return body if isinstance(args[0], types.Number) else None

        typer.__signature__ = inspect.signature(body)  # type: ignore[attr-defined]
        _overload(function)(typer)

    numbers(_vector.exp, lambda a: math.exp(a))
    numbers(_vector.sqrt, lambda a: math.sqrt(a))
    numbers(_vector.sin, lambda a: math.sin(a))
    numbers(_vector.cos, lambda a: math.cos(a))
    numbers(_vector.atan2, lambda y, x: math.atan2(y, x))
    numbers(_vector.sign, lambda a: float((a > 0.0) - (a < 0.0)))
    numbers(_vector.clip, lambda a, limit: min(max(a, -limit), limit))
    _widen()
    _array_functions()


def _array_functions() -> None:
    """What `_vector`'s functions mean on NumPy arrays."""
    import numpy as np
    from numba import types

    def arrays(function: Any, body: Callable[..., Any]) -> None:
        def typer(*args: Any) -> Any:
            return body if isinstance(args[0], types.Array) else None

        typer.__signature__ = inspect.signature(body)  # type: ignore[attr-defined]
        _overload(function)(typer)

    arrays(_vector.outer, lambda a, b: np.expand_dims(a, 1) * b)
    arrays(_vector.trace, lambda A: np.trace(A))
    arrays(_vector.exp, lambda a: np.exp(a))


def _widen() -> None:
    from numba import types

    vector = _vector.Vec3

    @_overload(_vector.widen)
    def typer(b: Any) -> Any:
        if _is_part(b):
            return lambda b: b
        if isinstance(b, types.Number):
            return lambda b: vector(b, b, b)
        return None


def _members() -> None:
    """Methods and properties of parts, each looked up in the class that it is called on.

    Not `overload_method`: that has one Python signature for a name, whatever the class.
    """
    from numba.core import types
    from numba.core.typing.templates import AttributeTemplate
    from numba.extending import infer_getattr

    @infer_getattr
    class Members(AttributeTemplate):  # type: ignore[misc]
        key = types.BaseNamedTuple

        def generic_resolve(self, value: Any, attr: str) -> Any:
            member = _method(value, attr)
            if inspect.isfunction(member):
                return types.BoundFunction(_bound(member), value)
            if isinstance(member, property):
                _lower_property(attr)
                return _compiled_member(member.fget).get_call_type(self.context, (value,), {}).return_type
            return None


def _compiled_member(function: Callable[..., Any]) -> Any:
    """The Numba type of a method that is compiled as a function of its own."""
    import numba

    return numba.types.Dispatcher(_member_dispatcher(function))


@functools.cache  # the type holds it by a weak reference only
def _member_dispatcher(function: Callable[..., Any]) -> Any:
    import numba

    return numba.njit(**_OPTIONS, **_INSIDE)(function)


@functools.cache
def _bound(method: Callable[..., Any]) -> Any:
    """How Numba types and lowers a call of the method on an object."""
    from numba.core import types
    from numba.core.typing.templates import AbstractTemplate
    from numba.extending import lower_builtin

    compiled = _compiled_member(method)

    class Call(AbstractTemplate):  # type: ignore[misc]
        key = method

        def generic(self, args: Any, kws: Any) -> Any:
            signature = compiled.get_call_type(self.context, (self.this, *args), kws)
            return signature and signature.as_method()

    @lower_builtin(method, types.BaseNamedTuple, types.VarArg(types.Any))
    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _call(compiled, context, builder, signature, args)

    return Call


@functools.cache
def _lower_property(name: str) -> None:
    """How Numba reads an attribute that is a property of one part, and perhaps a field of another."""
    from numba.core import types
    from numba.core.imputils import impl_ret_borrowed
    from numba.extending import lower_getattr

    @lower_getattr(types.BaseNamedTuple, name)
    def lower(context: Any, builder: Any, kind: Any, value: Any) -> Any:
        if name in kind.fields:
            index = kind.fields.index(name)
            return impl_ret_borrowed(context, builder, kind[index], builder.extract_value(value, index))
        compiled = _compiled_member(_method(kind, name).fget)
        signature = compiled.get_call_type(context.typing_context, (kind,), {})
        return _call(compiled, context, builder, signature, (value,))


def _call(compiled: Any, context: Any, builder: Any, signature: Any, args: Any) -> Any:
    call = context.get_function(compiled, signature)
    context.add_linking_libs(getattr(call, "libs", ()))
    return call(builder, args)
