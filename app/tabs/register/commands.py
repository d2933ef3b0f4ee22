"""Commands of the Register tab, beside the operations on registrations."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.messages.fields import ClientMessage, Identifier


class OpenRegistration(ClientMessage):
    type: Literal["registration.open"]
    registration_id: Identifier


class ShowBead(ClientMessage):
    """Bring the slices to a found bead."""

    type: Literal["bead.show"]
    bead_id: Identifier


class SelectPair(ClientMessage):
    type: Literal["pair.select"]
    pair_id: Identifier


class MatchOrder(ClientMessage):
    """Find in which order the measured points belong to the places in the image; nothing is changed yet."""

    type: Literal["order.find", "order.forget"]


class TakeOrder(ClientMessage):
    """Take one of the orders that were found, counted from 0."""

    type: Literal["order.take"]
    candidate: Annotated[int, Field(ge=0, le=1000)]


class UseInPlan(ClientMessage):
    """Let the open plan use the open registration, or none."""

    type: Literal["registration.use"]
    used: bool


COMMANDS: tuple[type[ClientMessage], ...] = (
    OpenRegistration,
    ShowBead,
    SelectPair,
    MatchOrder,
    TakeOrder,
    UseInPlan,
)
