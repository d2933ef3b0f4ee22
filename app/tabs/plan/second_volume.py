"""The volume that is laid over the head of the open plan, and those that could be."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypedDict

from app.kit.kept import Kept
from app.messages.sections import Section
from app.plans.service import Plan
from app.services import Services
from app.store.changes import CASES


class LaidView(TypedDict):
    """What is laid over the head. transform: 16 numbers row by row; opacity: 0 to 1.

    to_confirm: the volume is of another head, and nobody has confirmed that it shows the same patient; it is not drawn.
    """

    case: str
    volume: str | None
    transform: list[float]
    opacity: float
    window: float
    level: float
    to_confirm: bool


class VolumeChoice(TypedDict):
    """A volume that can be laid over the head. window, level: that it is shown with at first; None of a CT.

    other_head: it is the CT of another case, imported then; None of a volume of this case.
    """

    case: str
    volume: str | None
    name: str
    other_head: str | None
    window: float | None
    level: float | None


class SecondVolumeSection(TypedDict):
    """What the open plan lays over its head, None for nothing; known: whether that volume is among the choices."""

    laid: LaidView | None
    known: bool
    choices: list[VolumeChoice]
    locked: bool


class SecondVolumeSections(TypedDict):
    """What the Plan tab shows of second volumes."""

    second_volume: SecondVolumeSection | None


class SecondVolumes:
    """What a plan lays over its head, and what it could, for one client. Owned by the session's thread."""

    def __init__(self, services: Services, plan: Callable[[], Plan]) -> None:
        """plan: as it is shown."""
        self._services, self._plan = services, plan
        self._choices: Kept[list[VolumeChoice]] = Kept()

    def section(self) -> Section[SecondVolumeSection]:
        """The page's section."""
        stored, plan = self._services.store.changes.of(CASES), self._plan()
        return Section((plan.case_id, plan.content.second_volume, plan.locked, stored), lambda: self._view(stored))

    def _view(self, stored: object) -> SecondVolumeSection:
        plan = self._plan()
        choices = self._choices.get(stored, lambda: self._read(plan.case_id))
        second = plan.content.second_volume
        known = second is None or any(
            (choice["case"], choice["volume"]) == (second.case, second.volume) for choice in choices
        )
        laid: LaidView | None = None
        if second is not None:
            laid = {
                "case": second.case,
                "volume": second.volume,
                "transform": list(second.transform),
                "opacity": second.opacity,
                "window": second.window,
                "level": second.level,
                "to_confirm": second.case != plan.case_id and not second.other_head,
            }
        return {"laid": laid, "known": known, "choices": choices, "locked": plan.locked}

    def _read(self, case_id: str) -> list[VolumeChoice]:
        cases = self._services.cases.list()
        own: list[VolumeChoice] = [
            {
                "case": case.id,
                "volume": item.id,
                "name": item.name,
                "other_head": None,
                "window": item.window,
                "level": item.level,
            }
            for case in cases
            if case.id == case_id
            for item in case.overlays
        ]
        others: list[VolumeChoice] = [
            {
                "case": case.id,
                "volume": None,
                "name": case.name,
                "other_head": case.created,
                "window": None,
                "level": None,
            }
            for case in cases
            if case.id != case_id and case.has_volume
        ]
        return own + others
