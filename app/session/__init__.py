"""The page's session: one websocket per tab, commands in, a view model out.

A tab owns a :class:`~app.session.workspace.Workspace`; what several tabs share (a rehearsal and the lease of its
handle) lives in :class:`~app.session.rehearsals.RehearsalRooms`.
Callbacks of the websocket and of the scene only queue requests; a workspace's own thread answers them in order.
"""

from app.session.hub import SessionHub
from app.session.router import router

__all__ = ["SessionHub", "router"]
