"""Run every check and every test, including those in a real browser.

    python3 scripts/test.py                  everything
    python3 scripts/test.py tests/geometry   further arguments go to pytest

Creates the private environment with the test tools and Node.js, finds Chrome, Chromium or Edge (VFIX_BROWSER names one)
or installs Chromium in the way that the machine supports. Needs Python 3.11 or newer and nothing else.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from environment import ROOT, SetUpFailed, ensure_environment, run_in_environment, use_new_enough_python
from page_checks import ensure_page_tools, run_page_checks

CHECKS = (
    ("style", ("-m", "ruff", "check", ".")),
    ("format", ("-m", "ruff", "format", "--check", ".")),
    ("types", ("-m", "mypy")),
)
# Compiles the kernels of a first start on two cores; a test that needs others compiles them itself. When all tests run,
# one of them is such a start and keeps its compiled kernels, so that nothing is left to compile here.
PREPARATION = ("-c", "from vfix_engine.worlds.rigid.preparation import prepare; prepare()")
# The tests, in runs of which two run at a time; the first two begin first, one after the other. A run excludes paths
# that another run names. Runs of the page and of real-time processes wait more than they compute and go first; the
# others only compute and have a lower priority, the longest first, so that both cores are busy until the end.
FIRST_START = "a first start"
IN_TIME = "the page and what runs in real time"
RUNS = {
    FIRST_START: ("tests/app/commands/test_bench_start.py",),
    IN_TIME: (
        "tests/browser",
        "tests/engine/runtime",
        "tests/engine/worlds/rigid/test_realtime.py",
        "tests/engine/worlds/rigid/test_rigid_runs.py",
        "tests/engine/worlds/snake/test_snake_process.py",
    ),
    "the application": ("tests/app",),
    "the engine": ("tests/engine",),
    "the simulation": ("tests/engine/worlds/rigid",),
    "rehearsals, snakes by command and hostile files": (
        *(f"tests/app/commands/test_rehearse_{name}.py" for name in ("command", "robots", "zones")),
        "tests/app/commands/test_lumen_command.py",
        "tests/app/commands/test_bench_lumen.py",
        "tests/app/exchange/test_file_mutants.py",
    ),
    "the lumen": ("tests/engine/pathway", "tests/engine/snake", "tests/engine/worlds/snake"),
    "docs, scripts and the wheel": ("tests",),
}
WORKERS = 2
LESS_URGENT = 10  # increase of the nice value, at most 19
SLOWEST = 10  # number of test files listed as the slowest
LASTED: "dict[str, float]" = {}  # duration of each part in s by its name

Result = TypeVar("Result")


def main(arguments: "list[str]") -> int:
    """Set up, check and test; return the first status that is not 0."""
    if "-h" in arguments or "--help" in arguments:
        print(__doc__)
        return 0
    try:
        use_new_enough_python()
        python = ensure_environment(with_tests=True)
        node = ensure_page_tools(python)
        os.environ["VFIX_BROWSER"] = ensure_browser(python)
    except SetUpFailed as reason:
        print(f"vfix: {reason}", file=sys.stderr)
        return 1
    print(f"Browser: {os.environ['VFIX_BROWSER']}", flush=True)
    if "--setup-only" in arguments:
        return 0
    began = time.monotonic()
    last_lines: list[str] = []
    with tempfile.TemporaryDirectory() as reports:
        if arguments:
            statuses = {"preparation": timed("preparation", run_in_environment, python, *PREPARATION)}
            statuses |= run_checks(python, node, Path(reports))
            statuses["tests"] = run_in_environment(python, "-m", "pytest", *arguments)
        else:
            statuses = run_everything(python, node, Path(reports))
            written = sorted(Path(reports).glob("*.xml"))
            last_lines = [*durations(written), f"All of it took {time.monotonic() - began:.0f} s.", counts(written)]
    for name, status in statuses.items():
        print(f"{name}: {'ok' if status == 0 else f'FAILED ({status})'}")
    print("\n".join(last_lines), flush=True)
    return next((status for status in statuses.values() if status), 0)


def run_checks(python: Path, node: Path, reports: Path) -> "dict[str, int]":
    """Run the checks of the Python code, then those of the page; return the status of each by its name."""
    statuses = {name: run_in_environment(python, *command) for name, command in CHECKS}
    return statuses | run_page_checks(node, reports / "page.xml")


def run_everything(python: Path, node: Path, reports: Path) -> "dict[str, int]":
    """Run all checks and test runs, two at a time; return the status of each by its name.

    Each run writes its JUnit results to `reports`.
    """

    def run(name: str) -> int:
        arguments = ("-m", "pytest", "-q", f"--junitxml={reports / name}.xml", *paths_of(name))
        urgency = 0 if name in (FIRST_START, IN_TIME) else LESS_URGENT
        status = timed(f"tests of {name}", run_in_environment, python, *arguments, less_urgent=urgency)
        print(f"vfix: the tests of {name} took {LASTED[f'tests of {name}']:.0f} s", flush=True)
        return status

    with ThreadPoolExecutor(WORKERS) as threads:
        checks = threads.submit(timed, "checks", run_checks, python, node, reports)
        statuses = {f"tests of {FIRST_START}": run(FIRST_START)}  # parallel to the checks; all others need its kernels
        statuses["preparation"] = timed("preparation", run_in_environment, python, *PREPARATION)
        runs = {name: threads.submit(run, name) for name in RUNS if name != FIRST_START}
        return statuses | checks.result() | {f"tests of {name}": run.result() for name, run in runs.items()}


def paths_of(name: str) -> "list[str]":
    """Return a run's arguments for pytest: its own paths, without paths below them that other runs name."""
    own = [Path(path) for path in RUNS[name]]
    others = [Path(path) for other, paths in RUNS.items() if other != name for path in paths]
    left_out = [path for path in others if any(one in path.parents for one in own)]
    return [str(path) for path in own] + [f"--ignore={path}" for path in left_out]


def timed(name: str, work: "Callable[..., Result]", *words: "Any", **options: "Any") -> "Result":
    """Call ``work`` and return its result; its duration is reported at the end."""
    began = time.monotonic()
    try:
        return work(*words, **options)
    finally:
        LASTED[name] = time.monotonic() - began


def durations(reports: "list[Path]") -> "list[str]":
    """Return lines with the duration of each part, then of the slowest test files, from their JUnit reports."""
    files: dict[str, float] = {}
    for report in reports:
        for case in ElementTree.parse(report).getroot().iter("testcase"):
            file = case.get("classname", "").replace(".", "/")
            files[file] = files.get(file, 0.0) + float(case.get("time", 0))
    slowest = sorted(files, key=lambda file: -files[file])[:SLOWEST]
    parts = [f"{LASTED[name]:6.0f} s  {name}" for name in LASTED]
    return [*parts, "The slowest files of tests:", *(f"{files[file]:6.0f} s  {file}" for file in slowest)]


def counts(reports: "list[Path]") -> str:
    """Return 'N passed, N failed, N skipped' of all JUnit reports; a test whose set-up failed counts as failed."""
    total = dict.fromkeys(("tests", "failures", "errors", "skipped"), 0)
    for report in reports:
        root = ElementTree.parse(report).getroot()
        for suite in root.iter("testsuite"):
            for name in total:
                total[name] += int(suite.get(name, 0))
        for case in root.findall("testcase"):  # tests of Node.js are not in a suite
            total["tests"] += 1
            total["failures"] += case.find("failure") is not None
            total["skipped"] += case.find("skipped") is not None
    failed = total["failures"] + total["errors"]
    return f"{total['tests'] - failed - total['skipped']} passed, {failed} failed, {total['skipped']} skipped"


def ensure_browser(python: Path) -> str:
    """Return the path of a browser for the tests, installed if necessary. Raises SetUpFailed."""
    sys.path.insert(0, str(ROOT))
    from app.browsers import find_browser

    found = find_browser()
    if found is not None and _starts(found):
        return found
    if os.environ.get("VFIX_BROWSER"):
        raise SetUpFailed(f"VFIX_BROWSER is {os.environ['VFIX_BROWSER']!r}, which does not start.")
    print("No Chrome, Chromium or Edge found; installing Chromium ...", flush=True)
    if _may_use_apt():
        _install_with_apt()
        found = find_browser()
        if found is not None and _starts(found):
            return found
    found = _install_with_playwright(python)
    if found is None:
        raise SetUpFailed(
            "There is no browser for the page's tests and none could be installed. "
            "Install Chrome, Chromium or Edge, or name one in VFIX_BROWSER."
        )
    return found


def _starts(browser: str) -> bool:
    """Return whether a browser prints its version, unlike a placeholder that only refers to another installer."""
    if sys.platform == "win32":  # where `--version` opens a window
        return True
    try:
        return subprocess.run([browser, "--version"], capture_output=True, timeout=60, check=False).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def _may_use_apt() -> bool:
    return shutil.which("apt-get") is not None and hasattr(os, "geteuid") and os.geteuid() == 0


def _install_with_apt() -> None:
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in (["apt-get", "update"], ["apt-get", "install", "-y", "--no-install-recommends", "chromium"]):
        subprocess.run(command, env=environment, check=False)


def _install_with_playwright(python: Path) -> "str | None":
    """Install Playwright's Chromium, with the system's libraries if possible; return its path, or None on failure."""
    command = [str(python), "-m", "playwright", "install", *(["--with-deps"] if _may_use_apt() else []), "chromium"]
    subprocess.run(command, check=False)
    ask = "from playwright.sync_api import sync_playwright as s\nwith s() as p: print(p.chromium.executable_path)"
    answer = subprocess.run([str(python), "-c", ask], capture_output=True, text=True, check=False)
    path = answer.stdout.strip()
    return path if path and Path(path).is_file() and _starts(path) else None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
