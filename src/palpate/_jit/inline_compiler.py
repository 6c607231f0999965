"""How Numba compiles what only kernels call: to be put where it is called, and no further.

Left to itself it optimises every function for good and makes machine code of it, although only the kernel that swallows
it ever runs. And it makes passes over each that look for what no law has: closures, context managers, literals to
unroll. Without all that a kernel compiles in two thirds of the time, and is the same (benchmarks/cold_start.py).
"""

from __future__ import annotations

import functools
from types import CodeType
from typing import Any

from palpate._jit.cache import PACKAGE

# Division as NumPy's: no branch and no exception inside a loop.
ENTRY = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
# What only kernels call needs no way in from outside: making those would be half of all compiling. And it stands where
# it is called: handing a loop's hundred numbers on, and a state's back, costs as much as what is done with them.
INSIDE = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": True}


@functools.cache
def inside() -> dict[str, Any]:
    """Numba's options for a function that only kernels call."""
    return {**INSIDE, "pipeline_class": _inside_compiler()}


@functools.cache
def entry() -> dict[str, Any]:
    """Numba's options for a kernel."""
    return {**ENTRY, "pipeline_class": _entry_compiler()}


@functools.cache
def _flags() -> tuple[Any, type]:
    """The flags of everything inside, and the kind of a kernel's.

    Numba keeps what it has compiled by the flags of the caller, so all callers show the same ones: or a law is compiled
    once for the kernel and once more for the laws that call it. And it asks for their hash at each call.
    """
    from numba.core.compiler import Flags
    from numba.core.registry import cpu_target

    class InsideFlags(Flags):
        """One object for all."""

        __hash__ = object.__hash__
        __eq__ = object.__eq__

        def copy(self) -> Any:
            return self

    class Entered(Flags):
        """Those of a kernel, which shows the others to what it calls."""

        def copy(self) -> Any:
            return shared

    shared = InsideFlags()
    cpu_target.options.parse_as_flags(shared, {**INSIDE, "nopython": True})
    return shared, Entered


def _link_below(library: Any, module: Any) -> None:
    """Links into a library's module all that it calls, directly or not, each once.

    A function comes after its caller: LLVM omits functions that are not requested.
    """
    order: dict[Any, None] = {}

    def visit(one: Any) -> None:
        for below in one._linking_libraries:
            if below not in order:
                order[below] = None
                if isinstance(below, _linked_library_type()):
                    visit(below)

    visit(library)
    for below in order:
        library._reload_init.update(below._reload_init)
        alone = below.alone if isinstance(below, _linked_library_type()) else below._get_module_for_linking()
        module.link_in(alone, preserve=True)


def _entry_compiler() -> type:
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import Compiler

    class EntryLibrary(JITCodeLibrary):
        """Code that takes in each function that it calls once, and runs."""

        def finalize(self) -> None:
            _link_below(self, self._final_module)
            self._linking_libraries = []
            super().finalize()

    class SameFlagsCompiler(Compiler):
        """Numba's compiler, but that what is called sees the flags of everything inside."""

        def __init__(
            self, typing: Any, target: Any, library: Any, args: Any, result: Any, flags: Any, *more: Any
        ):
            library = EntryLibrary(target.codegen(), "kernel")
            library.enable_object_caching()
            super().__init__(typing, target, library, args, result, _flags()[1](flags), *more)

    return SameFlagsCompiler


class _Unloaded:
    """The code generator, but that it looks for no environment of a function that is nowhere in memory."""

    def __init__(self, codegen: Any):
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        pass


@functools.cache
def _linked_library_type() -> type:
    """Code that is linked into other code, and never loaded itself."""
    from numba.core.codegen import JITCodeLibrary

    class Swallowed(JITCodeLibrary):
        """Code that is linked into other code, and never loaded itself."""

        @property
        def codegen(self) -> Any:
            return _Unloaded(self._codegen)

        def finalize(self) -> None:
            """Nothing is linked in: the kernel takes in each function once, and not once for each that calls it."""
            self._raise_if_finalized()
            self._finalize_dynamic_globals()
            self._finalized = True

        @property
        def alone(self) -> Any:
            """The module without what it calls."""
            return super()._get_module_for_linking()

        def _get_module_for_linking(self) -> Any:
            """The module with all that it calls, for code that is no kernel of ours."""
            whole = self.alone.clone()
            _link_below(self, whole)
            return whole

        def get_pointer_to_function(self, name: str) -> int:
            return 0

    return Swallowed


def _inside_compiler() -> type:
    from numba.core.compiler import Compiler

    swallowed = _linked_library_type()

    class InsideCompiler(Compiler):
        """Numba's compiler, its result such code."""

        def __init__(
            self, typing: Any, target: Any, library: Any, args: Any, result: Any, _: Any, *more: Any
        ):
            library = library or swallowed(target.codegen(), "inside")
            super().__init__(typing, target, library, args, result, _flags()[0], *more)

        def define_pipelines(self) -> list[Any]:
            own = _is_plain(self.state.func_id.code)
            return [_short_pipeline()] if own else super().define_pipelines()

    return InsideCompiler


def _is_plain(code: CodeType) -> bool:
    """Whether it is the package's own, and holds no function of its own: a user's may need every pass."""
    return code.co_filename.startswith(str(PACKAGE)) and not any(
        isinstance(c, CodeType) for c in code.co_consts
    )


def _short_pipeline() -> Any:
    """The passes that a law needs: each of them costs some milliseconds, and a loop is made of some 250 functions."""
    from numba.core import typed_passes as typed
    from numba.core import untyped_passes as untyped
    from numba.core.compiler_machinery import PassManager

    manager = PassManager("inside")
    for one in (
        untyped.TranslateByteCode,
        untyped.FixupArgs,
        untyped.IRProcessing,
        untyped.RewriteSemanticConstants,
        untyped.DeadBranchPrune,
        untyped.GenericRewrites,
        untyped.ReconstructSSA,
        typed.NopythonTypeInference,
        typed.PreLowerStripPhis,
        typed.NopythonRewrites,
        typed.IRLegalization,
        _native_lowering(),
        typed.NoPythonBackend,
    ):
        manager.add_pass(one, one.__name__)
    manager.finalize()
    return manager


@functools.cache
def _native_lowering() -> type:
    """Numba's lowering, but that it counts references only of what has any: numbers have none."""
    from numba.core import typed_passes
    from numba.core.compiler_machinery import register_pass
    from numba.core.lowering import Lower

    class Counting(Lower):
        """Lowers a function; values without an array in them are passed over at once."""

        def incref(self, typ: Any, val: Any) -> None:
            if _counted(self.context, typ):
                super().incref(typ, val)

        def decref(self, typ: Any, val: Any) -> None:
            if _counted(self.context, typ):
                super().decref(typ, val)

    @register_pass(mutates_CFG=True, analysis_only=False)
    class CountingLowering(typed_passes.BaseNativeLowering):
        _name = "inside_lowering"

        @property
        def lowering_class(self) -> type:
            return Counting

    return CountingLowering


@functools.cache
def _counted(context: Any, kind: Any) -> bool:
    return context.data_model_manager[kind].contains_nrt_meminfo()
