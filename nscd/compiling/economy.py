"""What numba does in compiling that nobody needs here, left out while a kernel is compiled.

Numba makes machine code of each function that it compiles, and then takes it into its callers,
where it is made once more. Here it is made of what Python calls, and of what is called by its
address. Of numba's own functions, several hundred, it also makes an entry for C, and optimises each
before it takes it in; and it looks at each part of each tuple, numbers too, wherever it counts
references."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from llvmlite.binding import Linkage, ffi
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.environment import lookup_environment
from numba.core.registry import cpu_target
from numba.core.runtime.context import NRTContext

# Numba keeps its many objects until a kernel is compiled. To look for garbage among them takes a
# tenth of the time at Python's own number of new objects between two looks, and finds little.
NEW_OBJECTS = 100_000
ENVIRONMENT = "_ZN08NumbaEnv"
# So begin the names of numba's own functions.
NUMBAS = "_ZN5numba"


class _Environments:
    """Where numba says which constants a function has: what runs is told when it is made ready."""

    def __init__(self, library: Library) -> None:
        self._library = library

    def __getattr__(self, name: str) -> Any:
        return getattr(self._library._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Tell the code that runs, if there is any."""
        if self._library.ready:
            self._library._codegen.set_env(name, environment)


class Library(JITCodeLibrary):
    """Code that is made ready to run when somebody asks for its address."""

    _codegen: Any
    ready = False
    _numbas = False
    _defined: frozenset[str] = frozenset()

    @property
    def codegen(self) -> Any:
        """Numba's, but for constants of what is not ready."""
        return _Environments(self)

    def add_ir_module(self, ir_module: Any) -> None:
        """Add code."""
        defined = (one.name for one in ir_module.functions if not one.is_declaration)
        self._numbas = all(name.startswith(NUMBAS) for name in defined)
        super().add_ir_module(ir_module)

    def _optimize_functions(self, module: Any) -> None:
        """Optimise what is defined here; numba does so with each function that is only named."""
        module.data_layout = self._codegen._data_layout
        for one in module.functions:
            if not one.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                passes.run(one, builder)

    def _optimize_final_module(self) -> None:
        """Optimise the code and what it has taken in. Numba's own functions are optimised where
        they are taken in only: before, no more is done than counting references asks for."""
        codegen = self._codegen
        passes, builder = codegen._module_pass_manager(
            loop_vectorize=codegen._loopvect,
            slp_vectorize=False,
            opt=codegen._opt_level,
            cost="cheap",
        )
        passes.run(self._final_module, builder)
        if not self._numbas:
            self._optimize()

    def _optimize(self) -> None:
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        functions = self._final_module.functions
        self._defined = frozenset(one.name for one in functions if not one.is_declaration)
        self._finalize_dynamic_globals()
        self._finalized = True

    def make_ready(self) -> None:
        """Make machine code."""
        if self.ready:
            return
        if self._numbas:
            self._get_module_for_linking()  # a copy, before
            self._optimize()
        super()._finalize_final_module()
        self.ready = True
        for one in self._final_module.global_variables:
            if one.name.startswith(ENVIRONMENT):
                found = lookup_environment(one.name)
                if found is not None:
                    self._codegen.set_env(one.name, found)

    def _get_module_for_linking(self) -> Any:
        self._ensure_finalized()
        if self._shared_module is None:
            module = self._final_module.clone()
            for one in module.functions:
                if not one.is_declaration and one.linkage == Linkage.external:
                    one.linkage = "linkonce_odr"
            self._shared_module = module
        return self._shared_module

    def get_pointer_to_function(self, name: str) -> Any:
        """Give the address of a function, made ready; 0 where there is none."""
        self._ensure_finalized()
        if name not in self._defined:
            return 0
        self.make_ready()
        return super().get_pointer_to_function(name)

    def serialize_using_object_code(self) -> Any:
        """Give what is kept on the disk: no machine code of what others only take in."""
        code = self._get_compiled_object() if self.ready else b""
        return self.name, "object", (code, self._get_module_for_linking().as_bitcode())


def _counted(self: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Give what has a count of references in a value, as `NRTContext.get_meminfos` does."""
    models = self._context.data_model_manager
    model, found = models[kind], []
    if model.has_nrt_meminfo():
        found.append((kind, model.get_nrt_meminfo(builder, value)))
    for part, getter in model.traverse(builder):
        if models[part].contains_nrt_meminfo():
            found.extend(_counted(self, builder, part, getter(value)))
    return found


def _no_entry(*_: Any, **__: Any) -> None:
    """Make no entry for C."""


@contextmanager
def economy() -> Iterator[None]:
    """Compile so meanwhile, in one thread."""
    context: Any = cpu_target.target_context
    counter: Any = NRTContext
    codegen = context.codegen()
    with global_compiler_lock:
        if isinstance(codegen._library_class, type) and issubclass(codegen._library_class, Library):
            yield  # within another
            return
        counting, looks = counter.get_meminfos, gc.get_threshold()
        # numba hears when each of 200,000 calls of LLVM begins and ends, to measure them
        lock = ffi.lib._lock
        heard, lock._cblist = lock._cblist, []
        codegen._library_class, context.create_cfunc_wrapper = Library, _no_entry
        counter.get_meminfos = _counted
        if looks[0]:
            gc.set_threshold(max(NEW_OBJECTS, looks[0]), *looks[1:])
        try:
            yield
        finally:
            del codegen._library_class, context.create_cfunc_wrapper
            counter.get_meminfos, lock._cblist = counting, heard
            gc.set_threshold(*looks)
