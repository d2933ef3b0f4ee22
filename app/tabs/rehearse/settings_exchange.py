"""Changes of the settings on their way to the control process: one at a time, what is wished meanwhile waits together.

However fast a slider moves, no more than one message waits in the pipe, so that a process that does not read can stop
nobody.
"""

from __future__ import annotations

from vfix_engine.control import ControlSettings


class SettingsExchange:
    """What is in force, what was asked, what the answer was. Not thread-safe."""

    def __init__(self, in_force: ControlSettings) -> None:
        self.in_force = in_force
        self.answered = 0  # changes that were answered, refusals included
        self.refusal = ""  # why the newest change was not taken
        self._asked: ControlSettings | None = None
        self._names: frozenset[str] = frozenset()  # of what was asked
        self._waiting: dict[str, float] = {}
        self._accepted: dict[str, float] = {}

    @property
    def open(self) -> bool:
        """A question waits for its answer."""
        return self._asked is not None

    def wish(self, values: dict[str, float]) -> ControlSettings | None:
        """What to send to the process now, clamped; None while an answer is still due.

        Raises InputError for an unknown name.
        """
        self.in_force.clamped(**values)
        self._waiting |= values
        return None if self.open else self._next()

    def _next(self) -> ControlSettings | None:
        if not self._waiting:
            return None
        self._names, self._asked = frozenset(self._waiting), self.in_force.clamped(**self._waiting)
        self._waiting = {}
        return self._asked

    def forget(self) -> None:
        """What was asked last could not be sent."""
        self._asked = None

    def told(self, in_force: ControlSettings, reason: str, clearance_mm: float | None) -> ControlSettings | None:
        """The answer, with the reason of a refusal and the tool's clearance; returns what to send next."""
        before, now = self.in_force.to_dict(), in_force.to_dict()
        asked, self._asked = self._asked, None
        self.in_force = in_force
        self.answered += 1
        self._accepted |= {name: now[name] for name in self._names if now[name] != before[name]}
        refused = sorted(name for name in self._names if asked is not None and now[name] != asked.to_dict()[name])
        self.refusal = self._why(refused[0], asked, reason, clearance_mm) if refused and asked is not None else ""
        return self._next()

    def _why(self, name: str, asked: ControlSettings, reason: str, clearance_mm: float | None) -> str:
        bound, value = ControlSettings.bounds()[name], self.in_force.to_dict()[name]
        stays = f"{bound.label} stays at {value:g} {bound.unit}".rstrip()
        if clearance_mm is not None and clearance_mm < asked.margin_mm > self.in_force.margin_mm:
            return f"{stays}: the tool is {clearance_mm:.2f} mm from bone here. Draw it back first."
        return f"{stays}: {reason or 'the controller refuses the change'}"

    @property
    def accepted(self) -> dict[str, float]:
        """What came into force and is not :meth:`kept` yet."""
        return dict(self._accepted)

    def kept(self, values: dict[str, float]) -> None:
        """These values that came into force need not be kept any more."""
        self._accepted = {name: value for name, value in self._accepted.items() if values.get(name) != value}
