"""What can be done to the motion of a route's lumen: breathing and peristalsis."""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from app.lumen.document import Amplitude, Period, Route, WaveShare
from app.operations.operation import Context, Edit, Option, Verb


def _period(words: str) -> Option:
    return Option("--period", "period_s", "S", f"{words}, else as it is", None)


class SetBreathing(Edit, frozen=True):
    """Let the lumen breathe along the body's axis. Amplitude in mm; 0: it does not. Period in s; null: as it is."""

    title = "Breathing of the lumen"
    rest = "PUT /routes/{id}/breathing"
    message = "route.breathing"
    of_open = True
    verb = (Verb("route breathing", options=(_period("of a breath"),)),)
    breathing_mm: Amplitude
    period_s: Period | None = None

    def apply(self, content: Route, context: Context[Route, Any]) -> Route:
        period = content.breathing_period_s if self.period_s is None else self.period_s
        return replace(content, breathing_mm=self.breathing_mm, breathing_period_s=period)


class SetPeristalsis(Edit, frozen=True):
    """Let waves narrow the lumen by a share of its radius; 0: none. Period between two of them in s; null: as it is."""

    title = "Peristalsis of the lumen"
    rest = "PUT /routes/{id}/peristalsis"
    message = "route.peristalsis"
    of_open = True
    verb = (Verb("route peristalsis", options=(_period("between waves"),)),)
    share: WaveShare
    period_s: Period | None = None

    def apply(self, content: Route, context: Context[Route, Any]) -> Route:
        period = content.peristalsis_period_s if self.period_s is None else self.period_s
        return replace(content, peristalsis=self.share, peristalsis_period_s=period)


OPERATIONS = (SetBreathing, SetPeristalsis)
