"""Commands of the Plan tab about suggested paths and the shaft's directions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.messages.fields import ClientMessage, Identifier

Roll = Annotated[float, Field(ge=-360.0, le=360.0, allow_inf_nan=False)]


class SuggestionCommand(ClientMessage):
    """Show an alternative of a suggestion in the scene, or lead the path along it."""

    type: Literal["suggestion.show", "suggestion.use"]
    suggestion_id: Identifier
    alternative: Annotated[int, Field(ge=0, le=1000)]


class HideSuggestion(ClientMessage):
    type: Literal["suggestion.hide", "shaft.aim_off"]


class ShaftCommand(ClientMessage):
    """Aim the shaft at a path point by the next click, or leave its direction open."""

    type: Literal["shaft.aim", "shaft.clear"]
    item_id: Identifier


class RollShaft(ClientMessage):
    """Turn of a bent tool about its shaft at a path point in degrees; none leaves it open."""

    type: Literal["shaft.roll"]
    item_id: Identifier
    roll_deg: Roll | None = None


COMMANDS: tuple[type[ClientMessage], ...] = (SuggestionCommand, HideSuggestion, ShaftCommand, RollShaft)
