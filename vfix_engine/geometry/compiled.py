"""How every kernel is compiled."""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core import config, types
from numba.extending import register_jitable

from .kernel_cache import KernelCache, cache_folder

Function = TypeVar("Function", bound=Callable[..., Any])

# No kernel is handed to C as a pointer; the wrapper for that took an eighth of the compilation.
_EVERY: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}
_BORROWING: dict[str, Any] = _EVERY | {"_nrt": False}


def compiled(function: Function) -> Function:
    """Compile for scalars and arrays: cached on disk, IEEE arithmetic, one thread."""
    return _kept(function, numba.njit(**_EVERY)(function))


def vectorised(function: Function) -> Function:
    """Compile a loop without branches over many lanes: as ``borrowing``, with multiplications and additions fused.

    A fused operation rounds once instead of twice; nothing else about the arithmetic is loosened.
    """
    return _kept(function, numba.njit(**_BORROWING, fastmath={"contract", "nsz"})(function))


def borrowing(function: Function) -> Function:
    """As ``compiled`` for a piece that makes no array of its own and only looks at and fills those of its caller.

    References to arrays and slices are not counted then; the counting took more than half of a query's time.
    """
    return _kept(function, numba.njit(**_BORROWING)(function))


def inlined(function: Function) -> Function:
    """A small piece that is put into each of its callers before they are compiled; it is not called from outside."""
    return cast(Function, numba.njit(**_EVERY, inline="always")(function))


def shared(function: Function) -> Function:
    """A small piece that is plain Python where Python calls it, and compiled into the kernels that call it."""
    return register_jitable(function)


def _kept(function: Function, dispatcher: Any) -> Function:
    """The kernel with its place on disk: NUMBA_CACHE_DIR as numba has it, else the folder of kernel_cache.py."""
    if config.CACHE_DIR:  # type: ignore[attr-defined]
        dispatcher.enable_caching()
    elif cache_folder() is not None:
        # What enable_caching() does with a cache of numba's own.
        dispatcher._cache = KernelCache(function)  # type: ignore[no-untyped-call]
    _forget_literals(dispatcher)
    _keep_garbage(dispatcher)
    return cast(Function, dispatcher)


def _forget_literals(dispatcher: Any) -> None:
    """Compile for the type of a whole number and not for the number: to numba a plain 0 is a type of its own.

    A kernel that is handed a 0 first and a counter later would be compiled for each, and so would all below it. What
    a constant is good for, LLVM finds out when it puts the kernel into its caller.
    """
    template_of, unliteral = dispatcher.get_call_template, cast(Any, types.unliteral)

    def get_call_template(args: Any, keywords: Any) -> Any:
        plain = {name: unliteral(kind) for name, kind in keywords.items()}
        return template_of([unliteral(kind) for kind in args], plain)

    dispatcher.get_call_template = get_call_template


def _keep_garbage(dispatcher: Any) -> None:
    """Compile without looking for garbage: there is little among very many objects, and it took a fifth of the time."""
    compile_one = dispatcher.compile

    def compile_in_peace(signature: Any) -> Any:
        collecting = gc.isenabled()
        gc.disable()
        try:
            return compile_one(signature)
        finally:
            if collecting:
                gc.enable()

    dispatcher.compile = compile_in_peace
