"""Changes of the settings on their way to the control process: one at a time, what is asked meanwhile waits together.

However fast a slider moves, no more than one message waits in the pipe, so that a process that does not read can stop
nobody.
"""

from __future__ import annotations

from collections.abc import Callable

from vfix_engine.runtime.settings import WorldSettings

Explain = Callable[[WorldSettings, WorldSettings], str]  # of the settings asked for, and those in force


class SettingsExchange:
    """What is in force, what was asked, what the answer was. Not thread-safe."""

    def __init__(self, in_force: WorldSettings) -> None:
        self.in_force = in_force
        self.answered = 0  # changes that were answered, refusals included
        self.refusal = ""  # why the newest change was not taken
        self._asked: WorldSettings | None = None
        self._names: frozenset[str] = frozenset()  # of what was asked
        self._waiting: dict[str, float] = {}
        self._accepted: dict[str, float] = {}

    @property
    def open(self) -> bool:
        """A question waits for its answer."""
        return self._asked is not None

    def ask(self, values: dict[str, float]) -> WorldSettings | None:
        """What to send to the process now, clamped; None while an answer is still due.

        Raises InputError for an unknown name.
        """
        self.in_force.clamped(**values)
        self._waiting |= values
        return None if self.open else self._next()

    def _next(self) -> WorldSettings | None:
        if not self._waiting:
            return None
        self._names, self._asked = frozenset(self._waiting), self.in_force.clamped(**self._waiting)
        self._waiting = {}
        return self._asked

    def forget(self) -> None:
        """What was asked last could not be sent."""
        self._asked = None

    def answer(self, in_force: WorldSettings, reason: str, explain: Explain) -> WorldSettings | None:
        """The settings in force after a change, and the reason of a refusal; returns what to send next.

        explain: words that say more than the reason; '' where it has none.
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
        bound = self.in_force.bounds()[name]
        return f"{bound.label} stays at {self.in_force.to_dict()[name]:g} {bound.unit}".rstrip()

    @property
    def accepted(self) -> dict[str, float]:
        """What came into force and is not :meth:`kept` yet."""
        return dict(self._accepted)

    def kept(self, values: dict[str, float]) -> None:
        """These values that came into force need not be kept any more."""
        self._accepted = {name: value for name, value in self._accepted.items() if values.get(name) != value}
