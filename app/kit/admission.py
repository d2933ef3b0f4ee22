"""A line for work that takes much of the machine: few at a time, some wait in their order, others are turned away."""

from __future__ import annotations

import threading
from itertools import count

from app.kit.errors import TooMany


class AdmissionQueue:
    """Turns of one kind of work; may be used from any thread.

    at_once: how many work at a time. most: how many are in the line, with those that work, and those that are done
    working and still hold something, such as a file that is being sent.
    """

    def __init__(self, what: str, at_once: int, most: int) -> None:
        self._what, self._at_once, self._most = what, at_once, most
        self._lock, self._numbers = threading.Lock(), count()
        self._working: dict[int, bool] = {}  # by ticket, in their order: whether it waits or works

    def join(self) -> int:
        """A ticket for the end of the line. Raises TooMany where it is full."""
        with self._lock:
            if len(self._working) >= self._most:
                raise TooMany(f"{self._most} {self._what} are under way already; try again when one of them has ended.")
            ticket = next(self._numbers)
            self._working[ticket] = True
            return ticket

    def is_turn(self, ticket: int) -> bool:
        """Whether whoever has this ticket may work."""
        with self._lock:
            return ticket in [one for one, working in self._working.items() if working][: self._at_once]

    def done(self, ticket: int) -> None:
        """The work is done; its place stays taken."""
        with self._lock:
            self._working[ticket] = False

    def leave(self, ticket: int) -> None:
        """Give the place free."""
        with self._lock:
            self._working.pop(ticket, None)
