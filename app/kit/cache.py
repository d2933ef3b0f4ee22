"""A small cache of things that are slow to make: one thread makes, the others wait."""

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
    """The `size` most recently used values, by key. A value that could not be made is not kept.

    A cancellation is that of its caller alone: where the one who makes is cancelled, another one who waits makes.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._lock = threading.Lock()
        self._entries: OrderedDict[Key, Future[_Value]] = OrderedDict()

    def has(self, key: Key) -> bool:
        """Whether the value of `key` is there, so that `get` does not wait for it."""
        with self._lock:
            entry = self._entries.get(key)
        return entry is not None and entry.done() and entry.exception() is None

    def get(self, key: Key, make: Callable[[], _Value]) -> _Value:
        """The value of `key`, made by this call if it is the first. Raises what `make` raises, whoever called it."""
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
        """The entry of a key, and whether it is new: then this caller makes its value."""
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
