"""A small cache of values that are slow to compute: one thread computes a value, the others wait for it."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from typing import Generic, TypeVar

from app.kit.errors import JobCancelled

Key = TypeVar("Key", bound=Hashable)
_Value = TypeVar("_Value")


class Cache(Generic[Key, _Value]):
    """The `size` most recently used values, by key. Errors are not cached. Thread-safe.

    A cancellation affects only its own caller: if the computing caller is cancelled, a waiting one computes the value.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._lock = threading.Lock()
        self._entries: OrderedDict[Key, Future[_Value]] = OrderedDict()

    def has(self, key: Key) -> bool:
        """Return whether the value of `key` is available, so that `get` returns immediately."""
        with self._lock:
            entry = self._entries.get(key)
        return entry is not None and entry.done() and entry.exception() is None

    def peek(self, key: Key) -> _Value | None:
        """The value of `key` if it is available; None otherwise. Never waits."""
        with self._lock:
            entry = self._entries.get(key)
        return entry.result() if entry is not None and entry.done() and entry.exception() is None else None

    def drop(self, key: Key) -> None:
        """Forget the value of `key`; one that is being computed is returned to its callers, and not kept."""
        with self._lock:
            self._entries.pop(key, None)

    def get(self, key: Key, make: Callable[[], _Value]) -> _Value:
        """Return the value of `key`, computed by `make` if it is missing.

        Raises the error of `make`, also if another caller's `make` computes the value.
        """
        while True:
            entry, mine = self._entry(key)
            if mine:
                self._make(key, entry, make)
                return entry.result()
            error = entry.exception()
            if error is None:
                return entry.result()
            if isinstance(error, Exception) and not isinstance(error, JobCancelled):
                raise error

    def _entry(self, key: Key) -> tuple[Future[_Value], bool]:
        """Return the entry of a key, and whether it is new, in which case this caller computes its value."""
        with self._lock:
            entry = self._entries.get(key)
            mine = entry is None
            if entry is None:
                entry = self._entries[key] = Future()
                while len(self._entries) > self._size:
                    self._entries.popitem(last=False)
            self._entries.move_to_end(key)
            return entry, mine

    def _make(self, key: Key, entry: Future[_Value], make: Callable[[], _Value]) -> None:
        try:
            entry.set_result(make())
        except BaseException as error:
            with self._lock:
                if self._entries.get(key) is entry:
                    del self._entries[key]
            entry.set_exception(error)
