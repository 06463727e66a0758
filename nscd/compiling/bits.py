"""What processors do in one instruction and numba has no name for: kernels can call it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.extending import intrinsic

WORD, DOUBLE_WORD = ir.IntType(64), ir.IntType(128)


def _instruction(typed: Callable[..., Any]) -> Any:
    """Let kernels call it; the types of its arguments are numba's, so no others are checked."""
    return intrinsic(typed)


@_instruction
def eight(_typing: Any, text: Any, _at: Any) -> Any:
    """Read text[at : at + 8] of bytes as one number, the first byte the lowest; inside the text."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, given[0]).data
        place = builder.bitcast(builder.gep(data, [given[1]]), WORD.as_pointer())
        return builder.load(place, align=1)

    return types.uint64(text, types.intp), emit


@_instruction
def put_eight(_typing: Any, text: Any, _at: Any, _number: Any) -> Any:
    """Write text[at : at + 8] of bytes as `eight` reads them; inside the text."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, given[0]).data
        place = builder.bitcast(builder.gep(data, [given[1]]), WORD.as_pointer())
        builder.store(given[2], place, align=1)
        return context.get_dummy_value()

    return types.void(text, types.intp, types.uint64), emit


@_instruction
def zeros_below(_typing: Any, _number: Any) -> Any:
    """Count the zeros below the lowest bit of a number that is not 0."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        return builder.cttz(given[0], ir.Constant(ir.IntType(1), 1))

    return types.uint64(types.uint64), emit


@_instruction
def zeros_above(_typing: Any, _number: Any) -> Any:
    """Count the zeros above the highest bit of a number that is not 0."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        return builder.ctlz(given[0], ir.Constant(ir.IntType(1), 1))

    return types.uint64(types.uint64), emit


@_instruction
def high_product(_typing: Any, _a: Any, _b: Any) -> Any:
    """Compute the high 64 bits of a product of two numbers of 64."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        a, b = (builder.zext(number, DOUBLE_WORD) for number in given)
        upper = builder.lshr(builder.mul(a, b), ir.Constant(DOUBLE_WORD, 64))
        return builder.trunc(upper, WORD)

    return types.uint64(types.uint64, types.uint64), emit
