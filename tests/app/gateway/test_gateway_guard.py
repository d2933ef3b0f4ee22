"""The guard on every route, over real sockets (HAZ-27, HAZ-28)."""

import json

import pytest
from knocking import METHODS, Planner, all_routes, eventually, http_paths, kind, raw, websocket_paths
from starlette.routing import Mount, Route, WebSocketRoute


def test_the_enumeration_sees_every_kind_of_route(planner: Planner) -> None:
    assert {"/", "/docs", "/openapi.json", "/scene/", "/api/v1/echo/x", "/static"} <= set(http_paths(planner))
    assert {"/scene/ws", "/session"} <= set(websocket_paths(planner))
    assert all(issubclass(kind(route), Route | WebSocketRoute | Mount) for route in all_routes(planner.app.routes))


def test_every_http_route_answers_401_without_token(planner: Planner) -> None:
    for path in http_paths(planner):
        for method in METHODS:
            answer = planner.http(method, path)
            assert answer.status == 401, (method, path)
            if method != "HEAD":
                assert json.loads(answer.body)["error"]["code"] == "token_required"


def test_every_websocket_answers_401_without_token(planner: Planner) -> None:
    for path in websocket_paths(planner):
        answer = planner.handshake(f"{path}?tab=abcdefgh", ("Origin", planner.origin))
        assert answer.status == 401, path
        assert json.loads(answer.body)["error"]["code"] == "token_required"


def test_the_token_opens_every_route(planner: Planner) -> None:
    for path in http_paths(planner):
        assert planner.http("GET", path, planner.bearer).status not in (401, 403), path
    for path in ("/scene/ws?tab=opens-all-1", "/session"):
        assert planner.handshake(path, planner.cookie, ("Origin", planner.origin)).status == 101, path


def foreign_names(planner: Planner) -> list[tuple[str, str | None]]:
    """Pairs of Host and Origin that are nearly right."""
    own, port = planner.host, planner.port
    hosts = [
        "", "127.0.0.1", "localhost", f"127.0.0.1:{port + 1}", f"127.0.0.2:{port}", f"0.0.0.0:{port}",
        f"[::1]:{port}", f"evil.example:{port}", f"127.0.0.1.evil.example:{port}", f"localhost.:{port}",
        f"LOCALHOST:{port}", f"evil@127.0.0.1:{port}", f"127.0.0.1:{port}.evil.example", f"127.1:{port}",
        f"2130706433:{port}", f"127.0.0.1:{port},evil.example", f"127.0.0.1:0{port}",
    ]  # fmt: skip
    origins = [
        "null", "", "http://evil.example", f"https://{own}", f"http://127.0.0.1:{port + 1}", "http://127.0.0.1",
        f"http://localhost:{port}", f"http://evil.example:{port}", f"http://{own}.evil.example", f"http://{own}/",
        f"HTTP://{own}", f"ws://{own}", "file://", f"http://{own} http://evil.example", f"http://[::1]:{port}",
    ]  # fmt: skip
    return [(host, None) for host in hosts] + [(own, origin) for origin in origins]


def test_foreign_host_or_origin_is_refused_with_the_right_token(planner: Planner) -> None:
    pairs = foreign_names(planner)
    assert len(pairs) >= 30
    for host, origin in pairs:
        named = [planner.cookie] if origin is None else [planner.cookie, ("Origin", origin)]
        for method, path in (("GET", "/"), ("POST", "/api/v1/echo/x"), ("GET", f"/?token={planner.settings.token}")):
            answer = planner.http(method, path, *named, host=host)
            # An HTTP/1.1 request without any Host is malformed before it is foreign.
            assert answer.status == (400 if host == "" else 403), (method, host, origin)
        if host:
            for path in ("/scene/ws?tab=abcdefgh", "/session"):
                assert planner.handshake(path, *named, host=host).status == 403, (path, host, origin)


def test_a_tunnel_from_another_port_is_told(planner: Planner) -> None:
    """Of our own names only: another page learns nothing of the planner."""
    for host in (f"localhost:{planner.port + 1}", "127.0.0.1:9", "localhost"):
        error = json.loads(planner.http("GET", "/api/v1/echo/x", planner.cookie, host=host).body)["error"]
        assert error["code"] == "host_refused"
        assert f"ssh -L {planner.port}:127.0.0.1:{planner.port}" in error["message"], host
    for host in (f"evil.example:{planner.port + 1}", "127.0.0.2:9", f"evil@localhost:{planner.port}"):
        error = json.loads(planner.http("GET", "/api/v1/echo/x", planner.cookie, host=host).body)["error"]
        assert str(planner.port) not in error["message"], host


OTHER_SITES = ("same-site", "cross-site", "", "same-origin, same-site", "SAME-ORIGIN")
NAVIGATION = (("Sec-Fetch-Mode", "navigate"), ("Sec-Fetch-Dest", "document"))


def test_another_port_of_the_machine_cannot_make_the_planner_work(planner: Planner) -> None:
    """A page of http://127.0.0.1:OTHER is 'same-site': the browser sends it our cookie and names no Origin in a GET."""
    for site in OTHER_SITES:
        for path in http_paths(planner):
            for how in ((), (("Sec-Fetch-Mode", "no-cors"), ("Sec-Fetch-Dest", "image")), NAVIGATION):
                if path == "/" and how == NAVIGATION:
                    continue
                answer = planner.http("GET", path, planner.cookie, ("Sec-Fetch-Site", site), *how)
                assert answer.status == 403, (site, path, how)
                assert json.loads(answer.body)["error"]["code"] == "site_refused"
        for path in websocket_paths(planner):
            named = (planner.cookie, ("Origin", planner.origin), ("Sec-Fetch-Site", site))
            assert planner.handshake(path, *named).status == 403, (site, path)
    twice = (("Sec-Fetch-Site", "same-origin"), ("Sec-Fetch-Site", "cross-site"))
    assert planner.http("GET", "/docs", planner.cookie, *twice).status == 403


def test_a_link_elsewhere_opens_the_page_and_nothing_more(planner: Planner) -> None:
    for site in ("same-site", "cross-site"):
        link = (("Sec-Fetch-Site", site), *NAVIGATION)
        assert planner.http("GET", "/", planner.cookie, *link).status == 200
        assert planner.http("GET", f"/?token={planner.settings.token}", *link).status == 303
        for method in ("HEAD", "OPTIONS", "POST"):
            assert planner.http(method, "/", planner.cookie, *link).status == 403, method
        framed = (("Sec-Fetch-Site", site), ("Sec-Fetch-Mode", "navigate"), ("Sec-Fetch-Dest", "iframe"))
        assert planner.http("GET", "/", planner.cookie, *framed).status == 403
        assert planner.http("GET", f"/?token={planner.settings.token}", *framed).status == 403


def test_the_page_itself_and_a_typed_address_reach_everything(planner: Planner) -> None:
    for site in ("same-origin", "none"):
        for path in http_paths(planner):
            assert planner.http("GET", path, planner.cookie, ("Sec-Fetch-Site", site)).status not in (401, 403), path


def test_localhost_is_a_name_of_the_loopback_address(planner: Planner) -> None:
    host = f"localhost:{planner.port}"
    assert planner.http("POST", "/api/v1/echo/x", planner.cookie, ("Origin", f"http://{host}"), host=host).status == 200


def test_a_browser_must_name_its_origin_to_change_anything(planner: Planner) -> None:
    for method in ("POST", "PUT", "PATCH", "DELETE"):
        assert planner.http(method, "/api/v1/echo/x", planner.cookie).status == 403
        assert planner.http(method, "/api/v1/echo/x", planner.cookie, ("Origin", planner.origin)).status == 200
    assert planner.handshake("/session", planner.cookie).status == 403
    assert planner.handshake("/session", planner.bearer).status == 101  # a script has no origin and no cookie


def test_wrong_tokens(planner: Planner) -> None:
    token, name = planner.settings.token, f"vfix_token_{planner.port}"
    wrong = [
        [("Authorization", f"Bearer {token}x")],
        [("Authorization", f"Bearer {token[:-1]}")],
        [("Authorization", f"Basic {token}")],
        [("Authorization", token)],
        [("Authorization", "Bearer ")],
        [("Authorization", "Bearer \xff\xfe")],
        [planner.bearer, planner.bearer],
        [("Authorization", "Bearer x"), planner.cookie],
        [("Cookie", f"vfix_token={token}")],
        [("Cookie", f"vfix_token_{planner.port + 1}={token}")],
        [("Cookie", f"{name}=")],
        [("Cookie", f"{name}={token.swapcase()}")],
    ]
    for headers in wrong:
        assert planner.http("GET", "/", *headers).status == 401, headers
    for path in ("/docs", "/api/v1/echo/x", "/scene/"):
        assert planner.http("GET", f"{path}?token={token}").status == 401, "the address opens the page only"


def test_the_address_trades_its_token_for_a_cookie(planner: Planner) -> None:
    answer = planner.http("GET", f"/?token={planner.settings.token}")
    assert answer.status == 303
    assert answer.headers["Location"] == "/"
    cookie, *attributes = answer.headers["Set-Cookie"].split("; ")
    assert cookie == f"vfix_token_{planner.port}={planner.settings.token}"
    assert {part.lower() for part in attributes} == {"httponly", "path=/", "samesite=lax"}
    page = planner.http("GET", "/", ("Cookie", cookie))
    assert page.status == 200
    assert planner.settings.token.encode() not in page.body


@pytest.mark.parametrize("query", ["token=", "token=x", "token={t}x", "token={t}&token={t}", "token=%00"])
def test_a_wrong_address_leaves_no_cookie(planner: Planner, query: str) -> None:
    answer = planner.http("GET", "/?" + query.format(t=planner.settings.token), ("Accept", "text/html"))
    assert answer.status == 401
    assert "Set-Cookie" not in answer.headers
    assert b"This planner is locked" in answer.body
    assert f"http://127.0.0.1:{planner.port}/?token=".encode() in answer.body


def test_a_browser_without_token_reads_a_page(planner: Planner) -> None:
    answer = planner.http("GET", "/", ("Accept", "text/html,*/*"))
    assert answer.status == 401
    assert answer.headers["Content-Type"].startswith("text/html")
    assert b"the address that the planner printed" in answer.body


def test_security_headers_are_on_every_answer(planner: Planner) -> None:
    for path in http_paths(planner):
        for credentials in ((), (planner.bearer,)):
            headers = planner.http("GET", path, *credentials).headers
            assert headers["X-Content-Type-Options"] == "nosniff"
            assert headers["Referrer-Policy"] == "no-referrer"
            assert "frame-ancestors 'self'" in headers["Content-Security-Policy"]
            assert headers["Cache-Control"] in ("no-store", "no-cache")
            assert ("unsafe-eval" in headers["Content-Security-Policy"]) == path.startswith("/scene/")
    refused = planner.http("GET", "/", host="evil.example; script-src *").headers
    assert "evil" not in refused["Content-Security-Policy"]


@pytest.mark.parametrize(
    "request_text",
    [
        "GET / HTTP/1.1\r\nHost: {host}\r\nHost: evil.example\r\n{bearer}\r\n\r\n",
        "GET / HTTP/1.1\r\nHost: evil.example\r\nX-Forwarded-Host: {host}\r\n{bearer}\r\n\r\n",
        "GET http://{host}/ HTTP/1.1\r\nHost: evil.example\r\n{bearer}\r\n\r\n",
        "GET / HTTP/1.0\r\n{bearer}\r\n\r\n",
        "GET /scene/ws HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\n\r\n",
        "GET /\x00 HTTP/1.1\r\nHost: {host}\r\n\r\n",
        "POST / HTTP/1.1\r\nHost: {host}\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        "CONNECT 127.0.0.1:22 HTTP/1.1\r\nHost: {host}\r\n\r\n",
        "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n",
    ],
)
def test_raw_attempts_are_refused(planner: Planner, request_text: str) -> None:
    text = request_text.format(host=planner.host, bearer=": ".join(planner.bearer))
    assert raw(planner.port, text.encode("latin-1")).status in (400, 401, 403)


def test_the_list_of_routes_needs_no_other_host(planner: Planner) -> None:
    page = planner.http("GET", "/docs", planner.bearer).body.decode()
    assert "/api/v1/echo/{word}" in page
    assert "<script" not in page
    assert "http" not in page.replace("HTTPS_PROXY", "").lower().split("<body>")[1]


def test_errors_have_one_shape(planner: Planner) -> None:
    for method, path, status, code in (
        ("GET", "/no/such/page", 404, "not_found"),
        ("POST", "/docs", 405, "method_not_allowed"),
    ):
        answer = planner.http(method, path, planner.bearer)
        assert answer.status == status
        assert json.loads(answer.body)["error"]["code"] == code


def test_an_unexpected_error_says_nothing_of_the_data(planner: Planner, caplog: pytest.LogCaptureFixture) -> None:
    answer = planner.http("GET", "/api/v1/broken", planner.bearer)
    assert answer.status == 500
    assert json.loads(answer.body)["error"]["code"] == "internal_error"
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    eventually(lambda: "ValueError" in caplog.text)  # the answer goes out before the log is written
    assert "Jane" not in caplog.text
    assert b"Jane" not in answer.body
