"""What threads tell each other by: numbers that one writes and others wait for."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from typing import Any

from llvmlite import binding, ir
from numba.core import cgutils, types
from numba.core.extending import intrinsic

# What compiled code calls by these names to let others have the core, and to sleep.
YIELD, SLEEP = "nscd_yield", "nscd_sleep"
# So many looks at what is waited for follow each other at once, so many more with others let on the
# core between them; after them a thread sleeps between two, so many microseconds.
AT_ONCE, YIELDING, SLEEP_US = 4000, 4000, 50
INT = ir.IntType(32)


def _addresses() -> tuple[Any, Any]:
    if sys.platform == "win32":  # its shortest sleep is a millisecond
        system = ctypes.WinDLL("kernel32")
        return system.SwitchToThread, system.Sleep
    system = ctypes.CDLL(None)
    return system.sched_yield, system.usleep


for _name, _function in zip((YIELD, SLEEP), _addresses(), strict=True):
    binding.add_symbol(_name, ctypes.cast(_function, ctypes.c_void_p).value)


def _instruction(typed: Callable[..., Any]) -> Any:
    """Let kernels call it; the types of its arguments are numba's, so no others are checked."""
    return intrinsic(typed)


def _pointer(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    return builder.gep(context.make_array(kind)(context, builder, array).data, [at])


@_instruction
def look(_typing: Any, array: Any, _at: Any) -> Any:
    """Read array[at], and see all that its writer wrote before."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        place = _pointer(context, builder, signature.args[0], *given)
        return builder.load_atomic(place, "acquire", 8)

    return types.int64(array, types.intp), emit


@_instruction
def put(_typing: Any, array: Any, _at: Any, _value: Any) -> Any:
    """Write array[at], for others to see after all that was written before."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        place = _pointer(context, builder, signature.args[0], given[0], given[1])
        builder.store_atomic(given[2], place, "release", 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.int64), emit


@_instruction
def add_one(_typing: Any, array: Any, _at: Any) -> Any:
    """Add 1 to array[at], and give what was there; nobody else does so meanwhile."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        place = _pointer(context, builder, signature.args[0], *given)
        return builder.atomic_rmw("add", place, ir.Constant(ir.IntType(64), 1), "seq_cst")

    return types.int64(array, types.intp), emit


@_instruction
def rest(_typing: Any, _looks: Any) -> Any:
    """Wait a little, the longer the more looks were in vain."""

    def emit(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        def call(name: str, *arguments: Any) -> None:
            kind = ir.FunctionType(INT, [INT] * len(arguments))
            waited: Any = cgutils
            builder.call(waited.get_or_insert_function(builder.module, kind, name), arguments)

        limits = [ir.Constant(ir.IntType(64), n) for n in (AT_ONCE, AT_ONCE + YIELDING)]
        with builder.if_then(builder.icmp_signed(">=", given[0], limits[1])):
            call(SLEEP, ir.Constant(INT, 1 if sys.platform == "win32" else SLEEP_US))
        soon = builder.icmp_signed(">=", given[0], limits[0])
        with builder.if_then(builder.and_(soon, builder.icmp_signed("<", given[0], limits[1]))):
            call(YIELD)
        return context.get_dummy_value()

    return types.void(types.int64), emit
