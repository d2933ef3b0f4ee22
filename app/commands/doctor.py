"""`vfix doctor`: check this machine and report problems."""

import argparse
import json
import os
import platform
import re
import sys
import tempfile
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from app import __version__
from app.browsers import find_browser
from app.extras import has_app
from app.settings import Settings
from vfix_engine.errors import VfixError
from vfix_engine.files.sandbox import confinement
from vfix_engine.files.sandbox.isolated import run_isolated
from vfix_engine.kernels import kernel_cache
from vfix_engine.runtime.priority import why_not

_REMEDY = "run scripts/start.py again, or pip install 'vfix[app]'"


@dataclass(frozen=True)
class Health:
    """Result of the check; `problems` has a sentence for each problem.

    app_installed: whether page, store and server are installed; `packages` has null for missing packages of theirs,
        which is no problem for an installation of the engine alone.
    kernel_cache: folder of the compiled kernels, null without a cache; compiled_kernels: their number.
    database_copies: copies of the database from before upgrades, by name, with their size in bytes, the newest last.
    worker_is_kept_from: restrictions of the import worker on this machine, tested.
    real_time_priority: whether a rehearsal gets one; without_priority_because: the reason, '' where it does.
    """

    vfix: str
    python: str
    platform: str
    cores: int
    packages: dict[str, str | None]
    app_installed: bool
    browser: str | None
    home: str
    home_writable: bool
    database_copies: dict[str, int]
    compiled_kernels: int
    kernel_cache: str | None
    real_time_priority: bool
    without_priority_because: str
    worker_is_kept_from: dict[str, bool]
    problems: tuple[str, ...]


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> argparse.ArgumentParser:
    """Declare the options of `vfix doctor`."""
    parser = subparsers.add_parser("doctor", help="check this machine", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser


def run(args: argparse.Namespace) -> int:
    """Print the result; 1 when there is a problem."""
    health = examine(Settings.from_environment())
    if args.json:
        print(json.dumps(asdict(health)))
    else:
        _print_for_people(health)
    return 1 if health.problems else 0


def examine(settings: Settings) -> Health:
    """Check this machine without changing it."""
    requirements = _requirements()
    engine, page = dependencies(requirements), dependencies(requirements, "app")
    packages = {name: _version(name) for name in sorted((*engine, *page))}
    home_writable = _is_writable(settings.home)
    kernels, without = _kernel_folder(), why_not()
    problems = [f"The package {name} is missing: {_REMEDY}." for name in _missing(packages, page)]
    if not requirements:
        problems.append(f"vfix is not installed in this Python, so its packages cannot be checked: {_REMEDY}.")
    if not home_writable:
        problems.append(f"The data folder {settings.home} cannot be written: set VFIX_HOME to one that can.")
    if why := _why_closed(settings):
        problems.append(why)
    return Health(
        vfix=__version__,
        python=platform.python_version(),
        platform=platform.platform(),
        cores=os.cpu_count() or 1,
        packages=packages,
        app_installed=has_app(),
        browser=find_browser(),
        home=str(settings.home),
        home_writable=home_writable,
        database_copies={copy.name: copy.stat().st_size for copy in settings.database_copies},
        compiled_kernels=0 if kernels is None else sum(1 for _ in kernels.rglob("*.nbc")),
        kernel_cache=None if kernels is None else str(kernels),
        real_time_priority=not without,
        without_priority_because=without,
        worker_is_kept_from=_worker(),
        problems=tuple(problems),
    )


def _requirements() -> list[str]:
    try:
        return requires("vfix") or []
    except PackageNotFoundError:
        return []


def dependencies(requirements: list[str], extra: str = "") -> list[str]:
    """Names of the packages that an extra brings; without one, of those that every installation has.

    requirements: as `importlib.metadata.requires` returns them, such as `viser==1.1.1; extra == 'app'`.
    """
    names = []
    for one in requirements:
        package, _, marker = one.partition(";")
        named = re.search(r"extra == ['\"]([\w.-]+)['\"]", marker)
        if (named[1] if named else "") == extra:
            names.append(re.split(r"[^\w.-]", package, maxsplit=1)[0])
    return names


def _missing(packages: dict[str, str | None], page: list[str]) -> list[str]:
    """Missing packages: of the engine, and of the page if more than half of its packages are installed.

    Fewer, such as pydantic, can come with something else.
    """
    absent = [name for name, version in packages.items() if version is None]
    without_page = 2 * sum(name in absent for name in page) >= len(page)
    return [name for name in absent if not (without_page and name in page)]


def _why_closed(settings: Settings) -> str:
    """Why the store cannot be opened; '' where it can, or without the application that has one."""
    if not has_app():
        return ""
    from app.store.looking import check_store

    try:
        check_store(settings)
    except VfixError as error:
        return f"The store of {settings.home} cannot be opened: {error}"
    return ""


def _worker() -> dict[str, bool]:
    """Restrictions of a worker, tested with a file of another folder; empty where it does not run."""
    with tempfile.TemporaryDirectory(prefix="vfix-doctor-") as folder:
        file = Path(folder) / "file"
        file.touch()
        try:
            return run_isolated(confinement.probe, str(file))
        except VfixError:
            return {}


def _kernel_folder() -> Path | None:
    """Folder of compiled kernels: NUMBA_CACHE_DIR where it is set, else the user's cache folder."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    return Path(named) if named else kernel_cache.cache_folder()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _is_writable(folder: Path) -> bool:
    """Whether `folder`, or its nearest existing parent, is writable."""
    existing = next(place for place in (folder, *folder.parents) if place.exists())
    try:
        with tempfile.TemporaryFile(dir=existing):
            return True
    except OSError:
        return False


def _print_for_people(health: Health) -> None:
    print(f"vfix {health.vfix} on Python {health.python}, {health.platform}, {health.cores} cores")
    if not health.app_installed:
        print("page, store and server: not installed; pip install 'vfix[app]' brings them")
    print(f"browser: {health.browser or 'none found; the page opens in any browser you start yourself'}")
    print(f"data folder: {health.home} ({'writable' if health.home_writable else 'NOT writable'})")
    for name, size in health.database_copies.items():
        print(f"copy of the database from before an upgrade: {name}, {size / 1e6:.1f} MB")
    if health.kernel_cache is None:
        print("compiled kernels: cannot be kept, so every start compiles them; VFIX_CACHE names another folder")
    else:
        print(f"compiled kernels: {health.compiled_kernels} in {health.kernel_cache}")
    print(f"real-time priority while somebody drives: {health.without_priority_because or 'yes'}")
    kept = [name.replace("_", " ") for name, held in health.worker_is_kept_from.items() if held]
    open_to = [name.replace("_", " ") for name, held in health.worker_is_kept_from.items() if not held]
    print(f"the reader of files from outside is kept from: {', '.join(kept) or 'nothing'}")
    if open_to:
        print(f"but not from: {', '.join(open_to)}; what it reads is limited in time and memory only")
    for problem in health.problems:
        print(problem, file=sys.stderr)
