"""Types that Numba infers for laws, and which function of Python it compiles for a call: for whoever reads laws too."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any


class TypingRules:
    """Numba's inference on laws and parts, as kernels have it."""

    def __init__(self) -> None:
        from numba.core.registry import cpu_target

        from palpate._jit.inline_compiler import _flags
        from palpate._jit.kernels import _hand_over

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
