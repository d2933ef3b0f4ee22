"""What every result carries besides its figures: versions and hardware; and how figures are taken."""

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
    """A benchmark cannot be run here; the message says what to do about it."""


@dataclass(frozen=True)
class Machine:
    """Versions and hardware that the figures hold for; None where a package is not installed.

    cores: that this process may use. load: jobs that ran or waited when it began, over the last minute; more than
    the benchmark's own one means that other work shares the machine. None where the system does not tell.
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
        """Plain values for JSON."""
        return asdict(self)


def machine() -> Machine:
    """This machine, now."""
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
    """A module of the extra `test`; ``words``: what it is needed for, before its name.

    Raises:
        BenchmarkRefused: it is not installed; the message says how to install it.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise BenchmarkRefused(f"{words} {module}, which is not installed: pip install 'vfix[test]'") from None


def interleaved(candidates: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, np.ndarray]:
    """Seconds (rounds,) of each candidate, called in turn, so that a slow moment of the machine strikes all alike.

    One round beforehand is not counted: it fills caches and compiles what is not compiled yet.
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
    """Median and 99th percentile in µs."""
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
