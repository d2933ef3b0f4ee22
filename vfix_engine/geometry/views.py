"""Parts of an array, each with a shape of its own, at no cost in compiled code.

A slice with ``reshape`` took compiled code 30 ns, which a step of control does dozens of times.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload
from numba.np import arrayobj
from numpy.typing import NDArray


def view(array: NDArray[Any], first: int, shape: tuple[int, ...]) -> NDArray[Any]:
    """The items of a contiguous array of any shape from ``first`` on as an array of that shape.

    In compiled code the view does not keep the array alive and nothing is checked. So it is for the arguments of a
    call, which outlive it, and is never returned to Python; a function that returns views is ``shared``.
    """
    return array.reshape(-1)[first : first + int(np.prod(shape))].reshape(shape)


@intrinsic
def _make_view(typing: Any, array: Any, first: Any, shape: Any) -> Any:
    """The type of a view and how it is made: a pointer, a shape and steps."""
    kind = types.Array(array.dtype, len(shape), "C", readonly=not array.mutable)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source = context.make_array(array)(context, builder, arguments[0])
        sizes = cgutils.unpack_tuple(builder, arguments[2])  # type: ignore[no-untyped-call]
        item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(array.dtype)))
        steps = [item]
        for size in reversed(sizes[1:]):
            steps.insert(0, builder.mul(steps[0], size))
        out = context.make_array(kind)(context, builder)
        data = builder.gep(source.data, [arguments[1]])
        fields = {"data": data, "shape": sizes, "strides": steps, "itemsize": item, "meminfo": None}
        arrayobj.populate_array(out, **fields)  # type: ignore[no-untyped-call]
        return out._getvalue()

    return kind(array, types.intp, shape), generate


_make: Any = _make_view


@overload(view, inline="always", strict=False)
def _compiled_view(array: Any, first: Any, shape: Any) -> Any:
    if isinstance(array, types.Array) and array.layout == "C":
        return lambda array, first, shape: _make(array, first, shape)
    return None
