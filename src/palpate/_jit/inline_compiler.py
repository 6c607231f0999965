"""How Numba compiles what only kernels call: to be put where it is called, and no further.

Left to itself it optimises every function for good and makes machine code of it, although only the kernel that swallows
it ever runs. And it makes passes over each that look for what no law has: closures, context managers, literals to
unroll. Without all that a kernel compiles in two thirds of the time, and is the same (benchmarks/cold_start.py).
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from contextlib import contextmanager
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


def _link_below(library: Any, module: Any, without: Any = None) -> None:
    """Links into a library's module all that it calls, directly or not, each once.

    A function comes after its caller: LLVM omits functions that are not requested.
    """
    order: dict[Any, None] = {}

    def visit(one: Any) -> None:
        for below in one._linking_libraries:
            if below not in order and below is not without:
                order[below] = None
                if isinstance(below, _linked_library_type()):
                    visit(below)

    visit(library)
    for below in order:
        library._reload_init.update(below._reload_init)
        alone = below.alone if isinstance(below, _linked_library_type()) else below._get_module_for_linking()
        module.link_in(alone, preserve=True)


_SPECULATED, _SPECULATED_BY_LLVM = 2, 4
"""Cost of a side of a condition up to which it is computed before the condition is known: here, and LLVM's default."""
_NEWEST_LLVM = 22
"""The last version that is known to have the option: an unknown one ends the process."""
_COUNTING = """
define linkonce_odr void @NRT_{name}(ptr %info) alwaysinline {{
  %none = icmp eq ptr %info, null
  br i1 %none, label %end, label %count
count:
  %before = load i64, ptr %info
  %after = add i64 %before, {step}
  store i64 %after, ptr %info
  %last = icmp eq i64 %after, 0
  br i1 %last, label %free, label %end
free:
  call void @NRT_MemInfo_call_dtor(ptr %info)
  br label %end
end:
  ret void
}}
"""
"""Count of the references to an array, not atomic: Numba makes a count for each argument at each call of a kernel, and
one for each array that is made in it, so that one thread alone knows of it."""


@contextmanager
def _branches() -> Iterator[None]:
    """Within it a side of a condition stays a branch, which the processor predicts, unless it is a single operation.

    By default LLVM computes both sides, divisions among them, and all that follows waits for the slower one. The option
    belongs to the process, so it is set back for the user's own Numba.
    """
    _speculate(_SPECULATED)
    try:
        yield
    finally:
        _speculate(_SPECULATED_BY_LLVM)


def _speculate(cost: int) -> None:
    from llvmlite import binding

    if binding.llvm_version_info[0] <= _NEWEST_LLVM:
        binding.set_option("palpate", f"-two-entry-phi-node-folding-threshold={cost}")


def _count_in_place(library: Any) -> None:
    """Puts the counts that are left after the passes into the kernel itself."""
    from llvmlite import binding
    from numba.core.runtime import rtsys

    module, codegen = library._final_module, library._codegen
    functions = (_COUNTING.format(name=name, step=step) for name, step in (("incref", 1), ("decref", -1)))
    text = "declare void @NRT_MemInfo_call_dtor(ptr)" + "".join(functions)
    module.link_in(binding.parse_assembly(text))
    module.link_in(rtsys.library._get_module_for_linking(), preserve=True)
    builder = binding.create_pass_builder(codegen._tm, binding.create_pipeline_tuning_options(1))
    manager = binding.create_new_module_pass_manager()
    manager.add_always_inliner_pass()
    manager.add_global_dead_code_eliminate_pass()  # or another module's calls might find these functions
    manager.run(module, builder)


def _entry_compiler() -> type:
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import Compiler

    class EntryLibrary(JITCodeLibrary):
        """Code that takes in each function that it calls once, and runs."""

        def finalize(self) -> None:
            from numba.core.runtime import rtsys

            _link_below(self, self._final_module, without=rtsys.library)
            self._linking_libraries = []
            super().finalize()

        def _optimize_final_module(self) -> None:
            with _branches():
                super()._optimize_final_module()
            _count_in_place(self)

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

        def _optimize_functions(self, module: Any) -> None:
            module.data_layout = self._codegen._data_layout
            with _branches():
                for function in module.functions:
                    if not function.is_declaration:
                        manager, builder = self._codegen._function_pass_manager()
                        manager.run(function, builder)

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
