"""The REST routes without a socket, over services that a test brings along."""

import asyncio
import time
from collections.abc import AsyncIterator
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from app.api import router
from app.cases.model import HEAD_PHANTOM
from app.gateway.body_limit import BodyLimit
from app.gateway.error_answers import install_error_answers
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services

CASE, PLAN = f"/api/v1/cases/{HEAD_PHANTOM}", f"/api/v1/plans/{SAMPLE_PLAN}"


class Client:
    """Talks to the application without a socket."""

    def __init__(self, app: FastAPI) -> None:
        self._runner = asyncio.Runner()
        transport = httpx.ASGITransport(app=app, raise_app_exceptions=False)
        self._http = httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1")

    def request(self, method: str, path: str, **options: Any) -> httpx.Response:
        return self._runner.run(self._http.request(method, path, **options))

    def get(self, path: str, **options: Any) -> httpx.Response:
        return self.request("GET", path, **options)

    def post(self, path: str, **options: Any) -> httpx.Response:
        return self.request("POST", path, **options)

    def patch(self, path: str, **options: Any) -> httpx.Response:
        return self.request("PATCH", path, **options)

    def delete(self, path: str) -> httpx.Response:
        return self.request("DELETE", path)

    def close(self) -> None:
        self._runner.run(self._http.aclose())
        self._runner.close()


def opened_client(services: Services) -> Client:
    app = FastAPI()
    app.state.services = services
    install_error_answers(app)
    app.add_middleware(BodyLimit)
    app.include_router(router)
    return Client(app)


async def flood(first: bytes, size: int, sent: list[int]) -> AsyncIterator[bytes]:
    """A body without end, which tells how much of it was taken."""
    yield first
    for _ in range(1000):
        sent.append(size)
        yield b"x" * size


def wait(client: Client, job: dict[str, str]) -> dict[str, object]:
    """What a job's route answers once the job has ended."""
    for _ in range(2400):  # two busy cores take their time
        answer: dict[str, object] = client.get(f"/api/v1/jobs/{job['id']}").json()
        if answer["state"] in ("done", "failed", "cancelled"):
            return answer
        time.sleep(0.05)
    pytest.fail("the job did not end")
