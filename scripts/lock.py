"""Regenerate the lock files from pyproject.toml: exact versions and hashes for every platform.

    python3 scripts/lock.py

Run it with uv on the search path after changing the dependencies, and commit the result.
`requirements.lock` is what start.py installs; `requirements-test.lock` adds the test tools with the same versions.
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# What an editable install without isolation builds with is locked as well.
BUILD_REQUIREMENTS = "hatchling>=1.27\nnodejs-wheel-binaries>=22.13\neditables>=0.5\n"
HEADER = "# Made by scripts/lock.py; do not edit.\n"


def compile_lock(name: str, *options: str) -> None:
    """Write one lock file."""
    command = ["uv", "pip", "compile", "pyproject.toml", "-", "--universal", "--python-version", "3.11"]
    command += ["--generate-hashes", "--no-header", "--no-annotate", "--no-emit-index-url", "--quiet", *options]
    done = subprocess.run(command, cwd=ROOT, input=BUILD_REQUIREMENTS, text=True, stdout=subprocess.PIPE, check=True)
    (ROOT / name).write_text(HEADER + done.stdout, encoding="utf-8")


def main() -> int:
    """Write both lock files."""
    compile_lock("requirements.lock", "--extra", "app")
    extras = [text for name in ("app", "cluster", "mcap", "tables", "test") for text in ("--extra", name)]
    compile_lock("requirements-test.lock", *extras, "--constraint", "requirements.lock")
    return 0


if __name__ == "__main__":
    sys.exit(main())
