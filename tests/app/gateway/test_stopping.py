"""A planner that is told to end does so, whatever somebody waits for."""

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

from app.services import build_services
from app.services.embedded import SAMPLE_PLAN
from app.settings import Settings

ROOT = Path(__file__).resolve().parents[3]
TOKEN = "a-token-of-the-tests-0123456789"


def long_plan(home: Path) -> str:
    """A plan whose dry run takes many seconds: to and fro, and the robot placed anew each time it is stuck."""
    services = build_services(Settings(home=home))
    plan = services.plans.duplicate(SAMPLE_PLAN)
    first, other = plan.points[0].position, plan.points[3].position
    for n in range(16):
        x, y, z = (first, other)[n % 2]
        services.plans.editor(plan.id).add_point((x + 0.2 * (n // 2), y, z))
    services.close()
    return plan.id


def asked(address: str, plan: str) -> tuple[int, str]:
    """Status of a plan's evaluation, and the code of the error where it is one."""
    route = f"{address}/api/plans/{plan}/evaluation"
    request = urllib.request.Request(route, headers={"Authorization": f"Bearer {TOKEN}"})
    try:
        with urllib.request.urlopen(request, timeout=300) as answer:
            return answer.status, ""
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)["error"]["code"]


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no such signal")
def test_a_stop_during_a_dry_run_answers_whoever_waits_for_it(tmp_path: Path) -> None:
    plan = long_plan(tmp_path)
    environment = {**os.environ, "VFIX_HOME": str(tmp_path), "VFIX_TOKEN": TOKEN, "PYTHONUNBUFFERED": "1"}
    command = [sys.executable, "-m", "app.cli", "serve", "--no-browser", "--port", "0"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=ROOT, env=environment, text=True, stdout=pipe, stderr=pipe) as process:
        assert process.stdout is not None
        address = process.stdout.readline().split()[-1].partition("/?")[0]
        assert asked(address, SAMPLE_PLAN) == (200, "")  # the geometry engine and the head are there
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(asked, address, plan)
            time.sleep(1.0)
            assert not answer.done()
            process.send_signal(signal.SIGINT)
            assert answer.result() == (503, "planner_ends")
        said = process.communicate(timeout=60)[1]
    assert (process.returncode, said) == (0, "")
