"""The scene's server: viser on a loopback port, reached only through the relay, paired with browser tabs."""

import contextlib
import hmac
import http
import io
import logging
import re
import secrets
import threading
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor

import viser
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request
from websockets.typing import Subprotocol

from app.gateway.inner_lock import locked_servers
from app.kit.prompt_threads import PROMPT_THREADS
from app.session.client_sessions import MAX_PAGES
from vfix_engine.error_places import error_places

SUBPROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
MAX_MESSAGE_BYTES = 64 * 2**20
MAX_TABS = MAX_PAGES
_SECRET_HEADER = "X-Vfix-Relay"
_TAB_HEADER = "X-Vfix-Tab"
_TAB_PATTERN = re.compile(r"[A-Za-z0-9_-]{8,64}")
_LOG = logging.getLogger(__name__)

TabConnected = Callable[[str, viser.ClientHandle], None]
TabGone = Callable[[str], None]


class TabRefused(Exception):
    """A tab is refused a scene, with the HTTP status `status`."""

    def __init__(self, status: int, code: str, message: str) -> None:
        super().__init__(message)
        self.status, self.code = status, code


class _PrivateViser(viser.ViserServer):
    """viser without its public share tunnel, which a client could request by a single message even without a button."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        _LOG.warning("a request to share the scene publicly was refused")
        return None

    def disconnect_share_url(self) -> None:
        """Do nothing: nothing is shared."""


class SceneServer:
    """Starts viser, admits only the relay, and maps browser tabs to viser clients.

    A tab is identified by a random word that the page chooses at each load. One connection at a time uses it; another
    one with the same word is refused while the first exists.
    Callbacks run one after another on a separate thread; that of a tab's connection runs before that of its end.
    """

    def __init__(self) -> None:
        self._secret = secrets.token_urlsafe(32)
        self._lock = threading.Lock()
        self._held: set[str] = set()
        self._clients: dict[str, viser.ClientHandle] = {}
        self._connected_callbacks: list[TabConnected] = []
        self._gone_callbacks: list[TabGone] = []
        self._dispatcher = ThreadPoolExecutor(max_workers=1, thread_name_prefix="scene-tabs")
        # viser prints its inner address, which would mix with the output of a command.
        with locked_servers(self._admit), contextlib.redirect_stdout(io.StringIO()):
            self.viser: viser.ViserServer = _PrivateViser(host="127.0.0.1", port=0, verbose=False)
        self.viser.gui.configure_theme(show_logo=False, show_share_button=False, control_layout="floating")
        self.viser.get_event_loop().call_soon_threadsafe(PROMPT_THREADS.enrol)
        self.viser.on_client_connect(self._client_connected)
        self.viser.on_client_disconnect(self._client_gone)

    @property
    def port(self) -> int:
        """Loopback port of the inner server."""
        return self.viser.get_port()

    def client_for(self, tab: str) -> viser.ClientHandle | None:
        """Return viser's client of a browser tab, or None while it has none."""
        with self._lock:
            return self._clients.get(tab)

    def tabs(self) -> dict[str, viser.ClientHandle]:
        """Return every tab that has a scene now."""
        with self._lock:
            return dict(self._clients)

    def on_tab_connected(self, callback: TabConnected) -> None:
        """Call `callback(tab, client)` when a tab's scene is ready; the scene is empty and has to be filled."""
        self._connected_callbacks.append(callback)

    def on_tab_gone(self, callback: TabGone) -> None:
        """Call `callback(tab)` when a tab's scene has ended."""
        self._gone_callbacks.append(callback)

    @contextlib.asynccontextmanager
    async def connection(self, tab: str) -> AsyncIterator[ClientConnection]:
        """Open the relay's connection to viser for a tab. Raises TabRefused."""
        self._claim(tab)
        try:
            async with connect(
                f"ws://127.0.0.1:{self.port}/",
                subprotocols=[SUBPROTOCOL],
                additional_headers={_SECRET_HEADER: self._secret, _TAB_HEADER: tab},
                compression=None,
                max_size=MAX_MESSAGE_BYTES,
                max_queue=4,
                proxy=None,
            ) as upstream:
                yield upstream
        finally:
            with self._lock:
                self._held.discard(tab)

    def stop(self) -> None:
        """End every scene and close the inner port."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.viser.stop()
        self._dispatcher.shutdown(wait=True)

    def _claim(self, tab: str) -> None:
        if _TAB_PATTERN.fullmatch(tab) is None:
            raise TabRefused(400, "tab_invalid", "A tab is 8 to 64 letters, digits, '-' or '_'.")
        with self._lock:
            if tab in self._held:
                raise TabRefused(409, "tab_taken", "Another connection holds the scene of this tab.")
            if len(self._held) >= MAX_TABS:
                raise TabRefused(503, "too_many_tabs", f"{MAX_TABS} scenes are open already; close one.")
            self._held.add(tab)

    def _admit(self, connection: ServerConnection, request: Request) -> http.HTTPStatus | None:
        if request.headers.get_all("Host") != [f"127.0.0.1:{connection.local_address[1]}"]:
            return http.HTTPStatus.FORBIDDEN
        if request.headers.get_all("Origin"):
            return http.HTTPStatus.FORBIDDEN
        offered = request.headers.get_all(_SECRET_HEADER)
        if len(offered) != 1 or not hmac.compare_digest(
            offered[0].encode("utf-8", "surrogateescape"), self._secret.encode()
        ):
            return http.HTTPStatus.UNAUTHORIZED
        return None

    def _tab_of(self, client: viser.ClientHandle) -> str:
        # viser keeps the handshake of each live connection; a test ties this private name to the pinned version.
        request = self.viser._websock_server._live_connections[client.client_id].request
        if request is None:
            raise RuntimeError(f"viser's client {client.client_id} has no handshake.")
        return request.headers[_TAB_HEADER]

    async def _client_connected(self, client: viser.ClientHandle) -> None:
        tab = self._tab_of(client)
        with self._lock:
            self._clients[tab] = client
        for callback in self._connected_callbacks:
            self._dispatch(callback, tab, client)

    async def _client_gone(self, client: viser.ClientHandle) -> None:
        with self._lock:
            tab = next((tab for tab, known in self._clients.items() if known is client), None)
            if tab is not None:
                del self._clients[tab]
        if tab is not None:
            for callback in self._gone_callbacks:
                self._dispatch(callback, tab)

    def _dispatch(self, callback: Callable[..., None], *arguments: object) -> None:
        def run() -> None:
            try:
                callback(*arguments)
            except Exception as error:
                _LOG.error("a callback of the scene's tabs failed: %s", error_places(error))

        with contextlib.suppress(RuntimeError):  # the planner is stopping and takes no more calls
            self._dispatcher.submit(run)
