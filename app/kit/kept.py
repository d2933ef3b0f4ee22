"""A value that is made anew only where what it depends on has changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Kept(Generic[Value]):
    """The value of the newest key; for one thread. A value that could not be made is not kept."""

    def __init__(self) -> None:
        self._known: tuple[object, Value] | None = None

    def get(self, key: object, make: Callable[[], Value]) -> Value:
        """The value of this key, made by this call where the key is another one than before."""
        if self._known is None or self._known[0] != key:
            self._known = None
            self._known = key, make()
        return self._known[1]


class Same:
    """In a key: this very object, which never changes. It is kept, so that no other one takes its place in memory."""

    __slots__ = ("thing",)

    def __init__(self, thing: object) -> None:
        self.thing = thing

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Same) and other.thing is self.thing

    def __hash__(self) -> int:
        return id(self.thing)
