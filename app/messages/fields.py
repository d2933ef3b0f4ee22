"""Fields of commands, bounded and finite (HAZ-05), and the base class of all commands."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

Identifier = Annotated[str, StringConstraints(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_.\-]+$")]
Name = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=120)]
Coordinate = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]  # [mm]
Position = tuple[Coordinate, Coordinate, Coordinate]  # LPS [mm]
Direction = Literal[-1, 0, 1]
Revision = Annotated[int, Field(ge=0, le=2**53)]
RequestId = Annotated[int, Field(ge=0, le=2**53)]


class ClientMessage(BaseModel):
    """A request of a client; ``id`` asks for a reply.

    urgent: answered at once on the connection's thread, without a reply, never queued behind other work.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    urgent: ClassVar[bool] = False
    id: RequestId | None = None

    def stream(self) -> str | None:
        """The name of the stream that this command belongs to, of which only the newest counts; None outside of one."""
        return None
