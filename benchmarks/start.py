"""`vfix serve` from its first start after an installation, with nothing compiled, to its later ones."""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from typing import Any

from app.extras import has_app, need_app
from benchmarks import report
from benchmarks.planner import GIVE_UP_S, planner
from vfix_engine.worlds.registry import RIGID, SNAKE

SUMMARY = "the first start, which compiles the kernels, and later ones"
FIRST_S, FIRST_MOST_S, LATER_S = 30.0, 60.0, 2.0  # aimed at, allowed while the page is there already, allowed
LOOK_S = 0.05
WARM_S = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: the number of later starts."""
    parser.add_argument("--starts", type=int, default=5, help="later starts (default 5)")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return seconds from the command to its address, to a response there, and to the last kernel, in separate folders.

    At `compiled_s` all kernels of the page are compiled, at `snake_compiled_s` those of the snake, which are compiled
    beside them at a low priority. `of_page`, `of_snake`: how many they are.

    Raises:
        BenchmarkRefused: the planner does not start here, or the number makes no sense.
        AppMissing: the page and the server are not installed.
    """
    if not has_app():
        raise need_app("vfix bench start")
    if not 1 <= args.starts <= 100:
        raise report.BenchmarkRefused(f"--starts {args.starts} is not between 1 and 100")
    machine = report.machine().to_dict()
    with tempfile.TemporaryDirectory(prefix="vfix-start-") as folder:
        before = _seconds_of_children()
        first = _start(Path(folder), until_compiled=True)
        worked = None if before is None else (_seconds_of_children() or 0.0) - before
        kept = _kept(Path(folder))
        later = [_start(Path(folder)) for _ in range(args.starts)]
        _start(Path(folder), linger_s=WARM_S)  # long enough to compile what it would miss
        compiled_again = _kept(Path(folder)) - kept
    slowest = max(one["address_s"] for one in later)
    return {
        "machine": machine,
        "first": {**first, "cpu_s": worked, "kernels": len({file.rsplit(".", 2)[0] for file in kept})},
        "later": {
            "address_s": statistics.median([one["address_s"] for one in later]),
            "slowest_address_s": slowest,
            "answer_s": statistics.median([one["answer_s"] for one in later]),
        },
        "correct": len(kept) > 0 and not compiled_again,
        "meets": {
            "first_within_30_s": first["compiled_s"] <= FIRST_S,
            "first_within_60_s": first["compiled_s"] <= FIRST_MOST_S,
            "later_within_2_s": slowest <= LATER_S,
        },
    }


def _start(folder: Path, until_compiled: bool = False, linger_s: float = 0.0) -> dict[str, Any]:
    """Start the planner once and end it."""
    began = time.perf_counter()
    own = {"VFIX_HOME": str(folder / "home"), "VFIX_CACHE": str(folder / "cache"), "NUMBA_CACHE_DIR": ""}
    with planner(own) as (address, process):
        told = {"address_s": time.perf_counter() - began}
        _ask(address)
        told["answer_s"] = time.perf_counter() - began
        if until_compiled:
            told["of_page"] = _await(folder, RIGID.done, process)
            told["compiled_s"] = time.perf_counter() - began
            told["of_snake"] = _await(folder, SNAKE.done, process)
            told["snake_compiled_s"] = time.perf_counter() - began
        time.sleep(linger_s)
    return told


def _await(folder: Path, done: str, process: subprocess.Popen[str]) -> int:
    """Wait until the planner has compiled the kernels that this file marks; return how many they are."""
    began = time.perf_counter()
    while not (marks := list(folder.glob(f"cache/kernels/*/{done}"))) or not (number := marks[0].read_text()):
        if process.poll() is not None or time.perf_counter() - began > GIVE_UP_S:
            raise report.BenchmarkRefused("the planner did not get its kernels compiled; see vfix doctor")
        time.sleep(LOOK_S)
    return int(number)


def _ask(address: str) -> None:
    """Wait for the page; the address sets a cookie and redirects."""
    browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    with browser.open(address, timeout=GIVE_UP_S) as answer:
        answer.read()


def _kept(folder: Path) -> set[str]:
    """Return every compiled kernel with the types it was compiled for, in any folder."""
    return {str(file.relative_to(folder)) for file in folder.glob("cache/kernels/*/*.nbc")}


def _seconds_of_children() -> float | None:
    """Return the processor time of all ended child processes; None if the system does not report it."""
    if sys.platform == "win32":
        return None
    import resource

    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
