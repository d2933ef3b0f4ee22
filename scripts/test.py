"""Run every check and every test, those in a real browser included.

    python3 scripts/test.py                  everything
    python3 scripts/test.py tests/geometry   further arguments go to pytest

Makes the private environment with the test tools and Node.js, finds Chrome, Chromium or Edge (VFIX_BROWSER names one)
or installs Chromium the way the machine allows. Needs Python 3.11 or newer and nothing else.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from environment import ROOT, SetUpFailed, ensure_environment, run_in_environment, use_new_enough_python
from page_checks import ensure_page_tools, run_page_checks

CHECKS = (
    ("style", ("-m", "ruff", "check", ".")),
    ("format", ("-m", "ruff", "format", "--check", ".")),
    ("types", ("-m", "mypy")),
)
# The kernels as a first start compiles them, on two cores; a test that needs others compiles those itself.
PREPARATION = ("-c", "from vfix_engine.simulation.preparation import prepare; prepare()")
# Runs that only compute, so that two of them can be made at once, the longest first; all other tests have the machine
# for themselves then.
AT_ONCE = {
    "the lumen": ("tests/engine/lumen",),
    "the attack and mutants": (
        "tests/app/test_file_mutants.py",
        "tests/engine/simulation/test_attack.py",
        "tests/engine/simulation/test_closed_loop.py",
    ),
    "rehearsals and snakes by command": (
        *(f"tests/app/test_{name}.py" for name in ("lumen_command", "rehearse_command", "rehearse_robots")),
        "tests/app/test_rehearse_zones.py",
    ),
    "hands": tuple(
        f"tests/engine/simulation/test_{name}.py"
        for name in ("endoscope", "ingress", "motion_limits", "standing_fixtures", "teleoperation")
    ),
    "zones and moving anatomy": tuple(
        f"tests/engine/simulation/test_{name}.py" for name in ("moving_anatomy", "soft_zones", "zones_closed_loop")
    ),
    "geometry, imaging and robots": tuple(
        f"tests/engine/{name}" for name in ("fixtures", "geometry", "imaging", "phantom", "robots")
    ),
}
WORKERS = 2


def main(arguments: "list[str]") -> int:
    """Set up, check, test; returns the first status that is not 0."""
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
    last_line = ""
    with tempfile.TemporaryDirectory() as reports:
        statuses = run_checks(python, node, Path(reports))
        statuses["preparation"] = run_in_environment(python, *PREPARATION)
        if arguments:
            statuses["tests"] = run_in_environment(python, "-m", "pytest", *arguments)
        else:
            statuses |= run_every_test(python, Path(reports))
            last_line = counts(sorted(Path(reports).glob("*.xml")))
    for name, status in statuses.items():
        print(f"{name}: {'ok' if status == 0 else f'FAILED ({status})'}")
    print(last_line, flush=True)
    return next((status for status in statuses.values() if status), 0)


def run_checks(python: Path, node: Path, reports: Path) -> "dict[str, int]":
    """Status of each check by its name; those of the page run beside those of the Python code."""
    with ThreadPoolExecutor(1) as thread:
        page = thread.submit(run_page_checks, node, reports / "page.xml")
        statuses = {name: run_in_environment(python, *command) for name, command in CHECKS}
        return statuses | page.result()


def run_every_test(python: Path, reports: Path) -> "dict[str, int]":
    """Status of each run by its name; each writes its JUnit results into the folder."""
    others = [f"--ignore={path}" for paths in AT_ONCE.values() for path in paths]

    def run(report: str, *arguments: str) -> int:
        return run_in_environment(python, "-m", "pytest", f"--junitxml={reports / report}.xml", *arguments)

    with ThreadPoolExecutor(WORKERS) as threads:
        runs = {name: threads.submit(run, name, "-q", *paths) for name, paths in AT_ONCE.items()}
        statuses = {f"tests of {name}": run.result() for name, run in runs.items()}
    statuses["other tests"] = run("others", *others)
    return statuses


def counts(reports: "list[Path]") -> str:
    """'N passed, N failed, N skipped' of all JUnit reports together; a test that could not begin has failed."""
    total = dict.fromkeys(("tests", "failures", "errors", "skipped"), 0)
    for report in reports:
        root = ElementTree.parse(report).getroot()
        for suite in root.iter("testsuite"):
            for name in total:
                total[name] += int(suite.get(name, 0))
        for case in root.findall("testcase"):  # those of Node.js stand in no suite
            total["tests"] += 1
            total["failures"] += case.find("failure") is not None
            total["skipped"] += case.find("skipped") is not None
    failed = total["failures"] + total["errors"]
    return f"{total['tests'] - failed - total['skipped']} passed, {failed} failed, {total['skipped']} skipped"


def ensure_browser(python: Path) -> str:
    """Path of a browser for the tests, installed if need be. Raises SetUpFailed."""
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
    """Whether it says its version; a placeholder that only points to another installer does not."""
    if sys.platform == "win32":  # there `--version` opens a window
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
    """Playwright's own Chromium, with the system's libraries where they may be installed."""
    command = [str(python), "-m", "playwright", "install", *(["--with-deps"] if _may_use_apt() else []), "chromium"]
    subprocess.run(command, check=False)
    ask = "from playwright.sync_api import sync_playwright as s\nwith s() as p: print(p.chromium.executable_path)"
    answer = subprocess.run([str(python), "-c", ask], capture_output=True, text=True, check=False)
    path = answer.stdout.strip()
    return path if path and Path(path).is_file() and _starts(path) else None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
