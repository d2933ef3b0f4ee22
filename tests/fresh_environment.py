"""A virtual environment with a wheel and exactly what the wheel asks for, made without the network.

The distributions that the wheel's requirements name, and theirs in turn, are linked file by file out of the running
environment, whose locked packages they are. pip then installs the wheel itself, without an index: it refuses where one
of the requirements is not there in the version asked for.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterable
from importlib.metadata import Distribution, PackageNotFoundError, PathDistribution, distribution
from pathlib import Path
from zipfile import Path as ZipPath

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name


def install(wheel: Path, extras: tuple[str, ...], folder: Path) -> Path:
    """Make the environment in ``folder``; returns its Python."""
    venv.create(folder, with_pip=False, symlinks=os.name == "posix")
    scripts = folder / ("Scripts" if os.name == "nt" else "bin")
    python = scripts / ("python.exe" if os.name == "nt" else "python")
    site = _site_packages(python)
    for one in needed(_metadata(wheel), extras):
        _link(one, site)
    wanted = f"{wheel}[{','.join(extras)}]" if extras else str(wheel)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", str(python)]
    command = [*pip, "install", "--quiet", "--no-index", "--no-compile", wanted]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return python


def needed(wheel: Distribution, extras: Iterable[str]) -> list[Distribution]:
    """Every installed distribution that the requirements of a wheel with these extras lead to, its own excepted."""
    found: dict[str, Distribution] = {}
    waiting = [(wheel, frozenset(extras))]
    done = set()
    while waiting:
        asking, of = waiting.pop()
        for text in asking.requires or ():
            requirement = Requirement(text)
            marker, name = requirement.marker, canonicalize_name(requirement.name)
            applies = marker is None or any(marker.evaluate({"extra": extra}) for extra in (*of, ""))
            key = (name, frozenset(requirement.extras))
            if applies and key not in done:
                done.add(key)
                found[name] = _installed(name)
                waiting.append((found[name], key[1]))
    return list(found.values())


def _installed(name: str) -> Distribution:
    try:
        return distribution(name)
    except PackageNotFoundError:
        raise AssertionError(f"{name}, which the wheel asks for, is not installed: it is in no lock") from None


def _metadata(wheel: Path) -> Distribution:
    (info,) = (path for path in ZipPath(wheel).iterdir() if path.name.endswith(".dist-info"))
    return PathDistribution(info)  # type: ignore[arg-type]  # a path in a zip does what is asked of it


def _site_packages(python: Path) -> Path:
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    done = subprocess.run([str(python), "-c", ask], capture_output=True, text=True, check=True, timeout=60)
    return Path(done.stdout.strip())


def _link(one: Distribution, site: Path) -> None:
    for file in one.files or ():
        source, target = Path(str(one.locate_file(file))), Path(os.path.normpath(site / file))
        if source.is_file() and not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                os.link(source, target)
            except OSError:  # another file system
                shutil.copy2(source, target)
