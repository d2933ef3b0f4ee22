"""The one way kernels are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile for scalars and arrays: cached on disk, IEEE arithmetic, one thread."""
    return cast(Function, numba.njit(cache=True, error_model="numpy")(function))


def vectorised(function: Function) -> Function:
    """Compile a loop without branches over many lanes: as ``compiled``, with multiplications and additions fused.

    A fused operation rounds once instead of twice; nothing else about the arithmetic is loosened.
    """
    return cast(Function, numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})(function))
