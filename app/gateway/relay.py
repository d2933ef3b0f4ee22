"""Relay of the scene's WebSocket between a browser tab and viser, without storage.

Backpressure passes in both directions, so a slow browser delays only its own picture: viser then keeps the newest value
of every property and drops the rest. Messages of a browser are rate-limited; one that keeps sending more is
disconnected.
"""

import asyncio
import contextlib

from fastapi import APIRouter
from starlette.responses import JSONResponse, Response
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from app.error_shape import error_body
from app.gateway.scene_messages import is_allowed
from app.gateway.scene_page import scene_page
from app.gateway.scene_server import SUBPROTOCOL, SceneServer, TabRefused

MAX_PER_SECOND = 100  # messages of one scene; a camera and a drag send 20 each
BURST = 100
FLOOD_S = 5.0  # a browser that exceeds the rate for this long is disconnected
RETRY_AFTER_S = 15
_POLICY_VIOLATION = 1008
_GOING_AWAY = 1001
_FLOOD = 4429
_REASONS = {
    _POLICY_VIOLATION: "this type of message is not allowed",
    _GOING_AWAY: "the scene has ended",
    _FLOOD: f"more than {MAX_PER_SECOND} messages a second are not taken; try again in {RETRY_AFTER_S} s",
}


class Pace:
    """Rate limit: at most `rate` messages per second on average, and `burst` at once."""

    def __init__(self, rate: float, burst: int) -> None:
        self._interval, self._slack = 1.0 / rate, burst / rate
        self._due = 0.0

    def wait_s(self, now: float) -> float:
        """Return the time to wait in s after the message that passed at the time `now` in s."""
        self._due = max(self._due, now - self._slack) + self._interval
        return max(0.0, self._due - now)


def scene_router(scene_server: SceneServer) -> APIRouter:
    """Routes /scene/ (viser's client) and /scene/ws?tab=... (its WebSocket)."""
    router = APIRouter(include_in_schema=False)

    @router.get("/scene/")
    async def page() -> Response:
        return Response(scene_page(), media_type="text/html")

    @router.websocket("/scene/ws")
    async def relay(websocket: WebSocket) -> None:
        await _relay(websocket, scene_server)

    return router


async def _relay(websocket: WebSocket, scene_server: SceneServer) -> None:
    if SUBPROTOCOL not in websocket.scope["subprotocols"]:
        message = f"The scene speaks {SUBPROTOCOL} only; reload the page."
        await websocket.send_denial_response(JSONResponse(error_body("subprotocol_refused", message), 400))
        return
    try:
        async with scene_server.connection(websocket.query_params.get("tab", "")) as upstream:
            await websocket.accept(subprotocol=SUBPROTOCOL)
            code = await _run_both_ways(websocket, upstream)
    except TabRefused as refusal:
        body = error_body(refusal.code, str(refusal))
        again = {"Retry-After": str(RETRY_AFTER_S)} if refusal.status == 503 else None
        await websocket.send_denial_response(JSONResponse(body, refusal.status, again))
        return
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # the browser may have closed it already
        await websocket.close(code, _REASONS[code])


async def _run_both_ways(websocket: WebSocket, upstream: ClientConnection) -> int:
    """Relay until one side ends; return the close code for the browser."""
    ways = [
        asyncio.create_task(_from_browser(websocket, upstream)),
        asyncio.create_task(_from_viser(websocket, upstream)),
    ]
    try:
        done, _ = await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        return max(way.result() for way in done)
    finally:
        for way in ways:
            way.cancel()
        await asyncio.gather(*ways, return_exceptions=True)


async def _from_browser(websocket: WebSocket, upstream: ClientConnection) -> int:
    pace, kept_up = Pace(MAX_PER_SECOND, BURST), asyncio.get_running_loop().time()
    with contextlib.suppress(ConnectionClosed):
        while True:
            message = await websocket.receive()
            if message["type"] == "websocket.disconnect":
                break
            data = message.get("bytes")
            if data is None or not is_allowed(data):
                return _POLICY_VIOLATION
            await upstream.send(data)
            wait_s = pace.wait_s(now := asyncio.get_running_loop().time())
            if wait_s == 0.0:
                kept_up = now
            elif now - kept_up > FLOOD_S:
                return _FLOOD
            await asyncio.sleep(wait_s)
    return _GOING_AWAY


async def _from_viser(websocket: WebSocket, upstream: ClientConnection) -> int:
    with contextlib.suppress(ConnectionClosed, WebSocketDisconnect):
        while True:
            await websocket.send_bytes(await upstream.recv(decode=False))
    return _GOING_AWAY
