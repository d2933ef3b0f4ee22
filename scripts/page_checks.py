"""Checks of the page's modules: types (tsc), style (eslint) and unit tests (node --test). Standard library only.

typescript and eslint come from `package-lock.json`, which npm installs into `node_modules`, with the types of the
libraries that the page is served with (hatch_build.py). The page itself needs neither.
"""

import hashlib
import subprocess
from pathlib import Path

from environment import ROOT, SetUpFailed
from npm import FAILED, find_node, install

MODULES = ROOT / "node_modules"
INSTALLED_FROM = ("package.json", "package-lock.json", ".npmrc")
UNIT_TESTS = "tests/web/*.test.js"


def ensure_page_tools(python: Path) -> Path:
    """Install what the checks need, if it is not there; returns Node.js. Raises SetUpFailed."""
    node, npm = find_node(python)
    wanted = _fingerprint(node)
    stamp = MODULES / "vfix-stamp"
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == wanted:
        return node
    print("Installing the checks of the page from package-lock.json ...", flush=True)
    if not install(node, npm, ROOT):
        raise SetUpFailed(f"The checks of the page could not be installed; {FAILED}")
    stamp.write_text(wanted, encoding="utf-8")
    return node


def run_page_checks(node: Path, report: Path) -> "dict[str, int]":
    """Exit status of each check by its name; report: where the unit tests write their JUnit results."""
    installed = {"typescript": "bin/tsc", "eslint": "bin/eslint.js"}
    scripts = {name: str(MODULES / name / script) for name, script in installed.items()}
    reporters = ("--test-reporter=dot", "--test-reporter-destination=stdout")
    reporters += ("--test-reporter=junit", f"--test-reporter-destination={report}")
    commands = {
        "page's types": (scripts["typescript"], "--project", "tsconfig.json"),
        "page's style": (scripts["eslint"], "--max-warnings=0", "."),
        "page's unit tests": ("--test", *reporters, UNIT_TESTS),
    }

    def run(*words: str) -> int:
        return subprocess.run([str(node), *words], cwd=ROOT, check=False).returncode

    return {name: run(*words) for name, words in commands.items()}


def _fingerprint(node: Path) -> str:
    digest = hashlib.sha256(str(node).encode())
    for name in INSTALLED_FROM:
        digest.update((ROOT / name).read_bytes())
    return digest.hexdigest()
