"""Commands of the Drive tab, beside those of every drive."""

from __future__ import annotations

from typing import Literal

from app.drives import commands as drives
from app.messages.fields import ClientMessage


class TurnCamera(ClientMessage):
    """Straighten the links that bend, or turn the camera to all sides one after the other."""

    type: Literal["camera.straighten", "camera.look_round"]


COMMANDS: tuple[type[ClientMessage], ...] = (*drives.COMMANDS, drives.MoveAxes, TurnCamera)
