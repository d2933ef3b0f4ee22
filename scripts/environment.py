"""The private environment of a checkout: `.venv`, made and filled by start.py and test.py. Standard library only.

A stamp in `.venv` holds the hash of everything that decides what is installed; while it fits, nothing is done.
"""

import hashlib
import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
PAGE_LIBRARIES = ROOT / "app" / "web" / "lib"  # fetched by the installation (hatch_build.py)
LOCK = ROOT / "requirements.lock"
TEST_LOCK = ROOT / "requirements-test.lock"
NEEDED_PYTHON = (3, 11)
NEEDED_DISK_BYTES = 4 * 2**30


class SetUpFailed(Exception):
    """The environment could not be made; the message says why and what to do."""


def use_new_enough_python() -> None:
    """Start the calling script again under a newer Python when this one is too old.

    Raises SetUpFailed when the machine has none.
    """
    if sys.version_info >= NEEDED_PYTHON:
        return
    for minor in range(14, NEEDED_PYTHON[1] - 1, -1):
        newer = shutil.which(f"python3.{minor}")
        if newer:
            sys.exit(subprocess.call([newer, *sys.argv]))
    found = ".".join(str(part) for part in sys.version_info[:3])
    raise SetUpFailed(f"vfix needs Python 3.11 or newer, and this is {found}. Install one and run it with that.")


def python_of_venv() -> Path:
    """The environment's own Python."""
    return VENV / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")


def ensure_environment(with_tests: bool) -> Path:
    """Make `.venv` what the lock files say, if it is not; returns its Python. Raises SetUpFailed."""
    lock = TEST_LOCK if with_tests else LOCK
    wanted = _fingerprint(lock)
    # What the tests need includes what the planner needs, so their environment serves both.
    enough = {wanted, _fingerprint(TEST_LOCK)}
    if python_of_venv().is_file() and PAGE_LIBRARIES.is_dir() and _read_stamp() in enough:
        return python_of_venv()
    _check_disk()
    _stamp_file().unlink(missing_ok=True)
    if not _runs(python_of_venv()):
        print(f"Making a private environment in {VENV} ...", flush=True)
        _make_venv()
    print(f"Installing the locked dependencies of {lock.name}; the first time takes a few minutes ...", flush=True)
    _pip("install", "--require-hashes", "--requirement", str(lock))
    _pip("install", "--no-deps", "--no-build-isolation", "--editable", str(ROOT))
    _stamp_file().write_text(wanted, encoding="utf-8")
    return python_of_venv()


def _fingerprint(lock: Path) -> str:
    digest = hashlib.sha256(f"{sys.version_info[:2]} {ROOT} {lock.name}".encode())
    for file in (lock, ROOT / "pyproject.toml", ROOT / "package-lock.json"):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _stamp_file() -> Path:
    return VENV / "vfix-stamp"


def _read_stamp() -> str:
    return _stamp_file().read_text(encoding="utf-8") if _stamp_file().is_file() else ""


def _runs(python: Path) -> bool:
    """Whether the environment's Python starts, has pip and is of this version (it breaks when the system's goes)."""
    if not python.is_file():
        return False
    check = "import pip, sys; print(sys.version_info[:2])"
    answer = subprocess.run([str(python), "-c", check], capture_output=True, text=True, check=False)
    return answer.returncode == 0 and answer.stdout.strip() == str(sys.version_info[:2])


def _make_venv() -> None:
    made = subprocess.run([sys.executable, "-m", "venv", "--clear", str(VENV)], check=False)
    if made.returncode:
        raise SetUpFailed(
            "Python could not make an environment. On Debian or Ubuntu install python3-venv and try again; "
            f"otherwise see whether {ROOT} can be written."
        )


def _pip(*arguments: str) -> None:
    command = [str(python_of_venv()), "-m", "pip", "--disable-pip-version-check", "--no-input", *arguments, "-qq"]
    if subprocess.run(command, check=False).returncode:
        raise SetUpFailed(
            "The dependencies could not be installed; pip's words stand above. Set-up needs the network, later starts "
            "do not. Mostly it is missing or a proxy is in the way (pip and npm read HTTPS_PROXY); then try again."
        )


def _check_disk() -> None:
    free = shutil.disk_usage(ROOT).free
    if free < NEEDED_DISK_BYTES:
        raise SetUpFailed(
            f"{ROOT} has {free / 2**30:.1f} GiB free; the environment needs {NEEDED_DISK_BYTES / 2**30:.0f}."
        )


def run_in_environment(python: Path, *arguments: str, less_urgent: int = 0) -> int:
    """Run the environment's Python in the checkout; returns its exit status.

    less_urgent: by how many steps it and all that it starts give way to others, where the system has such steps.
    """
    environment = {**os.environ, "PYTHONUTF8": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # each of hundreds of processes would compile the sources anew
    process = subprocess.Popen([str(python), *arguments], cwd=ROOT, env=environment)
    if less_urgent and hasattr(os, "setpriority"):
        with suppress(ProcessLookupError):  # it has ended already
            os.setpriority(os.PRIO_PROCESS, process.pid, os.getpriority(os.PRIO_PROCESS, 0) + less_urgent)
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            pass  # the child has been interrupted as well and ends in its own way
