"""The view model: named sections of plain JSON values, each with the revision of its last change."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from app.messages.sections import Section

_NONE: tuple[int, object] = (0, object())  # a missing section differs from everything, None included


class ViewModel:
    """Thread-safe, latest wins: a slow reader gets the newest state, never a queue of old ones (HAZ-31)."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sections: dict[str, tuple[int, object]] = {}
        self._keys: dict[str, object] = {}  # of published and staged sections, for the publishing thread only
        self._staged: dict[str, object] = {}
        self._revision = 0
        self._listeners: list[Callable[[], None]] = []

    def publish(self, name: str, section: Section[object]) -> None:
        """Stage a section if its key has changed; it is published by the next :meth:`commit`.

        Called on one thread only. A section that cannot be built stays as it is, and is tried again.
        """
        if self._keys.get(name, _NONE) != section.key:
            self._staged[name] = section.build()
            self._keys[name] = section.key

    def commit(self) -> None:
        """Publish all staged sections at once, so that no reader sees half of a change; equal values are skipped."""
        staged, self._staged = self._staged, {}
        with self._lock:
            news = {name: new for name, new in staged.items() if self._sections.get(name, _NONE)[1] != new}
            if not news:
                return
            self._revision += 1
            self._sections |= {name: (self._revision, section) for name, section in news.items()}
            listeners = tuple(self._listeners)
        for listener in listeners:
            listener()

    def changed_since(self, revision: int) -> tuple[int, dict[str, object]]:
        """The newest revision and every section that changed after ``revision``."""
        with self._lock:
            changed = {name: value for name, (at, value) in self._sections.items() if at > revision}
            return self._revision, changed

    def read(self, name: str) -> Any:
        """The published section; None where there is none."""
        with self._lock:
            known = self._sections.get(name)
            return None if known is None else known[1]

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call ``listener`` after each change; the returned function ends it."""
        with self._lock:
            self._listeners.append(listener)

        def unsubscribe() -> None:
            with self._lock:
                self._listeners.remove(listener)

        return unsubscribe
