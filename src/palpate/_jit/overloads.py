"""How Numba reads and writes parts: operators, methods and properties are the class's own, as it is written.

To name each of a hundred numbers in a kernel costs the compiler as much as the law that they are for: a part whose
numbers lie one behind the other in an array is read and written whole.
"""

from __future__ import annotations

import functools
import inspect
import operator
from collections.abc import Callable, Iterator
from itertools import repeat
from typing import Any, get_type_hints

from palpate._jit.cache import parts, stored
from palpate._jit.inline_compiler import inside
from palpate._vector import (
    METHODS,
    Vec3,
    angular,
    atan2,
    clip,
    cos,
    exp,
    linear,
    outer,
    sign,
    sin,
    sqrt,
    trace,
    widen,
)


@functools.cache
def operators_and_members() -> None:
    """Tells Numba, once, how to ask a part for its operators, methods and properties."""
    _operators()
    _members()


def _is_part(kind: Any) -> bool:
    return getattr(kind, "instance_class", None) in parts


def _method(kind: Any, name: str) -> Any:
    return getattr(kind.instance_class, name, None) if _is_part(kind) else None


def _overload(function: Any) -> Callable[[Callable[..., Any]], Any]:
    """Numba's decorator for what a function means, given the types of its arguments."""
    from numba.extending import overload

    return overload(function, strict=False, jit_options=inside())


def _operators() -> None:
    """Overloads of the operators and of `_vector`'s functions: each is the class's own method."""
    for name in ("add", "sub", "mul", "truediv", "matmul"):
        _overload(getattr(operator, name))(_binary(name))
        _overload(getattr(operator, f"i{name}"))(_binary(name))  # a += b is a = a + b on values
    _overload_method_of_first(operator.neg, "__neg__", "a")
    _overload_method_of_first(abs, "__abs__", "a")
    for function, name in METHODS.items():
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
            swapped = register_jitable(**inside())(reflected)
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
    """Overloads of `_vector`'s functions for plain numbers."""
    import math

    from numba import types

    def numbers(function: Any, body: Callable[..., Any]) -> None:
        def typer(*args: Any) -> Any:
            return body if isinstance(args[0], types.Number) else None

        typer.__signature__ = inspect.signature(body)  # type: ignore[attr-defined]
        _overload(function)(typer)

    numbers(linear, lambda b: b)
    numbers(angular, lambda b: b)
    numbers(exp, lambda a: math.exp(a))
    numbers(sqrt, lambda a: math.sqrt(a))
    numbers(sin, lambda a: math.sin(a))
    numbers(cos, lambda a: math.cos(a))
    numbers(atan2, lambda y, x: math.atan2(y, x))
    numbers(sign, lambda a: float((a > 0.0) - (a < 0.0)))
    numbers(clip, lambda a, limit: min(max(a, -limit), limit))
    _widen()
    _array_functions()


def _array_functions() -> None:
    """Overloads of `_vector`'s functions for NumPy arrays."""
    import numpy as np
    from numba import types

    def arrays(function: Any, body: Callable[..., Any]) -> None:
        def typer(*args: Any) -> Any:
            return body if isinstance(args[0], types.Array) else None

        typer.__signature__ = inspect.signature(body)  # type: ignore[attr-defined]
        _overload(function)(typer)

    arrays(outer, lambda a, b: np.expand_dims(a, 1) * b)
    arrays(trace, lambda A: np.trace(A))
    arrays(exp, lambda a: np.exp(a))


def _widen() -> None:
    from numba import types

    vector = Vec3

    @_overload(widen)
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
                return types.BoundFunction(_bound_method(member), value)
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

    return numba.njit(**inside())(function)


@functools.cache
def _bound_method(method: Callable[..., Any]) -> Any:
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


_known: set[Callable[..., Any]] = set()
"""Those that Numba knows."""


def places(part: type, path: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """Names of every number of a part, from the outermost field in, in their order."""
    fields = get_type_hints(part) if part is not float else {}
    return [place for name, kind in fields.items() for place in places(kind, (*path, name))] or [path]


def leaves(tree: Any) -> Iterator[float]:
    """Every number of nested tuples, in their order."""
    for branch in tree:
        if isinstance(branch, tuple):
            yield from leaves(branch)
        else:
            yield float(branch)


def reader(part: type) -> Callable[[Any], Any]:
    """A law that makes a part, of numbers and parts of them, of an array that begins with its numbers."""

    def read(a: Any) -> Any:
        return _make_part(part, iter(a))

    stored[read] = part, True
    return read


def writer(part: type) -> Callable[[Any, Any], None]:
    """A law that puts a part's numbers at the beginning of an array."""

    def write(a: Any, value: Any) -> None:
        for i, number in enumerate(leaves(value)):
            a[i] = number

    stored[write] = part, False
    return write


def _make_part(part: type, numbers: Iterator[Any]) -> Any:
    kinds = get_type_hints(part).values()
    return part(*(float(next(numbers)) if kind is float else _make_part(kind, numbers) for kind in kinds))


def kind_of(part: type) -> Any:
    """Numba's type of a part of numbers and parts of them."""
    import numba

    return numba.typeof(_make_part(part, repeat(0.0)))


def hand_over() -> None:
    """Tells Numba what those registered since the last time do: a load, or a store, of the whole part."""
    from numba.extending import overload

    from palpate._jit.inline_compiler import inside

    for function in [one for one in stored if one not in _known]:
        part, reads = stored[function]
        _known.add(function)
        meaning = _reading(_load(kind_of(part))) if reads else _writing(_store(kind_of(part)))
        overload(function, strict=False, jit_options=inside())(meaning)


def _reading(load: Any) -> Callable[..., Any]:
    return lambda a: lambda a: load(a)  # noqa: ARG005 - Numba goes by the names


def _writing(store: Any) -> Callable[..., Any]:
    return lambda a, value: lambda a, value: store(a, value)  # noqa: ARG005 - likewise


def _load(kind: Any) -> Any:
    from numba.extending import intrinsic

    @intrinsic
    def load(typing: Any, a: Any) -> Any:
        def lowered(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.load(_place(context, builder, signature, args, kind), align=8)

        return (kind(a), lowered) if _is_plain(a) else None

    return load


def _store(kind: Any) -> Any:
    from numba import types
    from numba.extending import intrinsic

    @intrinsic
    def store(typing: Any, a: Any, value: Any) -> Any:
        def lowered(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            builder.store(args[1], _place(context, builder, signature, args, kind), align=8)
            return context.get_dummy_value()

        return (types.void(a, kind), lowered) if _is_plain(a) else None

    return store


def _is_plain(kind: Any) -> bool:
    """An array of numbers that lie one behind the other."""
    from numba import types

    return isinstance(kind, types.Array) and kind.layout == "C" and kind.dtype == types.float64


def _place(context: Any, builder: Any, signature: Any, args: Any, kind: Any) -> Any:
    """The array's memory as that of the part."""
    data = context.make_array(signature.args[0])(context, builder, args[0]).data
    return builder.bitcast(data, context.get_value_type(kind).as_pointer())
