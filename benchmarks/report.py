"""Common parts of the benchmarks: versions and hardware in every result, and timing."""

from __future__ import annotations

import importlib
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from app import __version__
from vfix_engine.errors import VfixError


class BenchmarkRefused(VfixError):
    """A benchmark cannot be run here; the message states what to do."""


@dataclass(frozen=True)
class Machine:
    """Versions and hardware of a measurement; None for a package that is not installed.

    cores: number of cores that this process may use. load: load average of the last minute at the start; more than the
    benchmark's own 1 means that other work shares the machine. None if the system does not report it.
    """

    vfix: str
    python: str
    numpy: str | None
    numba: str | None
    pinocchio: str | None
    coal: str | None
    qpsolvers: str | None
    daqp: str | None
    platform: str
    cpu: str
    cores: int
    load: float | None

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        return asdict(self)


def machine() -> Machine:
    """Return the current state of this machine."""
    return Machine(
        vfix=__version__,
        python=platform.python_version(),
        numpy=_version("numpy"),
        numba=_version("numba"),
        pinocchio=_version("pin"),
        coal=_version("coal"),
        qpsolvers=_version("qpsolvers"),
        daqp=_version("daqp"),
        platform=platform.platform(),
        cpu=_cpu_name(),
        cores=len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1,
        load=os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    )


def need(module: str, words: str = "this benchmark compares with") -> ModuleType:
    """Import a module of the extra `test`. words: its purpose, for the message before its name.

    Raises:
        BenchmarkRefused: it is not installed; the message states how to install it.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise BenchmarkRefused(f"{words} {module}, which is not installed: pip install 'vfix[test]'") from None


def interleaved(candidates: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, np.ndarray]:
    """Return the seconds (rounds,) of each candidate, called in turn, so that a slow phase affects all of them equally.

    A first round is not timed: it fills caches and compiles missing kernels.
    """
    seconds = {name: np.zeros(rounds) for name in candidates}
    for call in candidates.values():
        call()
    for index in range(rounds):
        for name, call in candidates.items():
            begin = time.perf_counter()
            call()
            seconds[name][index] = time.perf_counter() - begin
    return seconds


def spread_us(seconds: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Return median and 99th percentile in µs."""
    values = 1e6 * np.asarray(seconds, dtype=float)
    return {"median_us": float(np.median(values)), "p99_us": float(np.percentile(values, 99))}


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _cpu_name() -> str:
    if sys.platform == "linux":
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith(("model name", "Model")):
                return line.partition(":")[2].strip()
    if sys.platform == "darwin":
        asked = subprocess.run(
            ["sysctl", "-n", "machdep.cpu.brand_string"], capture_output=True, text=True, check=False
        )
        if asked.stdout.strip():
            return asked.stdout.strip()
    return platform.processor() or platform.machine()
