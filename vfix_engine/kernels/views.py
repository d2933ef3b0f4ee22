"""Views of parts of an array without overhead in compiled code.

A slice with ``reshape`` costs compiled code 30 ns, and a control step makes dozens.
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
    """Return a view of a contiguous array: its items from index ``first`` on, in the shape ``shape``.

    In compiled code the view holds no reference and is not bounds checked. Use it only on arguments of the call and do
    not return it to Python; a function that returns views is ``shared``. Write to a view in another function than the
    one that calls this: numba inlines this early, and then removes writes to the view as dead code.
    """
    return array.reshape(-1)[first : first + int(np.prod(shape))].reshape(shape)


@intrinsic
def _make_view(typing: Any, array: Any, first: Any, shape: Any) -> Any:
    """Type and code generator of a view: pointer, shape and strides."""
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


# Only a function with reference counting may return an array that is none of its arguments.
_COUNTED: Any = {"_nrt": True}


@overload(view, jit_options=_COUNTED, inline="always", strict=False)
def _compiled_view(array: Any, first: Any, shape: Any) -> Any:
    if isinstance(array, types.Array) and array.layout == "C":
        return lambda array, first, shape: _make(array, first, shape)
    return None
