"""The wheel alone serves the page: it carries the shell, the migrations and the assets, and stays small."""

import os
import re
import subprocess
import sys
import urllib.request
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MAX_WHEEL_BYTES = 30 * 2**20


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
    benchmarks = [f"benchmarks/{path.name}" for path in (ROOT / "benchmarks").glob("*.py")]
    assert set(benchmarks) <= names
    assert not [name for name in names if name.startswith("tests/")]
    assert wheel.stat().st_size < MAX_WHEEL_BYTES


def test_it_serves_the_page_without_the_checkout(wheel: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "installed")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("VFIX_")}
    environment |= {"PYTHONPATH": str(tmp_path / "installed"), "VFIX_HOME": str(tmp_path / "home")}
    command = [sys.executable, "-m", "app.cli", "serve", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True) as process:
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
    with opener.open(f"{address[0].split('?')[0]}api/cases", timeout=60) as cases:
        assert b"head-phantom" in cases.read()
