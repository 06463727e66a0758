"""Calls by address: the caller asks for the address of what it calls when it calls it first.

So a kernel that was compiled by another process is loaded from the cache when it is needed, and its
code is in one place only."""

from __future__ import annotations

import ctypes
from importlib import import_module
from pickle import dumps, loads
from typing import Any

from llvmlite import binding, ir
from numba.core import cgutils, sigutils
from numba.core.imputils import impl_ret_new_ref

# What compiled code calls by this name to get an address.
SYMBOL = "nscd_address"
WORD, BYTES = ir.IntType(64), ir.IntType(8).as_pointer()
STALE = "a kernel that this one calls has changed since this program began: begin it again"


@ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)
def _address(start: int, size: int) -> int:
    """The address of a kernel, compiled or loaded; 0 where it gives something else by now."""
    module, name, arguments, result = loads(ctypes.string_at(start, size))
    called = getattr(import_module(module), name)
    called.compile(arguments)
    found = called.overloads[arguments]
    if found.fndesc.restype != result:
        return 0
    return int(found.library.get_pointer_to_function(found.fndesc.llvm_func_name))


binding.add_symbol(SYMBOL, ctypes.cast(_address, ctypes.c_void_p).value)


def called_by_address(self: Any, signature: Any) -> Any:
    """Give numba the key of how a kernel is called, as `Dispatcher.get_overload` does."""
    arguments, _ = sigutils.normalize_signature(signature)
    found = self.overloads[tuple(arguments)]
    key = ("by address", found.entry_point)
    if key not in self.targetctx._defns:
        called = self.py_func.__module__, self.py_func.__qualname__
        emit = _call(dumps((*called, tuple(arguments), found.fndesc.restype)), found.fndesc)
        self.targetctx.insert_func_defn([(emit, key, found.fndesc.argtypes)])
    return key


def _call(known: bytes, kernel: Any) -> Any:
    """What writes the call of a kernel: it is known to `_address` by these bytes."""

    def emit(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        module, convention, none = builder.module, context.call_conv, ir.Constant(WORD, 0)
        place = cgutils.add_global_variable(module, WORD, module.get_unique_name("address"))
        place.initializer, place.linkage = none, "internal"
        with cgutils.if_unlikely(builder, builder.icmp_unsigned("==", builder.load(place), none)):
            asked = ir.FunctionType(WORD, [BYTES, WORD])
            ask = cgutils.get_or_insert_function(module, asked, SYMBOL)
            text = cgutils.global_constant(module, "kernel", cgutils.make_bytearray(known))
            at = [builder.bitcast(text, BYTES), ir.Constant(WORD, len(known))]
            address = builder.call(ask, at)
            with cgutils.if_unlikely(builder, builder.icmp_unsigned("==", address, none)):
                convention.return_user_exc(builder, RuntimeError, (STALE,))
            builder.store(address, place)
        kind = convention.get_function_type(kernel.restype, kernel.argtypes)
        pointer = builder.inttoptr(builder.load(place), kind.as_pointer())
        status, result = convention.call_function(
            builder, pointer, kernel.restype, kernel.argtypes, values
        )
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return impl_ret_new_ref(context, builder, kernel.restype, result)

    return emit
