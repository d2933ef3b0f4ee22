"""The addresses of REST before it had a version: they answer 410 and name the present one."""

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse
from starlette.websockets import WebSocket

from app.error_shape import error_body

router = APIRouter(include_in_schema=False)

_METHODS = ["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE"]


@router.api_route("/api/{rest:path}", methods=_METHODS)
async def moved(request: Request, rest: str) -> JSONResponse:
    """Include after every route that is there: it takes whatever is left below /api."""
    del request
    return _gone(rest)


@router.websocket("/api/{rest:path}")
async def moved_channel(websocket: WebSocket, rest: str) -> None:
    await websocket.receive()
    await websocket.send_denial_response(_gone(rest))


def _gone(rest: str) -> JSONResponse:
    if rest == "v1" or rest.startswith("v1/"):
        return JSONResponse(error_body("not_found", "Not Found"), 404)
    return JSONResponse(error_body("moved", f"REST is below /api/v1; ask for /api/v1/{rest:.200}."), 410)
