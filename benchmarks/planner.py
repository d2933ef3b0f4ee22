"""`vfix serve` in a process of its own, for the benchmarks that measure it from outside."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from benchmarks import report

GIVE_UP_S = 600.0
_ROOT = Path(__file__).resolve().parents[1]
_SAYS = "vfix is at "


@contextmanager
def planner(settings: Mapping[str, str]) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Its address, as soon as it says it, and its process, which ends with the block.

    settings: variables of its environment, such as VFIX_HOME.
    """
    environment = {**os.environ, **settings, "PYTHONPATH": str(_ROOT)}
    command = [sys.executable, "-m", "app.cli", "serve", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            if not line.startswith(_SAYS):
                raise report.BenchmarkRefused("the planner does not start here; see vfix doctor")
            yield line.removeprefix(_SAYS).strip(), process
        finally:
            process.terminate()
            process.wait(GIVE_UP_S)
