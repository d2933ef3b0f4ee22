"""The wheel alone: what it carries, and what it can do installed with the engine only and with the page."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import urllib.request
import zipfile
from pathlib import Path
from typing import Any

import pytest

from tests import fresh_environment
from vfix_engine.anatomy.phantom import load_landmarks

ROOT = Path(__file__).resolve().parent.parent
MAX_WHEEL_BYTES = 30 * 2**20
EXAMPLE = ROOT / "docs" / "examples" / "02_follow_a_path.py"
PUSHING = ("--operator", "pushing", "--steps", "20")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, capture_output=True, check=True, timeout=120)
    return next(folder.glob("*.whl"))


def test_it_carries_what_the_page_needs(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    shipped = [f"vfix_engine/{path.relative_to(ROOT)}" for path in (ROOT / "assets").rglob("*") if path.is_file()]
    web = [str(path.relative_to(ROOT)) for path in (ROOT / "app" / "web").rglob("*") if path.is_file()]
    assert {name.replace(os.sep, "/") for name in (*shipped, *web)} <= names
    libraries = {f"app/web/lib/{name}/LICENSE" for name in ("lit-html", "uplot")}
    assert libraries | {"app/web/lib/lit-html/lit-html.js", "app/web/lib/uplot/dist/uPlot.esm.js"} <= names
    benchmarks = [f"benchmarks/{path.name}" for path in (ROOT / "benchmarks").glob("*.py")]
    assert set(benchmarks) <= names
    assert not [name for name in names if name.startswith("tests/")]
    assert wheel.stat().st_size < MAX_WHEEL_BYTES


@pytest.fixture(scope="module")
def engine_only(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """What `pip install vfix` makes."""
    return Installed(fresh_environment.install(wheel, (), tmp_path_factory.mktemp("engine")))


@pytest.fixture(scope="module")
def with_app(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """What `pip install 'vfix[app]'` makes."""
    return Installed(fresh_environment.install(wheel, ("app",), tmp_path_factory.mktemp("app")))


class Installed:
    """An environment with the wheel in it, away from the checkout."""

    def __init__(self, python: Path) -> None:
        self.python, self.folder = python, python.parent

    def environment(self) -> dict[str, str]:
        """Compiled kernels are those of the checkout: their sources are the same."""
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("VFIX_", "PYTHON"))}
        cache = {"VFIX_CACHE": os.environ["VFIX_CACHE"]} if "VFIX_CACHE" in os.environ else {}
        return kept | cache | {"VFIX_HOME": str(self.folder / "home"), "PYTHONUTF8": "1"}

    def run(self, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        command = [str(self.python), *map(str, arguments)]
        return subprocess.run(
            command, cwd=self.folder, env=self.environment(), capture_output=True, text=True, timeout=300, check=False
        )

    def vfix(self, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        """The command that pip has made."""
        vfix = self.folder / ("vfix.exe" if os.name == "nt" else "vfix")
        command = [str(vfix), *map(str, arguments)]
        return subprocess.run(
            command, cwd=self.folder, env=self.environment(), capture_output=True, text=True, timeout=300, check=False
        )

    def answer(self, *arguments: str | Path) -> dict[str, Any]:
        done = self.vfix(*arguments, "--json")
        assert done.returncode == 0, done.stderr
        answer: dict[str, Any] = json.loads(done.stdout)
        return answer


def test_the_engine_works_on_files_without_the_page(engine_only: Installed, tmp_path: Path) -> None:
    health = engine_only.answer("doctor")
    assert health["app_installed"] is False
    assert health["packages"]["fastapi"] is None
    assert health["packages"]["pin"]
    assert health["problems"] == []
    ask = "from vfix_engine.resources import assets_dir; print(assets_dir())"
    surface = Path(engine_only.run("-c", ask).stdout.strip()) / "head_phantom" / "bone_nose.ply"
    assert engine_only.folder.parent in surface.parents
    driven = engine_only.answer("rehearse", "--case", surface, "--plan", _corridor(tmp_path), *PUSHING)
    assert driven["min_clearance_mm"] >= driven["margin_mm"]
    done = engine_only.run(EXAMPLE)
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_without_the_page_the_other_verbs_say_what_to_install(engine_only: Installed) -> None:
    for arguments in (
        ("serve",),
        ("import", "ct.nrrd"),
        ("case", "list"),
        ("plan", "list"),
        ("rehearse", "--case", "head-phantom", "--plan", "head-phantom-sample"),
        ("bench", "start"),
        ("bench", "durability"),
    ):
        done = engine_only.vfix(*arguments)
        assert done.returncode == 2, arguments
        assert "pip install 'vfix[app]'" in done.stderr, arguments
        assert "Traceback" not in done.stderr
    told = json.loads(engine_only.vfix("case", "list", "--json").stdout)
    assert told["error"]["code"] == "app_missing"
    for verb in ("rehearse", "score", "lumen", "bench", "doctor"):
        assert engine_only.vfix(verb, "--help").returncode == 0


def _corridor(folder: Path) -> Path:
    """A plan as a table: the corridor of the head that comes along."""
    rows = [f"P{i},{','.join(map(str, point.position))}" for i, point in enumerate(load_landmarks().corridor)]
    file = folder / "corridor.csv"
    file.write_text("\n".join(["# frame=LPS", "# unit=mm", "label,x,y,z", *rows, ""]), encoding="utf-8")
    return file


def test_the_page_is_served_and_a_stored_case_driven_without_the_checkout(with_app: Installed) -> None:
    assert with_app.answer("doctor")["app_installed"] is True
    driven = with_app.answer("rehearse", "--case", "head-phantom", "--plan", "head-phantom-sample", *PUSHING)
    assert driven["min_clearance_mm"] >= driven["margin_mm"]
    done = with_app.run(EXAMPLE)
    assert done.returncode == 0, done.stderr
    command = [str(with_app.python), "-m", "app.cli", "serve", "--no-browser", "--port", "0"]
    options: dict[str, Any] = {"cwd": with_app.folder, "env": with_app.environment(), "stdout": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **options) as process:
        try:
            assert process.stdout is not None
            _look_at_the_page(process.stdout.readline())
        finally:
            process.terminate()
            process.wait(20)


def _look_at_the_page(line: str) -> None:
    address = re.search(r"http\S+", line)
    assert address, line
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(), urllib.request.ProxyHandler({}))
    with opener.open(address[0], timeout=60) as page:
        assert b"Not for clinical use" in page.read()
    with opener.open(f"{address[0].split('?')[0]}static/lib/lit-html/lit-html.js", timeout=60) as library:
        assert library.headers.get_content_type() == "text/javascript"
        assert b"BSD-3-Clause" in library.read()
    with opener.open(f"{address[0].split('?')[0]}api/v1/cases", timeout=60) as cases:
        assert b"head-phantom" in cases.read()
