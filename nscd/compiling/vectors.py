"""Eight doubles at a time: vectors that kernels can name.

Numba leaves vector instructions to the compiler, which keeps one row of a block in registers where
eight would fit. On processors with narrower registers the compiler splits these vectors by itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel.models import PrimitiveModel
from numba.core.datamodel.registry import register_default
from numba.core.extending import intrinsic

WIDTH = 8
DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
PLACES = ir.VectorType(ir.IntType(32), WIDTH)
# A product and a sum may be one instruction.
FUSED = ("contract",)
# Sums of the lanes may be made in any order.
ANY_ORDER = ("reassoc", "contract")


class _Vector(types.Type):
    """The type of eight doubles."""

    def __init__(self) -> None:
        super().__init__(name="EightDoubles")


VECTOR = _Vector()


@register_default(_Vector)
class _VectorModel(PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, DOUBLES)


def _instruction(typed: Callable[..., Any]) -> Any:
    """Let kernels call it; the types of its arguments are numba's, so no others are checked."""
    return intrinsic(typed)


def _pointer(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), DOUBLES.as_pointer())


@_instruction
def load(_typing: Any, array: Any, _at: Any) -> Any:
    """Read array[at : at + 8]."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.load(_pointer(context, builder, signature.args[0], *given), align=8)

    return VECTOR(array, types.intp), emit


@_instruction
def store(_typing: Any, array: Any, _at: Any, _vector: Any) -> Any:
    """Write array[at : at + 8]."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        place = _pointer(context, builder, signature.args[0], given[0], given[1])
        builder.store(given[2], place, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, VECTOR), emit


def _spread(builder: Any, value: Any, kind: Any) -> Any:
    first = builder.insert_element(
        ir.Constant(kind, ir.Undefined), value, ir.Constant(ir.IntType(32), 0)
    )
    return builder.shuffle_vector(first, ir.Constant(kind, ir.Undefined), ir.Constant(PLACES, None))


@_instruction
def spread(_typing: Any, _value: Any) -> Any:
    """Give eight times a value."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        return _spread(builder, given[0], DOUBLES)

    return VECTOR(types.float64), emit


@_instruction
def spread_from(_typing: Any, array: Any, _at: Any) -> Any:
    """Give eight times array[at], at ≥ 0: what is indexed in brackets may count from the end, and is
    asked whether it does."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, given[0]).data
        return _spread(builder, builder.load(builder.gep(data, [given[1]])), DOUBLES)

    return VECTOR(array, types.intp), emit


@_instruction
def add(_typing: Any, _a: Any, _b: Any) -> Any:
    """Give a + b."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        return builder.fadd(*given, flags=FUSED)

    return VECTOR(VECTOR, VECTOR), emit


@_instruction
def times(_typing: Any, _a: Any, _b: Any) -> Any:
    """Give a · b."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        return builder.fmul(*given, flags=FUSED)

    return VECTOR(VECTOR, VECTOR), emit


@_instruction
def less(_typing: Any, _c: Any, _a: Any, _b: Any) -> Any:
    """Give c − a · b."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        c, a, b = given
        return builder.fsub(c, builder.fmul(a, b, flags=FUSED), flags=FUSED)

    return VECTOR(VECTOR, VECTOR, VECTOR), emit


@_instruction
def more(_typing: Any, _c: Any, _a: Any, _b: Any) -> Any:
    """Give c + a · b."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        c, a, b = given
        return builder.fadd(c, builder.fmul(a, b, flags=FUSED), flags=FUSED)

    return VECTOR(VECTOR, VECTOR, VECTOR), emit


@_instruction
def total(_typing: Any, _a: Any) -> Any:
    """Give the sum of the eight."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType(), DOUBLES])
        name = "llvm.vector.reduce.fadd.v8f64"
        reduce = cgutils.get_or_insert_function(builder.module, kind, name)
        return builder.call(
            reduce, [ir.Constant(ir.DoubleType(), -0.0), given[0]], fastmath=ANY_ORDER
        )

    return types.float64(VECTOR), emit


@_instruction
def within(_typing: Any, _a: Any, _low: Any, _high: Any) -> Any:
    """Give lanes low … high − 1 of a, and zeros."""

    def emit(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        vector, low, high = given
        kind = ir.VectorType(ir.IntType(64), WIDTH)
        lane = ir.Constant(kind, list(range(WIDTH)))
        above = builder.icmp_signed(">=", lane, _spread(builder, low, kind))
        below = builder.icmp_signed("<", lane, _spread(builder, high, kind))
        none = ir.Constant(DOUBLES, [0.0] * WIDTH)
        return builder.select(builder.and_(above, below), vector, none)

    return VECTOR(VECTOR, types.int64, types.int64), emit
