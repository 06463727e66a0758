"""Kernels from the disk, without what only compiling one needs.

Before numba loads a kernel it readies itself to compile: it imports its implementations of all of
numpy, and scipy's linear algebra with them, and reads what of the kernel others may take in. That
takes five times as long as loading the code. Here it is done when something is compiled."""

from __future__ import annotations

import errno
import sys
from pathlib import Path
from pickle import Unpickler
from typing import Any

from llvmlite import binding
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import compile_result
from numba.core.environment import Environment, lookup_environment
from numba.core.runtime.nrt import rtsys

from nscd.compiling.economy import Library
from nscd.compiling.sources import digest_of
from nscd.compiling.turns import Turns


class _Code(Library):
    """Compiled code, whose LLVM code is read when another kernel takes it in."""

    _bitcode: bytes | None = None
    _linked: Any = None

    @property
    def _shared_module(self) -> Any:
        if self._linked is None and self._bitcode is not None:
            self._linked = binding.parse_bitcode(self._bitcode)
            if self.ready:
                self._codegen._engine._load_defined_symbols(self._linked)
        return self._linked

    @_shared_module.setter
    def _shared_module(self, module: Any) -> None:
        self._linked = module

    @classmethod
    def loaded(cls, codegen: Any, data: Any, names: tuple[str, ...]) -> _Code:
        """Load what `serialize_using_object_code` gave; those of the names that it has are known to
        numba then."""
        name, _, (code, bitcode) = data
        library = cls(codegen, name)
        library.enable_object_caching()
        library._bitcode = bitcode
        library._finalized = True
        if not code:
            return library
        library._set_compiled_object(code)
        JITCodeLibrary._finalize_final_module(library)
        library.ready = True
        library._defined = frozenset(one for one in names if one.encode() + b"\0" in code)
        codegen._engine._defined_symbols.update(library._defined)
        return library


class _Results(CompileResultCacheImpl):
    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Make of what was on the disk what compiling gave, as `CompileResult._rebuild` does."""
        data, known, environment, signature, objectmode, lifted, notes, again, others = payload
        for function in again:
            function()
        names = known.llvm_func_name, known.llvm_cpython_wrapper_name
        library = _Code.loaded(target_context.codegen(), data, names)
        entry = target_context.get_executable(library, known, environment)
        for other in others:
            library.codegen.set_env(other.env_name, other)
        return compile_result(
            target_context=target_context,
            typing_context=target_context.typing_context,
            library=library,
            environment=environment,
            entry_point=entry,
            fndesc=known,
            type_annotation=notes,
            signature=signature,
            objectmode=objectmode,
            lifted=lifted,
            reload_init=again,
            referenced_envs=others,
        )


class _Files(IndexDataCacheFile):
    def _load_data(self, name: str) -> Any:
        with open(self._data_path(name), "rb") as file:
            return _Unpickler(file).load()


class _Unpickler(Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == ("numba.core.environment", "_rebuild_env"):
            return _environment
        return super().find_class(module, name)


def _environment(module: str, constants: list[Any], name: str) -> Any:
    """The constants of a kernel. Numba gives it its module's names too, and imports that for it;
    code that does without Python's objects reads none."""
    environment = lookup_environment(name)
    if environment is None:
        names = vars(sys.modules[module]) if module in sys.modules else {"__name__": module}
        environment = Environment(names)
        environment.consts[:] = constants
        environment.env_name = name
        Environment._memo[name] = environment
    return environment


class Loading(FunctionCache):
    """The compiled kernels of a function on the disk."""

    _impl_class = _Results

    def __init__(self, function: Any) -> None:
        try:
            super().__init__(function)
        except RuntimeError:  # numba found no folder that can be written
            why = (
                "no folder for compiled kernels: neither the installation nor the home folder can "
                "be written; set NUMBA_CACHE_DIR to one that can"
            )
            raise OSError(errno.EACCES, why, str(Path(__file__).parents[1])) from None
        stamp = digest_of(function.__code__.co_filename)
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, stamp)
        self.turns = Turns(self._cache_file._index_path)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load the kernel for a signature; None where there is none and it is on this process to
        compile it, until `turns.end`."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            found = self._load_overload(sig, target_context)
            if found is None:
                self._impl.locator.ensure_cache_path()
                if self.turns.take(sig):
                    found = self._load_overload(sig, target_context)
            return found
