"""All errors of routes have one JSON format, without tracebacks."""

import contextlib
import logging

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from app.api.error_statuses import status_of
from app.error_shape import error_body, error_code, error_details
from app.kit.errors import DocumentConflict
from vfix_engine.error_places import error_places
from vfix_engine.errors import VfixError

_RETRY = {503: {"Retry-After": "5"}}
_MOST_DETAILS, _MOST_CHARACTERS = 20, 200  # bounds of a response, independent of the length of the request
_LOG = logging.getLogger(__name__)


def install_error_answers(app: FastAPI) -> None:
    """Register the handlers; a router may register more specific ones."""
    app.add_exception_handler(VfixError, _refused)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _unexpected)


async def _refused(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, VfixError)
    status = status_of(error)
    if isinstance(error, DocumentConflict) and "if-match" in request.headers:
        status = 412  # the request stated the revision by If-Match
    body = error_body(error_code(error), str(error), error_details(error))
    return JSONResponse(body, status, headers=_RETRY.get(status))


async def _invalid(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    wrong = error.errors()
    details = [
        {"where": [str(part)[:_MOST_CHARACTERS] for part in item["loc"]], "message": item["msg"][:_MOST_CHARACTERS]}
        for item in wrong[:_MOST_DETAILS]
    ]
    if len(wrong) > _MOST_DETAILS:
        details.append({"where": ["body"], "message": f"and {len(wrong) - _MOST_DETAILS} more"})
    return JSONResponse(error_body("request_invalid", "The request does not have the form asked for.", details), 422)


async def _http(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    code = {404: "not_found", 405: "method_not_allowed", 413: "too_large"}.get(error.status_code, "refused")
    return JSONResponse(error_body(code, str(error.detail)), error.status_code, headers=error.headers)


async def _unexpected(_: Request, __: Exception) -> JSONResponse:
    return JSONResponse(error_body("internal_error", "The planner met an error it did not expect."), 500)


class DiscreetErrors:
    """Logs the location of an unexpected error without its message and values, which may contain patient data."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await self._app(scope, receive, send)
        except Exception as error:
            if scope["type"] == "lifespan":
                raise
            _LOG.error("an error on a %s request: %s", scope["type"], error_places(error))
            if scope["type"] == "websocket":
                with contextlib.suppress(Exception):  # the connection may be gone already
                    await send({"type": "websocket.close", "code": 1011})
