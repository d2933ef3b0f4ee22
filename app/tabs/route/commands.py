"""Commands of the Route tab, beside the operations on routes."""

from __future__ import annotations

from typing import Literal

from app.messages.fields import ClientMessage, Identifier


class OpenRoute(ClientMessage):
    type: Literal["route.open"]
    route_id: Identifier


class PickRouteEnd(ClientMessage):
    """The next click on the wall is the entry, or the end; '' for neither."""

    type: Literal["route.pick"]
    what: Literal["entry", "end", ""]


COMMANDS: tuple[type[ClientMessage], ...] = (OpenRoute, PickRouteEnd)
