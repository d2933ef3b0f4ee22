"""A planner shuts down when requested, whatever its clients wait for."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from app.plans.operations.points import AddPoint
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import build_services
from app.settings import Settings

HEAD = "head-phantom"
ROOT = Path(__file__).resolve().parents[3]
TOKEN = "a-token-of-the-tests-0123456789"


def long_plan(home: Path) -> str:
    """A plan whose dry run takes a minute: four metres to and fro in front of the face."""
    services = build_services(Settings(home=home))
    x, y, z = services.plans.get(SAMPLE_PLAN).content.points[0].position
    plan = services.plans.create(HEAD, "Long")
    for n in range(100):
        services.plans.do(plan.id, AddPoint(position=(x, y - 30.0 - 40.0 * (n % 2), z + 0.05 * n)))
    services.close()
    return plan.id


def asked(address: str, plan: str) -> tuple[int, str]:
    """Status of a plan's evaluation, and the code of the error where it is one."""
    route = f"{address}/api/v1/plans/{plan}/evaluation"
    request = urllib.request.Request(route, headers={"Authorization": f"Bearer {TOKEN}"})
    try:
        with urllib.request.urlopen(request, timeout=300) as answer:
            return answer.status, ""
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)["error"]["code"]


def wait_until_driven(address: str, plan: str) -> None:
    """Until a dry run of the plan is on its way."""
    request = urllib.request.Request(f"{address}/api/v1/jobs", headers={"Authorization": f"Bearer {TOKEN}"})
    deadline = time.monotonic() + 300.0  # the geometry engine and the head are loaded first
    while time.monotonic() < deadline:
        with urllib.request.urlopen(request, timeout=60) as answer:
            jobs = json.load(answer)
        if any(job["kind"] == "dry_run" and job["state"] == "running" and job["fraction"] > 0.0 for job in jobs):
            return
        time.sleep(0.05)
    raise AssertionError(f"no dry run of {plan} has begun: {jobs}")


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no such signal")
def test_a_stop_during_a_dry_run_answers_whoever_waits_for_it(tmp_path: Path) -> None:
    plan = long_plan(tmp_path)
    environment = {**os.environ, "VFIX_HOME": str(tmp_path), "VFIX_TOKEN": TOKEN, "PYTHONUNBUFFERED": "1"}
    command = [sys.executable, "-m", "app.cli", "serve", "--no-browser", "--port", "0"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=ROOT, env=environment, text=True, stdout=pipe, stderr=pipe) as process:
        assert process.stdout is not None
        address = process.stdout.readline().split()[-1].partition("/?")[0]
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(asked, address, plan)
            wait_until_driven(address, plan)
            assert not answer.done()
            process.send_signal(signal.SIGINT)
            assert answer.result() == (503, "planner_ends")
        said = process.communicate(timeout=60)[1]
    assert (process.returncode, said) == (0, "")
