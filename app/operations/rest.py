"""Operations as REST routes: a list and a document to read, and an address for what is done to it."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
from fastapi import APIRouter, Request, Response
from fastapi.exceptions import RequestValidationError
from msgspec import NODEFAULT
from starlette.concurrency import run_in_threadpool

from app.documents import Document
from app.operations.bodies import fields_of, read_operations
from app.operations.fields import Identifier, Revision
from app.operations.operation import Context, Operation
from app.operations.reading import Place, Unreadable, read
from app.operations.registry import specs
from app.operations.schema import object_schema, schemas_of
from app.operations.spec import DocumentSpec, titled
from vfix_engine.errors import InputError
from vfix_engine.json_text import parse_json

Schema = dict[str, Any]
Endpoint = Callable[[Request, Mapping[str, str], Any], Response]  # of the request, its path's values and its body
ServicesOf = Callable[[Request], Any]

_ETAG = re.compile(r'"(0|[1-9][0-9]{0,14})"')  # as they are made: 7 is no 07
_PARAMETER = re.compile(r"\{(\w+)\}")
_IDENTIFIER, _REVISION = (schemas_of([kind])[0][0] for kind in (Identifier, Revision | None))
_TEXT = {"anyOf": [{"type": "string"}, {"type": "null"}]}
_IF_MATCH = {
    "name": "if-match",
    "in": "header",
    "required": False,
    "schema": _TEXT,
    "description": "the ETag that was seen; when the document has moved on, 412 and no change",
}
_SEEN = {"name": "revision", "in": "query", "required": False, "schema": _REVISION}
_DELETED = {
    "name": "include_deleted",
    "in": "query",
    "required": False,
    "schema": {"type": "boolean", "default": False},
}


def expected_revision(if_match: str | None, said: int | None) -> int | None:
    """The revision that a client has seen: that of If-Match, or what it said otherwise. Raises InputError."""
    match = _ETAG.fullmatch(if_match or "")
    if match is None and if_match not in (None, "*"):
        raise InputError('If-Match must be * or one ETag: a revision in quotes, such as "7".')
    return _agreed(int(match[1]) if match else None, said, "If-Match")


def _agreed(one: int | None, other: int | None, where: str = "the address") -> int | None:
    """The revision that is said in two places, if any. Raises InputError where they differ."""
    if None not in (one, other) and one != other:
        raise InputError(f"{where} says revision {one} and the request {other}; say one.")
    return one if other is None else other


def addresses(spec: DocumentSpec) -> dict[tuple[str, str], list[type[Operation]]]:
    """The operations of a kind by method and path below /api/v1."""
    found: dict[tuple[str, str], list[type[Operation]]] = {}
    for operation in spec.operations:
        for method, path in spec.addresses(operation):
            found.setdefault((method, path), []).append(operation)
    return found


class OperationRoutes:
    """The routes of every kind of document, in `router`; `components` has the schemas that they refer to, by name."""

    def __init__(self, services_of: ServicesOf) -> None:
        """services_of: the planner's services, by the request."""
        self.router = APIRouter()
        self.components: dict[str, Schema] = {}
        self._services_of = services_of
        for spec in specs():
            self._add_kind(spec)

    def _add_kind(self, spec: DocumentSpec) -> None:
        of_case, own = f"/cases/{{case_id}}/{spec.path}", f"/{spec.path}/{{{spec.id}}}"
        public = self._schema(spec.answer)
        every = {"type": "array", "items": public}
        self._add(
            spec, "GET", of_case, f"The {spec.path} of a case, oldest first.", self._list(spec), every, [_DELETED]
        )
        self._add(spec, "GET", own, f"One {spec.kind.noun}, deleted or not.", self._show(spec), public, [_IF_MATCH])
        for (method, path), operations in addresses(spec).items():
            self._add_operations(spec, method, path, operations)

    def _add_operations(
        self, spec: DocumentSpec, method: str, path: str, operations: Sequence[type[Operation]]
    ) -> None:
        first, has_body = operations[0], method != "DELETE"
        extra: Schema = {}
        if has_body:
            in_path = _PARAMETER.findall(path)
            fields = {key: field for key, field in fields_of(operations).items() if key not in in_path}
            schema, components = object_schema(fields | {"revision": (Revision | None, None)})
            name = first.__name__ if len(operations) == 1 else f"Change{titled(_PARAMETER.findall(path)[-1])}"
            self.components |= components | {name: schema}
            needed = len(operations) > 1 or any(default is NODEFAULT for _, default in fields.values())
            content = {"application/json": {"schema": {"$ref": f"#/components/schemas/{name}"}}}
            extra = {"requestBody": {"content": content, "required": needed}}
        words = " ".join(inspect.cleandoc(operation.__doc__ or "") for operation in operations)
        words = f"One per request. {words}" if len(operations) > 1 else words
        answer = self._schema(first.answers or spec.answer)
        parameters = [_IF_MATCH] if has_body else [_IF_MATCH, _SEEN]
        endpoint = self._perform(spec, operations, has_body)
        self._add(spec, method, path, words, endpoint, answer, parameters, first.status, extra)

    def _schema(self, kind: type[Any]) -> Schema:
        (schema,), components = schemas_of([kind])
        self.components |= components
        return schema

    def _add(
        self,
        spec: DocumentSpec,
        method: str,
        path: str,
        words: str,
        endpoint: Endpoint,
        answer: Schema,
        parameters: Sequence[Schema],
        status: int = 200,
        extra: Schema | None = None,
    ) -> None:
        named = [
            {"name": name, "in": "path", "required": True, "schema": _IDENTIFIER} for name in _PARAMETER.findall(path)
        ]

        async def route(request: Request) -> Response:
            body = parsed(request, await request.body())
            in_path = {
                name: _or_refused(Identifier, value, ("path", name)) for name, value in request.path_params.items()
            }
            return await run_in_threadpool(endpoint, request, in_path, body)

        self.router.add_api_route(
            f"/{path.removeprefix('/')}",
            route,
            methods=[method],
            status_code=status,
            tags=[spec.path],
            description=words,
            operation_id=f"{method}_{path}",
            response_class=Response,
            responses={status: {"description": "Done", "content": {"application/json": {"schema": answer}}}},
            openapi_extra={"parameters": [*named, *parameters], **(extra or {})},
        )

    # -- what the routes do

    def _list(self, spec: DocumentSpec) -> Endpoint:
        def listed(request: Request, in_path: Mapping[str, str], body: Any) -> Response:
            context = spec.context(self._services_of(request))
            deleted = _or_refused(
                bool, request.query_params.get("include_deleted", "false"), ("query", "include_deleted"), strict=False
            )
            found = context.documents.of_case(in_path["case_id"], deleted)
            return _json([spec.answer_of(context.service, document) for document in found])

        return listed

    def _show(self, spec: DocumentSpec) -> Endpoint:
        def shown(request: Request, in_path: Mapping[str, str], body: Any) -> Response:
            expected_revision(request.headers.get("if-match"), None)
            context = spec.context(self._services_of(request))
            return _told(spec, context, context.documents.get(in_path[spec.id]))

        return shown

    def _perform(self, spec: DocumentSpec, operations: Sequence[type[Operation]], has_body: bool) -> Endpoint:
        def performed(request: Request, in_path: Mapping[str, str], body: Any) -> Response:
            own = {name: value for name, value in in_path.items() if name not in ("case_id", spec.id)}
            said = _without(body, own)
            seen = _or_refused(Revision | None, said.pop("revision", None), ("body", "revision"))
            if not has_body and (text := request.query_params.get("revision")) is not None:
                seen = _agreed(_or_refused(Revision, text, ("query", "revision"), strict=False), seen)
            try:
                found = read_operations(operations, said, ("body",), of_all=own)
            except Unreadable as error:
                raise _refused(error) from None
            if len(found) != 1:
                raise spec.kind.errors.refused(f"change one thing of a {spec.kind.noun} at a time, not {len(found)}.")
            context = spec.context(self._services_of(request), expected_revision(request.headers.get("if-match"), seen))
            return _done(spec, context, found[0], in_path)

        return performed


def _without(body: Mapping[str, Any], in_path: Mapping[str, str]) -> dict[str, Any]:
    """A body without what the address says. Raises RequestValidationError where the two differ."""
    if other := [name for name, value in in_path.items() if body.get(name, value) != value]:
        raise _refused(Unreadable([(("body", name), "The address says another one") for name in other]))
    return {name: value for name, value in body.items() if name not in in_path}


def parsed(request: Request, data: bytes) -> dict[str, Any]:
    """The JSON object of a body; empty where there is none. Raises RequestValidationError."""
    if not data:
        return {}
    kind = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if kind != "application/json" and not (kind.startswith("application/") and kind.endswith("+json")):
        raise _refused(Unreadable([(("body",), "the body is JSON, with the header Content-Type: application/json")]))
    try:
        body = parse_json(data)
    except ValueError as error:
        raise _refused(Unreadable([(("body",), str(error))])) from None
    if not isinstance(body, dict):
        raise _refused(Unreadable([(("body",), "the body is a JSON object")]))
    return body


def _done(spec: DocumentSpec, context: Context[Any, Any], operation: Operation, in_path: Mapping[str, str]) -> Response:
    document = operation.perform(context, in_path.get("case_id", ""), in_path.get(spec.id, ""))
    if operation.answers is None:
        return _told(spec, context, document, operation.status)
    return _json(operation.answer(context, document), operation.status, document)


def _told(spec: DocumentSpec, context: Context[Any, Any], document: Document[Any], status: int = 200) -> Response:
    return _json(spec.answer_of(context.service, document), status, document)


def _json(value: Any, status: int = 200, document: Document[Any] | None = None) -> Response:
    headers = {} if document is None else {"ETag": f'"{document.revision}"'}
    return Response(msgspec.json.encode(value), status, headers, "application/json")


def _or_refused(kind: Any, value: Any, where: Place, strict: bool = True) -> Any:
    """strict: false for a value out of an address, where all is text."""
    try:
        return read(kind, value, where, strict)
    except Unreadable as error:
        raise _refused(error) from None


def _refused(error: Unreadable) -> RequestValidationError:
    return RequestValidationError(
        [{"loc": where, "msg": words, "type": "value_error"} for where, words in error.problems]
    )
