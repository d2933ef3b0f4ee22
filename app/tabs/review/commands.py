"""Commands of the Review tab."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.messages.fields import ClientMessage, Identifier

RunTime = Annotated[float, Field(ge=0.0, le=1e6, allow_inf_nan=False)]  # [s]


class ShowMoment(ClientMessage):
    """The moment of a run whose task is shown: polyps and labels as they were then. run null: of none."""

    type: Literal["review.moment"]
    run: Identifier | None
    t_s: RunTime = 0.0

    def stream(self) -> str:
        return self.type


COMMANDS: tuple[type[ClientMessage], ...] = (ShowMoment,)
