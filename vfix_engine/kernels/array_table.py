"""Constant arrays passed to compiled code as one table of addresses.

Each array argument costs a call 0.1 µs, and a control step has a dozen constant arrays.
Compiled code reads from their memory without a reference: the owner of a table must keep its arrays alive.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np import arrayobj
from numpy.typing import NDArray


def table_of(arrays: Sequence[NDArray[Any]]) -> NDArray[np.int64]:
    """Address and shape of each contiguous array, one after the other.

    Raises:
        ValueError: an array is not contiguous, or read-only.
    """
    numbers: list[int] = []
    for array in arrays:
        if not array.flags.carray:
            raise ValueError("a table takes contiguous, writable arrays only")
        numbers += [array.__array_interface__["data"][0], *array.shape]
    return np.array(numbers, dtype=np.int64)


def _reader(dtype: Any) -> Any:
    """A function (address, shape) for compiled code that returns the array of ``dtype`` at an address."""

    @intrinsic
    def array_at(typing: Any, address: Any, shape: Any) -> Any:
        kind = types.Array(dtype, len(shape), "C")

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            pointer = context.get_data_type(dtype).as_pointer()
            sizes = cgutils.unpack_tuple(builder, arguments[1])  # type: ignore[no-untyped-call]
            item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(dtype)))
            steps = [item]
            for size in reversed(sizes[1:]):
                steps.insert(0, builder.mul(steps[0], size))
            out = context.make_array(kind)(context, builder)
            data = builder.inttoptr(arguments[0], pointer)
            fields = {"data": data, "shape": sizes, "strides": steps, "itemsize": item, "meminfo": None}
            arrayobj.populate_array(out, **fields)  # type: ignore[no-untyped-call]
            return out._getvalue()

        return kind(types.int64, shape), generate

    return array_at


float64_at, float32_at = _reader(types.float64), _reader(types.float32)
int64_at, int32_at = _reader(types.int64), _reader(types.int32)
