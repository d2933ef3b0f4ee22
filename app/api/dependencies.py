"""Shared by all routers: services, error responses, checked identifiers."""

from typing import Annotated, Any, cast

from fastapi import Depends, Header, Path, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from app.api.error_statuses import ERROR_STATUSES
from app.operations.rest import expected_revision
from app.services import Services


def _services(request: Request) -> Services:
    return cast(Services, request.app.state.services)


ServicesDep = Annotated[Services, Depends(_services)]
Identifier = Annotated[str, Path(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_.\-]+$")]


class Condition:
    """Condition on a document's revision: If-Match of the request, ETag of the response."""

    def __init__(
        self,
        response: Response,
        if_match: Annotated[
            str | None, Header(description="the ETag that was seen; when the document has moved on, 412 and no change")
        ] = None,
    ) -> None:
        self._response, self._if_match = response, if_match
        expected_revision(if_match, None)

    def expected(self, revision: int | None = None) -> int | None:
        """The expected revision; revision: that in the body of the request."""
        return expected_revision(self._if_match, revision)

    def tell(self, revision: int) -> None:
        """Set the ETag of the response."""
        self._response.headers["ETag"] = f'"{revision}"'


ConditionDep = Annotated[Condition, Depends()]


class ErrorWords(BaseModel):
    """What went wrong."""

    code: str
    message: str
    details: Any = None


class ErrorPublic(BaseModel):
    """The format of all errors."""

    error: ErrorWords


Number = Annotated[float, Field(allow_inf_nan=False, strict=True)]  # a finite number, no text and no boolean
Flag = Annotated[bool, Field(strict=True)]  # true or false, no number and no text


class RequestBody(BaseModel):
    """Base of request bodies: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


ERRORS: dict[int | str, dict[str, Any]] = {
    line.status: {"model": ErrorPublic, "description": line.words}
    for line in sorted(ERROR_STATUSES, key=lambda line: line.status)
}
