"""Relay of the scene's WebSocket between a browser tab and viser: bytes both ways, nothing kept.

Each side waits for the other, so a slow browser holds back its own picture only: viser then keeps the newest
value of every property and drops the rest.
"""

import asyncio
import contextlib

import msgspec
from fastapi import APIRouter
from starlette.responses import JSONResponse, Response
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from app.error_shape import error_body
from app.gateway.scene_page import scene_page
from app.gateway.scene_server import SUBPROTOCOL, SceneServer, TabRefused

# What a picture has to say to its server. Uploads, browser storage and the public share tunnel are not among it.
ALLOWED_MESSAGES = frozenset(
    {
        "ViewerCameraMessage",
        "ScenePointerMessage",
        "SceneNodeClickMessage",
        "SceneNodeDragMessage",
        "TransformControlsUpdateMessage",
        "TransformControlsDragStartMessage",
        "TransformControlsDragEndMessage",
        "GuiUpdateMessage",
        "GuiButtonHoldMessage",
        "CommandTriggerMessage",
        "GetRenderResponseMessage",
    }
)
_POLICY_VIOLATION = 1008
_GOING_AWAY = 1001


class _Envelope(msgspec.Struct):
    """The part of viser's message that the relay reads."""

    type: str


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
        await websocket.send_denial_response(JSONResponse(body, refusal.status))
        return
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # the browser was first
        await websocket.close(code)


async def _run_both_ways(websocket: WebSocket, upstream: ClientConnection) -> int:
    """Relay until one side ends; returns the close code for the browser."""
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
    with contextlib.suppress(ConnectionClosed):
        while True:
            message = await websocket.receive()
            if message["type"] == "websocket.disconnect":
                break
            data = message.get("bytes")
            if data is None or not _is_allowed(data):
                return _POLICY_VIOLATION
            await upstream.send(data)
    return _GOING_AWAY


async def _from_viser(websocket: WebSocket, upstream: ClientConnection) -> int:
    with contextlib.suppress(ConnectionClosed, WebSocketDisconnect):
        while True:
            await websocket.send_bytes(await upstream.recv(decode=False))
    return _GOING_AWAY


def _is_allowed(data: bytes) -> bool:
    try:
        return msgspec.msgpack.decode(data, type=_Envelope).type in ALLOWED_MESSAGES
    except msgspec.MsgspecError:
        return False
