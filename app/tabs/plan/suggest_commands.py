"""Commands of the Plan tab about suggested paths and the shaft's directions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.messages.fields import ClientMessage, Identifier


class SuggestionCommand(ClientMessage):
    """Show an alternative of a suggestion in the scene, or lead the path along it."""

    type: Literal["suggestion.show", "suggestion.use"]
    suggestion_id: Identifier
    alternative: Annotated[int, Field(ge=0, le=1000)]


class HideSuggestion(ClientMessage):
    type: Literal["suggestion.hide", "shaft.aim_off"]


class AimShaft(ClientMessage):
    """Aim the shaft at a path point by the next click."""

    type: Literal["shaft.aim"]
    item_id: Identifier


COMMANDS: tuple[type[ClientMessage], ...] = (SuggestionCommand, HideSuggestion, AimShaft)
