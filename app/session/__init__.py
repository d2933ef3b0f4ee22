"""The page's session: one websocket per tab, commands in, a view model out.

A tab owns a :class:`~app.session.client_session.ClientSession`; what several tabs share is a
:class:`~app.drives.shared_drive.SharedDrive` with the lease of its handle.
Callbacks of the websocket and of the scene only queue requests; a session's own thread answers them in order.
"""

from app.session.client_sessions import ClientSessions
from app.session.router import router

__all__ = ["ClientSessions", "router"]
