"""Routes below /api that are made after the page is served."""

import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from fastapi import APIRouter
from knocking import Planner, listening


class Made:
    """Makes a router with one route, as often as it is asked to; fails at first, where it is to."""

    def __init__(self, failures: int = 0) -> None:
        self.times, self._failures = 0, failures

    def __call__(self) -> Sequence[APIRouter]:
        self.times += 1
        if self.times <= self._failures:
            raise RuntimeError("no routes yet")
        router = APIRouter()
        router.add_api_route("/api/v1/late", lambda: "here", methods=["GET"])
        return (router,)


def late(planner: Planner) -> int:
    return planner.http("GET", "/api/v1/late", planner.bearer).status


def test_a_request_for_them_makes_them_and_the_page_does_not(tmp_path: Path) -> None:
    made = Made()
    with listening(tmp_path, [], made) as planner:
        for path in ("/", "/static/css/base.css", "/no/such/page"):
            planner.http("GET", path, planner.bearer)
        assert planner.http("GET", "/api/v1/late").status == 401
        assert made.times == 0
        answer = planner.http("GET", "/api/v1/late", planner.bearer)
        assert (answer.status, json.loads(answer.body), made.times) == (200, "here", 1)


def test_they_are_made_once_for_requests_that_come_together(tmp_path: Path) -> None:
    made = Made()
    with listening(tmp_path, [], made) as planner, ThreadPoolExecutor(8) as pool:
        assert list(pool.map(late, [planner] * 8)) == [200] * 8
        planner.app.load_routes()
    assert made.times == 1


@pytest.mark.parametrize("path", ["/openapi.json", "/docs"])
def test_they_are_described(tmp_path: Path, path: str) -> None:
    with listening(tmp_path, [], Made()) as planner:
        assert b"/api/v1/late" in planner.http("GET", path, planner.bearer).body


def test_a_failure_is_an_error_of_the_request_and_the_next_one_tries_again(tmp_path: Path) -> None:
    made = Made(failures=1)
    with listening(tmp_path, [], made) as planner:
        assert [late(planner) for _ in range(3)] == [500, 200, 200]
    assert made.times == 2
