"""Operations on the volume that a plan lays over its head's slices."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import msgspec
from msgspec import Meta

from app.cases.second_volume import IDENTITY, SecondVolume, check_second
from app.operations.fields import Identifier
from app.plans.model import PlanContent
from app.plans.operations.base import PlanEdit, Plans, StoredPlan

Number = Annotated[float, Meta(ge=-1e6, le=1e6)]  # what may be, `check_second` says
Transform = Annotated[tuple[Number, ...], Meta(min_length=16, max_length=16)]
Id = Annotated[str, Meta(max_length=64)]


class LaidVolume(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A volume of a case by its name, else that case's widest CT; fields as in a plan."""

    case: Id
    volume: Id | None = None
    transform: Transform = IDENTITY
    opacity: Number = 0.5
    window: Number = 2500.0
    level: Number = 600.0
    other_head: bool = False


class LayOver(PlanEdit, frozen=True):
    """Overlay the slices: a `volume` of a `case`, null for its widest CT; or with null nothing.

    `transform`: rigid, 16 numbers row by row, from the second volume's LPS to the head's, mm. `opacity`: 0 to 1. For a
    case other than the plan's, `other_head` confirms that both show the same patient.
    """

    rest = "PUT /plans/{id}/second-volume"
    second_volume: LaidVolume | None

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        if (second := self._second()) is not None:
            context.service.overlays.check_laid(context.documents.title(document_id).case_id, second)
        return super().run(context, document_id)

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return replace(content, second_volume=self._second())

    def _second(self) -> SecondVolume | None:
        laid = self.second_volume
        return None if laid is None else check_second(SecondVolume(**msgspec.structs.asdict(laid)))


class LayVolume(PlanEdit, frozen=True):
    """Lay a volume over the head's slices: that of a name in a case, null for its widest CT.

    `other_head`: the user confirmed that a volume of another case shows the same patient.
    """

    title = "Overlay a volume"
    message = "second_volume.lay"
    case_id: Identifier
    transform: Transform
    opacity: Annotated[float, Meta(ge=0.0, le=1.0)]
    window: Number
    level: Number
    volume: Identifier | None = None
    other_head: bool = False

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        laid = {name: value for name, value in msgspec.structs.asdict(self).items() if name != "case_id"}
        return LayOver(second_volume=LaidVolume(case=self.case_id, **laid)).run(context, document_id)


class LayNothing(PlanEdit, frozen=True):
    """Lay nothing over the head's slices any more."""

    title = "Remove the overlay"
    message = "second_volume.none"

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        return LayOver(second_volume=None).run(context, document_id)


OPERATIONS = (LayOver, LayVolume, LayNothing)
