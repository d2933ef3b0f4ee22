"""The volume that is laid over the head of the open plan, and those that could be."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Literal, TypedDict

from pydantic import Field

from app.cases.second_volume import SecondVolume
from app.kit.kept import Kept, Same
from app.messages.fields import Command, Identifier
from app.messages.sections import Section
from app.plans.editor import PlanEditor
from app.plans.service import Plan
from app.services import Services
from app.store.changes import CASES

Number = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]


class LayVolume(Command):
    """Lay a volume over the head's slices; volume: its name in that case, None for the widest CT.

    other_head: the user confirmed that a volume of another case shows the same patient.
    """

    type: Literal["second_volume.lay"]
    case_id: Identifier
    volume: Identifier | None = None
    transform: Annotated[list[Number], Field(min_length=16, max_length=16)]
    opacity: Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
    window: Number
    level: Number
    other_head: bool = False


class LayNothing(Command):
    type: Literal["second_volume.none"]


SECOND_VOLUME_COMMANDS: tuple[type[Command], ...] = (LayVolume, LayNothing)


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
    """What one client lays over the head of one plan. Owned by the session's thread."""

    def __init__(
        self,
        services: Services,
        editor: PlanEditor,
        plan: Callable[[], Plan],
        edit: Callable[[Callable[..., Plan]], object],
    ) -> None:
        """plan: as it is shown; edit: does an edit on the revision that is shown."""
        self._services, self._editor, self._plan, self._do = services, editor, plan, edit
        self._choices: Kept[list[VolumeChoice]] = Kept()

    def section(self) -> Section[SecondVolumeSection]:
        """The page's section."""
        stored = self._services.store.changes.of(CASES)
        return Section((Same(self._plan()), stored), lambda: self._view(stored))

    def _view(self, stored: object) -> SecondVolumeSection:
        plan = self._plan()
        choices = self._choices.get(stored, lambda: self._read(plan.case_id))
        second = plan.second_volume
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

    def handle(self, command: Command) -> None:
        """Answer a command of a second volume. Raises InputError with the reason where that cannot be done."""
        second: SecondVolume | None = None
        if isinstance(command, LayVolume):
            fields = command.model_dump(exclude={"type", "id", "case_id"})
            second = SecondVolume(command.case_id, **{**fields, "transform": tuple(command.transform)})
            self._services.overlays.check_laid(self._plan().case_id, second)
        self._do(lambda **options: self._editor.lay_over(second, **options))
