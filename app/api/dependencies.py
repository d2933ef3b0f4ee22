"""What every router needs: the services, errors with their own status, and identifiers that are checked."""

from collections.abc import Callable, Coroutine
from typing import Annotated, Any, cast

from fastapi import Depends, Path, Request, Response
from fastapi.responses import JSONResponse
from fastapi.routing import APIRoute
from pydantic import BaseModel, ConfigDict

from app.error_shape import error_body, error_code
from app.services import Services
from app.services.errors import NotFound, PlanConflict, PlanLocked, PointsUnclear, TooLarge
from app.store.files import StorageError
from vfix_engine.errors import FrameError, VfixError

_STATUS: dict[type[VfixError], int] = {
    NotFound: 404,
    PlanConflict: 409,
    PlanLocked: 409,
    TooLarge: 413,
    FrameError: 422,
    PointsUnclear: 422,
    StorageError: 507,
}


class ServiceRoute(APIRoute):
    """A route that answers the services' refusals with a status of their own; the gateway answers all others."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        handle = super().get_route_handler()

        async def handler(request: Request) -> Response:
            try:
                return await handle(request)
            except tuple(_STATUS) as error:
                status = next(status for kind, status in _STATUS.items() if isinstance(error, kind))
                return JSONResponse(error_body(error_code(error), str(error), error_details(error)), status)

        return handler


def error_details(error: VfixError) -> dict[str, list[str]] | None:
    """What a client needs beyond the words: which of 'frame', 'unit' and 'points_as' it has to name."""
    if isinstance(error, PointsUnclear):
        return {"missing": ["points_as"]}
    return {"missing": list(error.missing)} if isinstance(error, FrameError) and error.missing else None


def _services(request: Request) -> Services:
    return cast(Services, request.app.state.services)


ServicesDep = Annotated[Services, Depends(_services)]
Identifier = Annotated[str, Path(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_.\-]+$")]


class ErrorWords(BaseModel):
    """What went wrong."""

    code: str
    message: str
    details: Any = None


class ErrorPublic(BaseModel):
    """The shape of every error."""

    error: ErrorWords


class Wish(BaseModel):
    """Base of what clients send: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


ERRORS: dict[int | str, dict[str, Any]] = {
    status: {"model": ErrorPublic, "description": text}
    for status, text in {404: "Not there", 409: "Changed or locked", 413: "Too large", 422: "Refused"}.items()
}
