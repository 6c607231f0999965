"""How Numba reads operators, methods and properties of parts: each is the class's own, as it is written."""

import functools
import inspect
import operator
from collections.abc import Callable
from typing import Any

from palpate import _vector
from palpate._jit.inline_compiler import inside
from palpate._jit.registry import parts


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

    numbers(_vector.linear, lambda b: b)
    numbers(_vector.angular, lambda b: b)
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
    """Overloads of `_vector`'s functions for NumPy arrays."""
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
