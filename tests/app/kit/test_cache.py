"""Cache of slow values: each is computed once, and a cancellation affects only its own caller."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

from app.kit.cache import Cache
from app.kit.errors import JobCancelled
from vfix_engine.errors import InputError


class _Beside:
    """One caller makes while others wait; then what it makes ends as a test says."""

    def __init__(self, executor: ThreadPoolExecutor, ends: Callable[[], str]) -> None:
        self.cache, self.made = Cache[str, str](2), list[str]()
        self._begun, self._go_on, self._waiting = threading.Event(), threading.Event(), threading.Semaphore(0)

        def first() -> str:
            self._begun.set()
            assert self._go_on.wait(60)
            return ends()

        self.first = executor.submit(self.cache.get, "key", first)
        assert self._begun.wait(60)
        entry, look = self.cache._entries["key"], Future.exception

        def asked(future: Future[str], timeout: float | None = None) -> BaseException | None:
            if future is entry:
                self._waiting.release()
            return look(future, timeout)

        entry.exception = lambda timeout=None: asked(entry, timeout)  # type: ignore[method-assign]
        self.others = [executor.submit(self.cache.get, "key", lambda n=n: self._make(n)) for n in range(3)]
        for _ in self.others:
            assert self._waiting.acquire(timeout=60)
        self._go_on.set()

    def _make(self, number: int) -> str:
        self.made.append(f"by {number}")
        return self.made[-1]


def _raise(error: BaseException) -> str:
    raise error


@pytest.mark.parametrize("ended", [JobCancelled(), KeyboardInterrupt()])
def test_a_cancellation_is_that_of_its_caller_alone(ended: BaseException) -> None:
    """One of those who wait makes it then, and the others get what it has made."""
    with ThreadPoolExecutor(4) as executor:
        beside = _Beside(executor, lambda: _raise(ended))
        with pytest.raises(type(ended)):
            beside.first.result(60)
        found = [other.result(60) for other in beside.others]
    assert len(beside.made) == 1
    assert found == beside.made * 3
    assert beside.cache.get("key", lambda: _raise(AssertionError())) == beside.made[0]


def test_what_cannot_be_made_cannot_be_made_for_anybody_who_waits() -> None:
    with ThreadPoolExecutor(4) as executor:
        beside = _Beside(executor, lambda: _raise(InputError("no CT")))
        for one in (beside.first, *beside.others):
            with pytest.raises(InputError, match="no CT"):
                one.result(60)
    assert beside.made == []
    assert not beside.cache.has("key")
    assert beside.cache.get("key", lambda: "made now") == "made now"
