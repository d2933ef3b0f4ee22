"""Decorators that compile kernels with numba."""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core import config, types
from numba.extending import register_jitable

from .kernel_cache import KernelCache, cache_folder

Function = TypeVar("Function", bound=Callable[..., Any])

# No kernel is passed to C as a function pointer; compiling that wrapper took an eighth of the compile time.
# The last two are stated, as a kernel would take over those of the caller for which it is first compiled.
_EVERY: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": True, "forceinline": False}
_NO_REFCOUNT: dict[str, Any] = _EVERY | {"_nrt": False}


def compiled(function: Function) -> Function:
    """Compile for scalars and arrays: cached on disk, IEEE arithmetic, one thread."""
    return _cached(function, numba.njit(**_EVERY)(function))


def nogil(function: Function) -> Function:
    """As ``compiled``, for a kernel that runs for milliseconds: other threads of Python run meanwhile.

    It must be called with arrays that no other thread writes to.
    """
    return _cached(function, numba.njit(**_EVERY, nogil=True)(function))


def vectorised(function: Function) -> Function:
    """As ``no_refcount``, for a branch-free loop over lanes: multiplications and additions may be fused.

    A fused operation rounds once instead of twice. Nothing else of IEEE arithmetic is relaxed.
    """
    return _cached(function, numba.njit(**_NO_REFCOUNT, fastmath={"contract", "nsz"})(function))


def no_refcount(function: Function) -> Function:
    """As ``compiled``, without reference counting: for functions that allocate no array.

    They only read and write the arrays of their caller. Reference counting of arrays and slices took more than half of
    the time of a query.
    """
    return _cached(function, numba.njit(**_NO_REFCOUNT)(function))


def merged(function: Function) -> Function:
    """As ``no_refcount``, for a part of a kernel: LLVM inlines it, since passing a record of arrays takes 0.1 µs."""
    return _cached(function, numba.njit(**_NO_REFCOUNT | {"forceinline": True})(function))


def inlined(function: Function) -> Function:
    """A small function that numba inlines into its callers; it is not called from Python."""
    return cast(Function, numba.njit(**_EVERY, inline="always")(function))


def shared(function: Function) -> Function:
    """A small function that is plain Python when Python calls it, and compiled into the kernels that call it."""
    return register_jitable(function)


def _cached(function: Function, dispatcher: Any) -> Function:
    """Attach the cache on disk to a kernel: NUMBA_CACHE_DIR if set, else the folder of kernel_cache.py."""
    if config.CACHE_DIR:  # type: ignore[attr-defined]
        dispatcher.enable_caching()
    elif cache_folder() is not None:
        # The counterpart of numba's enable_caching().
        dispatcher._cache = KernelCache(function)
    _without_literal_types(dispatcher)
    _without_garbage_collection(dispatcher)
    return cast(Function, dispatcher)


def _without_literal_types(dispatcher: Any) -> None:
    """Compile for the integer type instead of a literal: in numba a constant 0 has its own type.

    A kernel called with a constant and with a variable would be compiled twice, and so would all its callees. LLVM
    propagates constants when it inlines the kernel.
    """
    template_of, unliteral = dispatcher.get_call_template, cast(Any, types.unliteral)

    def get_call_template(args: Any, keywords: Any) -> Any:
        plain = {name: unliteral(kind) for name, kind in keywords.items()}
        return template_of([unliteral(kind) for kind in args], plain)

    dispatcher.get_call_template = get_call_template


def _without_garbage_collection(dispatcher: Any) -> None:
    """Compile with the garbage collector off: it took a fifth of the compile time and freed little."""
    compile_one = dispatcher.compile

    def compile_uncollected(signature: Any) -> Any:
        collecting = gc.isenabled()
        gc.disable()
        try:
            return compile_one(signature)
        finally:
            if collecting:
                gc.enable()

    dispatcher.compile = compile_uncollected
