"""Commands of the Register tab."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StringConstraints

from app.messages.fields import Command, Identifier, Name, Position, Revision

Label = Annotated[str, StringConstraints(strip_whitespace=True, max_length=120)]
Number = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]  # [mm, or none]; what may be, the services say


class RegistrationCommand(Command):
    type: Literal["registration.open", "registration.duplicate", "registration.delete", "registration.restore"]
    registration_id: Identifier


class RenameRegistration(Command):
    type: Literal["registration.rename"]
    registration_id: Identifier
    name: Name


class NewRegistration(Command):
    """Without a name it gets the next number."""

    type: Literal["registration.new"]
    name: Name | None = None


class EditRegistration(Command):
    """Of the open registration: redo, confirm every bead, forget what was measured, or fit the pairs."""

    type: Literal["registration.redo", "bead.confirm_all", "pair.clear_measured", "registration.fit_pairs"]


class UndoRegistration(Command):
    """Take the newest edit of the open registration back; with a revision only where nothing was edited since."""

    type: Literal["registration.undo"]
    revision: Revision | None = None


class LockRegistration(Command):
    type: Literal["registration.lock"]
    locked: bool


class JudgeBead(Command):
    """Confirm a found bead, reject it, or neither."""

    type: Literal["bead.judge"]
    bead_id: Identifier
    confirmed: bool | None


class ShowBead(Command):
    """Bring the slices to a found bead."""

    type: Literal["bead.show"]
    bead_id: Identifier


class AddPair(Command):
    """Add a pair; without a place in the image it is at the crosshair."""

    type: Literal["pair.add"]
    in_image: Position | None = None


class ChangePair(Command):
    """Change fields of a pair; those that are left out stay, a place that is null is taken away."""

    type: Literal["pair.change"]
    pair_id: Identifier
    label: Label | None = None
    in_image: Position | None = None
    measured: Position | None = None
    enabled: bool | None = None
    weight: Number | None = None

    def fields(self) -> dict[str, Any]:
        """What was said."""
        said = self.model_dump(exclude={"type", "id", "pair_id"}, exclude_unset=True)
        return {name: value for name, value in said.items() if value is not None or name in ("in_image", "measured")}


class PairCommand(Command):
    type: Literal["pair.select", "pair.delete"]
    pair_id: Identifier


class Touch(Command):
    """Measure with the simulated pointer: one pair, or every pair that was not measured yet."""

    type: Literal["pair.touch"]
    pair_id: Identifier | None = None
    noise_mm: Number


class MatchOrder(Command):
    """Find in which order the measured points belong to the places in the image; nothing is changed yet."""

    type: Literal["order.find", "order.forget"]


class TakeOrder(Command):
    """Take one of the orders that were found, counted from 0."""

    type: Literal["order.take"]
    candidate: Annotated[int, Field(ge=0, le=1000)]


class StateFle(Command):
    """State the localisation error of one fiducial; null estimates it from the fit."""

    type: Literal["registration.fle"]
    fle_mm: Number | None


class UseRegistration(Command):
    """Let the open plan use the open registration, or none."""

    type: Literal["registration.use"]
    used: bool


COMMANDS: tuple[type[Command], ...] = (
    RegistrationCommand,
    RenameRegistration,
    NewRegistration,
    EditRegistration,
    UndoRegistration,
    LockRegistration,
    JudgeBead,
    ShowBead,
    AddPair,
    ChangePair,
    PairCommand,
    Touch,
    MatchOrder,
    TakeOrder,
    StateFle,
    UseRegistration,
)
