"""Every error of a route leaves in the one JSON shape, and none shows a traceback."""

import logging

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse

from app.error_shape import error_body, error_code
from vfix_engine.errors import ControlError, InputError, VfixError

_LOG = logging.getLogger(__name__)


def install_error_answers(app: FastAPI) -> None:
    """Register the handlers; a router may register narrower ones of its own."""
    app.add_exception_handler(VfixError, _refused)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _unexpected)


async def _refused(_: Request, error: Exception) -> JSONResponse:
    status = 422 if isinstance(error, InputError) else 409 if isinstance(error, ControlError) else 400
    return JSONResponse(error_body(error_code(error), str(error)), status)


async def _invalid(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    details = [{"where": [str(part) for part in item["loc"]], "message": item["msg"]} for item in error.errors()]
    return JSONResponse(error_body("request_invalid", "The request does not have the form asked for.", details), 422)


async def _http(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    code = {404: "not_found", 405: "method_not_allowed", 413: "too_large"}.get(error.status_code, "refused")
    return JSONResponse(error_body(code, str(error.detail)), error.status_code, headers=error.headers)


async def _unexpected(request: Request, error: Exception) -> JSONResponse:
    # Neither the answer nor the log says what was in the request: it may be a patient's.
    _LOG.error("%s on %s %s", type(error).__name__, request.method, request.scope["route"].path)
    return JSONResponse(error_body("internal_error", "The planner met an error it did not expect."), 500)
