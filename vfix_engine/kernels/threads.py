"""Threads for kernels that release the interpreter lock (`compiled.nogil`)."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager


@contextmanager
def threads(count: int) -> Iterator[ThreadPoolExecutor]:
    """Run work in `count` threads; it has ended when the block has, and what has not begun is dropped if that fails."""
    pool = ThreadPoolExecutor(count, thread_name_prefix="vfix-kernels")
    try:
        yield pool
    except BaseException:
        pool.shutdown(cancel_futures=True)
        raise
    pool.shutdown()
