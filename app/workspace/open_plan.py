"""The plan that a client has open: one tab edits it, others drive or show it."""

from __future__ import annotations

from collections.abc import Callable

from app.plans.service import Plan


class OpenedPlan:
    """Owned by the session's thread."""

    def __init__(self) -> None:
        self._source: Callable[[], Plan | None] = lambda: None
        self._listeners: list[Callable[[], None]] = []
        self._known: str | None = None

    @property
    def current(self) -> Plan | None:
        """The stored plan; None where none is open."""
        return self._source()

    @property
    def id(self) -> str | None:
        plan = self.current
        return None if plan is None else plan.id

    def provide(self, source: Callable[[], Plan | None]) -> None:
        """Set the source of the plan; for the tab that opens plans."""
        self._source = source

    def on_opened(self, listener: Callable[[], None]) -> None:
        """Call ``listener`` when another plan, or none, is open."""
        self._listeners.append(listener)

    def opened(self, again: bool = False) -> None:
        """A plan was opened or closed; listeners are not called where it is the same as before, unless ``again``."""
        now = self.id
        if again or now != self._known:
            self._known = now
            for listener in self._listeners:
                listener()
