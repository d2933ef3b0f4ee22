"""Changes of the settings for the control process: one at a time, later ones are merged while they wait.

However fast a slider moves, at most one message waits in the pipe, so that a process that does not read blocks
no client.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from vfix_engine.errors import InputError
from vfix_engine.runtime.settings import WorldSettings

Explain = Callable[[WorldSettings, WorldSettings], str]  # requested settings, and the present ones

_ROUNDING = 1e-9


class SettingsExchange:
    """Present settings, requested ones, and the last answer. Not thread-safe."""

    def __init__(self, in_force: WorldSettings) -> None:
        self.in_force = in_force
        self.answered = 0  # changes that were answered, refusals included
        self.refusal = ""  # why the newest change was refused
        self._asked: WorldSettings | None = None
        self._names: frozenset[str] = frozenset()  # of the requested values
        self._waiting: dict[str, float] = {}
        self._accepted: dict[str, float] = {}

    @property
    def open(self) -> bool:
        """A request waits for its answer."""
        return self._asked is not None

    def ask(self, values: dict[str, float]) -> WorldSettings | None:
        """The settings to send to the process now; None while an answer is pending.

        Raises InputError for an unknown name, or a value out of its range: a lower margin must not be what somebody
        gets who asked for another one. What rounding in a browser has put just outside is clamped.
        """
        near = self.in_force.clamped(**values)
        for name, value in values.items():
            bound, clamped = near.bounds()[name], getattr(near, name)
            if not math.isclose(value, clamped, rel_tol=_ROUNDING, abs_tol=_ROUNDING):
                unit = f" {bound.unit}" if bound.unit else ""
                allowed = f"{bound.low:g} … {bound.high:g}{unit}"
                raise InputError(f"{bound.label} ({name}) is {value:g}; allowed is {allowed}")
        self._waiting |= values
        return None if self.open else self._next()

    def _next(self) -> WorldSettings | None:
        if not self._waiting:
            return None
        self._names, self._asked = frozenset(self._waiting), self.in_force.clamped(**self._waiting)
        self._waiting = {}
        return self._asked

    def forget(self) -> None:
        """The last request could not be sent."""
        self._asked = None

    def answer(self, in_force: WorldSettings, reason: str, explain: Explain) -> WorldSettings | None:
        """Handle the present settings after a change, and the reason of a refusal; returns what to send next.

        explain: words that are more specific than the reason; '' for none.
        """
        before, now = self.in_force.to_dict(), in_force.to_dict()
        asked, self._asked = self._asked, None
        self.in_force = in_force
        self.answered += 1
        self._accepted |= {name: now[name] for name in self._names if now[name] != before[name]}
        self.refusal = ""
        if asked is not None:
            wanted = asked.to_dict()
            refused = sorted(name for name in self._names if now[name] != wanted[name])
            if refused:
                words = explain(asked, in_force) or reason or "the controller refuses the change"
                self.refusal = f"{self._stays(refused[0])}: {words}"
        return self._next()

    def _stays(self, name: str) -> str:
        bound, value = self.in_force.bounds()[name], self.in_force.to_dict()[name]
        if value is None:
            return f"{bound.label} stays as it is"
        return f"{bound.label} stays at {value:g} {bound.unit}".rstrip()

    @property
    def accepted(self) -> dict[str, float]:
        """Values that took effect and are not :meth:`kept` yet."""
        return dict(self._accepted)

    def kept(self, values: dict[str, float]) -> None:
        """These values need not be stored any more."""
        self._accepted = {name: value for name, value in self._accepted.items() if values.get(name) != value}
