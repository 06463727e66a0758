"""The decorators of kernels.

Numba takes the code of whatever a kernel calls into the kernel and compiles it there once more, and
makes two wrappers for each, whether anybody calls it from outside or not. A wrapper for tuples of
arrays is longer than most kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, overload

from numba.core.registry import CPUDispatcher

from nscd.compiling.by_address import called_by_address
from nscd.compiling.economy import Library, economy
from nscd.compiling.loading import Loading

Function = TypeVar("Function", bound=Callable[..., Any])


class _Once(CPUDispatcher):
    """What is compiled by one process, for all."""

    _cache: Any  # a copy of a kernel, as pickle makes it, has none of its own

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, or load what is there."""
        try:
            with economy():
                return super().compile(sig)
        finally:
            if isinstance(self._cache, Loading):
                self._cache.turns.end(sig)


class _Kernel(_Once):
    """What Python and kernels call."""


class _Inner(_Once):
    """What kernels call: it has no entry for Python."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        raise TypeError(f"{self.py_func.__qualname__}: for kernels only; @kernel lets Python call")


class _KernelApart(_Kernel):
    get_overload: Any = called_by_address


class _InnerApart(_Inner):
    get_overload: Any = called_by_address

    def add_overload(self, cres: Any) -> None:
        """Have machine code of it, which others ask for by its address."""
        if isinstance(cres.library, Library):
            cres.library.make_ready()
        super().add_overload(cres)


@overload
def kernel(function: Function, /) -> Function:
    """Compile without options."""


@overload
def kernel(*, apart: bool = False, **options: Any) -> Callable[[Function], Function]:
    """Compile with options."""


def kernel(function: Any = None, /, *, apart: bool = False, **options: Any) -> Any:
    """Compile a function, to be called from Python and by kernels.

    apart: kernels call it by its address and do not take its code in: for what is long, and called
        by several; nothing is optimised across such a call
    options: of `numba.njit`, such as fastmath"""
    return _decorated(_KernelApart if apart else _Kernel, function, options)


@overload
def inner(function: Function, /) -> Function:
    """Compile without options."""


@overload
def inner(
    *, apart: bool = False, disjoint: bool = False, **options: Any
) -> Callable[[Function], Function]:
    """Compile with options."""


def inner(
    function: Any = None, /, *, apart: bool = False, disjoint: bool = False, **options: Any
) -> Any:
    """Compile a function, to be called by kernels only; a call from Python raises TypeError.

    apart, options: as of `kernel`
    disjoint: no array that it is given overlaps another one, so that what it writes does not change
        what it reads, and loops can be vector instructions"""
    kind = _InnerApart if apart else _Inner
    return _decorated(kind, function, options | {"no_cpython_wrapper": True}, disjoint=disjoint)


def _without_overlap(flags: Any) -> Any:
    flags.noalias = True
    return flags


def _decorated(
    kind: type[Any], function: Any, options: dict[str, Any], *, disjoint: bool = False
) -> Any:
    def decorate(plain: Callable[..., Any]) -> Any:
        fixed = {"nopython": True, "nogil": False, "no_cfunc_wrapper": True}
        compiled = kind(py_func=plain, targetoptions=fixed | options)
        if disjoint:
            compiled._compiler._customize_flags = _without_overlap
        compiled._cache = Loading(plain)
        return compiled

    return decorate if function is None else decorate(function)
