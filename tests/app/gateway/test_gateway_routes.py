"""The guard over every route that the planner really has: new ones are enumerated by themselves (HAZ-27, HAZ-28)."""

import json

from knocking import METHODS, Planner, http_paths, websocket_paths


def test_the_enumeration_sees_the_planner(whole_planner: Planner) -> None:
    paths = http_paths(whole_planner)
    assert {"/", "/docs", "/openapi.json", "/scene/", "/static", "/api/v1/cases", "/api/v1/plans"} <= set(paths)
    assert any(path.startswith("/tabs/") for path in paths)
    assert {"/scene/ws", "/session"} <= set(websocket_paths(whole_planner))
    described = {path.replace("{", "").replace("}", "") for path in whole_planner.app.openapi()["paths"]}
    assert len(described) <= len(http_paths(whole_planner))


def test_every_route_answers_401_without_token(whole_planner: Planner) -> None:
    for path in http_paths(whole_planner):
        for method in METHODS:
            answer = whole_planner.http(method, path)
            assert answer.status == 401, (method, path)
            if method != "HEAD":
                assert json.loads(answer.body)["error"]["code"] == "token_required"
    for path in websocket_paths(whole_planner):
        assert whole_planner.handshake(path, ("Origin", whole_planner.origin)).status == 401, path


def test_every_route_answers_403_to_foreign_names(whole_planner: Planner) -> None:
    foreign = f"evil.example:{whole_planner.port}"
    for path in http_paths(whole_planner):
        for method in METHODS:
            assert whole_planner.http(method, path, whole_planner.cookie, host=foreign).status == 403, (method, path)
            answer = whole_planner.http(method, path, whole_planner.cookie, ("Origin", "null"))
            assert answer.status == 403, (method, path)
    for path in websocket_paths(whole_planner):
        for origin in ("null", "http://evil.example", f"http://{foreign}"):
            assert whole_planner.handshake(path, whole_planner.cookie, ("Origin", origin)).status == 403, path
        assert whole_planner.handshake(path, whole_planner.cookie).status == 403, path


def test_changing_routes_want_the_page_s_origin(whole_planner: Planner) -> None:
    for path in http_paths(whole_planner):
        for method in ("POST", "PUT", "PATCH", "DELETE"):
            assert whole_planner.http(method, path, whole_planner.cookie).status == 403, (method, path)


def test_every_route_answers_403_to_pages_of_other_ports(whole_planner: Planner) -> None:
    elsewhere = ("Sec-Fetch-Site", "same-site")
    for path in http_paths(whole_planner):
        assert whole_planner.http("GET", path, whole_planner.cookie, elsewhere).status == 403, path
    for path in websocket_paths(whole_planner):
        named = (whole_planner.cookie, ("Origin", whole_planner.origin), elsewhere)
        assert whole_planner.handshake(path, *named).status == 403, path


def test_an_address_of_before_versions_answers_410_and_names_the_present_one(whole_planner: Planner) -> None:
    for method in ("GET", "POST"):
        own = [whole_planner.cookie, ("Origin", whole_planner.origin)]
        answer = whole_planner.http(method, "/api/plans/plan-1/undo", *own)
        assert answer.status == 410
        error = json.loads(answer.body)["error"]
        assert (error["code"], "/api/v1/plans/plan-1/undo" in error["message"]) == ("moved", True)
        assert whole_planner.http(method, "/api/v1/no/such/route", *own).status == 404
    assert whole_planner.handshake("/api/steps/rehearse/poses", *own).status == 410


def test_a_step_s_folder_gives_its_scripts_and_nothing_else(whole_planner: Planner) -> None:
    """HAZ-27: no source of the server, no file of another folder."""

    def status(path: str) -> int:
        return whole_planner.http("GET", f"/tabs/{path}", whole_planner.cookie).status

    for name in ("patient", "plan", "rehearse"):
        answer = whole_planner.http("GET", f"/tabs/{name}/panel.js", whole_planner.cookie)
        assert (answer.status, answer.headers["Cache-Control"]) == (200, "no-cache"), name
        assert answer.headers["Content-Type"].startswith("text/javascript")
        assert "script-src 'self'" in answer.headers["Content-Security-Policy"]
    beside = ("plan/step.py", "plan/__init__.py", "plan/..%2fplan%2fpanel.js", "plan/%2e%2e/registry.py")
    for path in (*beside, "nose/panel.js"):
        assert status(path) == 404, path


def test_a_library_of_the_page_is_asked_for_again_and_sent_once(whole_planner: Planner) -> None:
    """After an update of the planner a browser shows no library of before."""
    path = "/static/lib/lit-html/lit-html.js"
    first = whole_planner.http("GET", path, whole_planner.cookie)
    assert (first.status, first.headers["Cache-Control"]) == (200, "no-cache")
    assert first.headers["Content-Type"].startswith("text/javascript")
    again = whole_planner.http("GET", path, whole_planner.cookie, ("If-None-Match", first.headers["ETag"]))
    assert (again.status, again.body) == (304, b"")
