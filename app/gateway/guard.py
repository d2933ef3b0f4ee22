"""Guard in front of every route, HTTP and WebSocket alike: exact Host, exact Origin, token. Deny by default.

Order of the checks, each with its status:
1. Host must be exactly one of the planner's, else 403 (DNS rebinding).
2. An Origin, if there is one, must be exactly the page's, else 403; 'null' is refused too.
3. A browser request from another site or another port of this machine (`Sec-Fetch-Site`) gets 403, unless the user
   navigates to the page itself: cookies do not depend on ports, so a GET from there carries the planner's cookie and
   needs no Origin.
4. The token must be present as a cookie, as `Authorization: Bearer`, or once as `/?token=`, else 401.
5. A browser's WebSocket or changing request (known by its cookie) must carry an Origin, else 403.
"""

import hmac
from dataclasses import dataclass
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import cookie_parser
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.error_shape import error_body
from app.gateway.addresses import allowed_hosts, base_url, cookie_name, with_port
from app.gateway.headers import secure
from app.settings import Settings

_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
_LOGIN_PATH = "/"


@dataclass(frozen=True)
class AccessRefusal:
    """Reason for which a request is refused."""

    status: int
    code: str
    message: str


_HOST_REFUSED = AccessRefusal(403, "host_refused", "This address is not one the planner answers to.")
_ORIGIN_REFUSED = AccessRefusal(403, "origin_refused", "Requests from other pages are refused.")
_SITE_REFUSED = AccessRefusal(403, "site_refused", "Other sites and ports may open the planner's first page only.")
_TOKEN_MISSING = AccessRefusal(
    401,
    "token_required",
    "Open the address that the planner printed; it carries the token.",
)
_TOKEN_WRONG = AccessRefusal(
    401,
    "token_wrong",
    "This token is not the one of the running planner; paste the address that it printed into the address bar.",
)


class Guard:
    """ASGI application that passes to `app` only requests with valid Host, Origin and token."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._hosts = allowed_hosts(settings)
        self._token = settings.token.encode()
        self._cookie = cookie_name(settings)
        self._address = base_url(settings)
        self._port = settings.port
        self._other_port = AccessRefusal(
            403,
            "host_refused",
            f"The planner answers at port {settings.port} only. A tunnel to it needs the same port at both ends: "
            f"ssh -L {settings.port}:127.0.0.1:{settings.port} …, then open the address that the planner printed.",
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] not in ("http", "websocket"):
            raise RuntimeError(f"unknown kind of connection: {scope['type']}")
        headers = Headers(scope=scope)
        refusal = self._check_names(headers) or self._check_site(scope, headers)
        is_ours = refusal not in (_HOST_REFUSED, self._other_port)
        secured = _SecuredSend(send, scope["path"], headers["host"] if is_ours else None)
        if refusal is None and self._is_login(scope):
            await self._log_in(scope)(scope, receive, secured)
            return
        refusal = refusal or self._check_token(scope, headers)
        if refusal is None:
            await self._app(scope, receive, secured)
        elif scope["type"] == "http":
            await _refuse_http(refusal, headers, self._address)(scope, receive, secured)
        else:
            await _refuse_websocket(refusal, scope, receive, secured)

    def _check_names(self, headers: Headers) -> AccessRefusal | None:
        hosts, origins = headers.getlist("host"), headers.getlist("origin")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            is_tunnel = len(hosts) == 1 and with_port(hosts[0], self._port) in self._hosts
            return self._other_port if is_tunnel else _HOST_REFUSED
        if origins and origins != [f"http://{hosts[0]}"]:
            return _ORIGIN_REFUSED
        return None

    @staticmethod
    def _check_site(scope: Scope, headers: Headers) -> AccessRefusal | None:
        """Check `Sec-Fetch-Site`; browsers before 2023 and other clients do not send it, 'none' is a typed address."""
        sites = headers.getlist("sec-fetch-site")
        if not sites or sites in (["same-origin"], ["none"]):
            return None
        is_visit = (headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")) == ("navigate", "document")
        return None if is_visit and _is_page(scope) else _SITE_REFUSED

    def _check_token(self, scope: Scope, headers: Headers) -> AccessRefusal | None:
        offered = headers.getlist("authorization")
        if offered:
            scheme, _, token = offered[0].partition(" ")
            is_ours = len(offered) == 1 and scheme.lower() == "bearer" and self._matches(token)
            return None if is_ours else _TOKEN_WRONG
        token = cookie_parser(headers.get("cookie", "")).get(self._cookie, "")
        if not token:
            return _TOKEN_MISSING
        if not self._matches(token):
            return _TOKEN_WRONG
        changes = scope["type"] == "websocket" or scope["method"] not in _SAFE_METHODS
        return _ORIGIN_REFUSED if changes and "origin" not in headers else None

    def _matches(self, token: str) -> bool:
        return hmac.compare_digest(token.encode("utf-8", "surrogateescape"), self._token)

    @staticmethod
    def _is_login(scope: Scope) -> bool:
        return _is_page(scope) and "token" in _query(scope)

    def _log_in(self, scope: Scope) -> Response:
        """Replace the token of the address by a cookie, so that it does not stay in the address bar.

        SameSite=Lax, because with Strict a link from elsewhere would open the page without the cookie.
        """
        tokens = _query(scope)["token"]
        if len(tokens) != 1 or not self._matches(tokens[0]):
            return _refusal_page(_TOKEN_WRONG, self._address)
        response = RedirectResponse(_LOGIN_PATH, status_code=303)
        response.set_cookie(self._cookie, tokens[0], path="/", httponly=True, samesite="lax")
        return response


class _SecuredSend:
    """`send` that adds the security headers to every HTTP response."""

    def __init__(self, send: Send, path: str, host: str | None) -> None:
        self._send, self._path, self._host = send, path, host

    async def __call__(self, message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            secure(MutableHeaders(scope=message), self._path, self._host)
        await self._send(message)


def _is_page(scope: Scope) -> bool:
    return (scope["type"], scope.get("method"), scope["path"]) == ("http", "GET", _LOGIN_PATH)


def _query(scope: Scope) -> dict[str, list[str]]:
    return parse_qs(scope["query_string"].decode("latin-1"), keep_blank_values=True)


def _refuse_http(refusal: AccessRefusal, headers: Headers, address: str) -> Response:
    if "text/html" in headers.get("accept", ""):
        return _refusal_page(refusal, address)
    return _refusal_json(refusal)


def _refusal_json(refusal: AccessRefusal) -> JSONResponse:
    challenge = {"WWW-Authenticate": 'Bearer realm="vfix"'} if refusal.status == 401 else None
    return JSONResponse(error_body(refusal.code, refusal.message), refusal.status, headers=challenge)


def _refusal_page(refusal: AccessRefusal, address: str) -> HTMLResponse:
    return HTMLResponse(_PAGE.format(message=refusal.message, address=address), refusal.status)


async def _refuse_websocket(refusal: AccessRefusal, scope: Scope, receive: Receive, send: Send) -> None:
    """Refuse the handshake with the same status and body as over HTTP."""
    await receive()
    if "websocket.http.response" in scope.get("extensions", {}):
        await _refusal_json(refusal)(scope, receive, send)
    else:
        await send({"type": "websocket.close", "code": 1008, "reason": refusal.code})


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>vfix</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; background: #10161c; color: #dde5ec; margin: 0;
       min-height: 100vh; display: grid; place-items: center; }}
main {{ max-width: 30rem; padding: 2rem; }}
h1 {{ font-size: 1.3rem; }}
p {{ color: #a9b7c4; }}
code {{ background: #1d2731; padding: 0.1rem 0.35rem; border-radius: 4px; }}
</style></head>
<body><main><h1>This planner is locked</h1><p>{message}</p>
<p>The address looks like <code>{address}/?token=…</code>
and stands in the window in which the planner was started.</p></main></body></html>
"""
