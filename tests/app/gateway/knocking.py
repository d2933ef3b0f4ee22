"""A planner that really listens: uvicorn on a loopback port with the scene's server behind it."""

import asyncio
import contextlib
import http.client
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

from fastapi import APIRouter
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket

from app.gateway.application import GuardedApplication, build_application
from app.gateway.later_routes import MakeRouters
from app.gateway.scene_server import SceneServer
from app.gateway.server import PlannerServer
from app.gateway.warm_up import WarmUp
from app.settings import Settings

METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE")


@dataclass(frozen=True)
class Answer:
    """An HTTP answer as it stood on the wire."""

    status: int
    headers: http.client.HTTPMessage
    body: bytes


@dataclass(frozen=True)
class Planner:
    """A running planner and the ways to knock at it."""

    app: GuardedApplication
    settings: Settings
    scene_server: SceneServer

    @property
    def port(self) -> int:
        return self.settings.port

    @property
    def host(self) -> str:
        return f"127.0.0.1:{self.port}"

    @property
    def origin(self) -> str:
        return f"http://{self.host}"

    @property
    def bearer(self) -> tuple[str, str]:
        return ("Authorization", f"Bearer {self.settings.token}")

    @property
    def cookie(self) -> tuple[str, str]:
        return ("Cookie", f"vfix_token_{self.port}={self.settings.token}")

    def http(self, method: str, path: str, *headers: tuple[str, str], host: str | None = None) -> Answer:
        """One request with exactly these headers (and Host); nothing is added or made nice."""
        names = [] if host == "" else [("Host", self.host if host is None else host)]
        return knock(self.port, method, path, [*names, *headers, ("Connection", "close")])

    def handshake(self, path: str, *headers: tuple[str, str], host: str | None = None) -> Answer:
        """The first half of a WebSocket: its handshake and the answer to it; 101 means let in."""
        return knock(self.port, "GET", path, [("Host", self.host if host is None else host), *upgrade(), *headers])


def upgrade() -> list[tuple[str, str]]:
    return [
        ("Connection", "Upgrade"),
        ("Upgrade", "websocket"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
        ("Sec-WebSocket-Protocol", "viser-v1.1.1"),
    ]


def knock(port: int, method: str, target: str, headers: list[tuple[str, str]], body: bytes = b"") -> Answer:
    lines = [f"{method} {target} HTTP/1.1", *(f"{name}: {value}" for name, value in headers), "", ""]
    return raw(port, "\r\n".join(lines).encode("latin-1") + body, method)


def raw(port: int, data: bytes, method: str = "GET") -> Answer:
    """Send bytes, read one answer."""
    with socket.create_connection(("127.0.0.1", port), timeout=60) as connection:
        connection.sendall(data)
        response = http.client.HTTPResponse(connection, method=method)
        response.begin()
        content = b"" if response.status == 101 else response.read()
        return Answer(response.status, response.headers, content)


def eventually(condition: Callable[[], object], timeout: float = 60.0) -> None:
    """Wait until something is so."""
    deadline = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.01)


def other_routes() -> APIRouter:
    """Routes in place of the cases, plans and the session."""
    router = APIRouter()

    async def echo(word: str) -> dict[str, str]:
        return {"word": word}

    for method in ("GET", "POST", "PUT", "PATCH", "DELETE"):
        router.add_api_route("/api/v1/echo/{word}", echo, methods=[method], operation_id=f"echo_{method}")

    @router.get("/api/v1/slow")
    async def slow() -> None:
        await asyncio.sleep(1.5)

    @router.post("/api/v1/takes")
    async def takes(numbers: list[int]) -> int:
        return len(numbers)

    @router.get("/api/v1/broken")
    async def broken() -> None:
        raise ValueError("Jane Doe, born 1970")

    @router.websocket("/session")
    async def session(websocket: WebSocket) -> None:
        await websocket.accept(subprotocol="viser-v1.1.1")
        await websocket.close()

    return router


class NoServices(contextlib.ExitStack):
    """In the place of the services: nothing runs that would have to be ended, and nothing changes."""

    store = SimpleNamespace(look=lambda: None)
    jobs = SimpleNamespace(version=0)

    def end(self) -> None:
        pass


@contextlib.contextmanager
def listening(home: Path, routers: Sequence[APIRouter], later: MakeRouters = tuple) -> Iterator[Planner]:
    """Serve these routers behind the real gateway until the block ends; later: others, see `build_application`."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        settings = Settings(home=home, port=listener.getsockname()[1], token=secrets.token_urlsafe(24))
        scene_server = SceneServer()
        app = build_application(settings, NoServices(), scene_server, WarmUp(()), routers, later=later)
        server = PlannerServer(app)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        deadline = time.monotonic() + 60
        while not server.started and time.monotonic() < deadline:
            time.sleep(0.01)
        assert server.started, "the planner did not start"
        try:
            yield Planner(app, settings, scene_server)
        finally:
            server.should_exit = True
            thread.join(60)
            assert not thread.is_alive(), "the planner did not stop"


def all_routes(routes: list) -> Iterator[object]:
    """Every route of an application, those of included routers at their full path."""
    for route in routes:
        nested = getattr(route, "effective_candidates", None)
        if nested is not None:
            yield from all_routes(nested())
        else:
            yield getattr(route, "starlette_route", None) or route


def kind(route: object) -> type:
    return type(getattr(route, "original_route", route))


def is_websocket(route: object) -> bool:
    return issubclass(kind(route), WebSocketRoute)


def http_paths(planner: Planner) -> list[str]:
    paths = {"/static/css/base.css", "/static/", "/static/../../pyproject.toml", "/no/such/page", "//", "/scene"}
    for route in all_routes(planner.app.routes):
        if not is_websocket(route):
            paths.add(filled(route.path))
    return sorted(paths)


def websocket_paths(planner: Planner) -> list[str]:
    found = {"/no/such/socket", "/"}
    for route in all_routes(planner.app.routes):
        if is_websocket(route):
            found.add(filled(route.path))
    return sorted(found)


def filled(path: str) -> str:
    """A path with every parameter filled in."""
    return "/".join("x" if part.startswith("{") else part for part in path.split("/"))
