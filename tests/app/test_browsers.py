"""The search for a browser."""

import os
import time
from pathlib import Path

import pytest

from app import browsers


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A machine without any browser; returns a folder on its search path."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("VFIX_BROWSER", raising=False)
    monkeypatch.setattr(browsers, "_usual_places", list)
    return tmp_path


def program(place: Path) -> str:
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text("", encoding="utf-8")
    place.chmod(0o755)
    return str(place)


def test_none(machine: Path) -> None:
    assert browsers.find_browser() is None


def test_on_the_search_path_and_in_the_usual_places(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = program(machine / "elsewhere" / "Google Chrome")
    monkeypatch.setattr(browsers, "_usual_places", lambda: [machine / "missing", Path(usual)])
    assert browsers.find_browser() == usual
    on_path = program(machine / "chromium")
    assert browsers.find_browser() == on_path


def test_the_one_that_is_named_or_none(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program(machine / "chromium")
    named = program(machine / "elsewhere" / "my-browser")
    monkeypatch.setenv("VFIX_BROWSER", named)
    assert browsers.find_browser() == named
    monkeypatch.setenv("VFIX_BROWSER", str(machine / "missing"))
    assert browsers.find_browser() is None


@pytest.mark.parametrize(("platform", "expected"), [("darwin", "Google Chrome"), ("win32", "chrome.exe")])
def test_every_platform_has_usual_places(platform: str, expected: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(browsers.sys, "platform", platform)
    monkeypatch.setenv("PROGRAMFILES", "/programs")
    assert any(place.name == expected for place in browsers._usual_places())


def test_pages_that_killed_planners_left_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-27: they hold the token; the page of a planner that has just started, and other files, stay."""
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    old, other = tmp_path / "vfix-opens-0123abc_.html", tmp_path / "vfix-opens-the-planner.html"
    for file in (old, other):
        file.touch()
        os.utime(file, (time.time() - 300.0,) * 2)
    with browsers.private_page("http://127.0.0.1:1/?token=x") as young:
        browsers.remove_old_pages()
        assert sorted(tmp_path.iterdir()) == sorted([young, other])


def test_a_user_without_a_home_folder_gets_no_page(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", none)
    browsers.remove_old_pages()
    with pytest.raises(OSError, match="home directory"), browsers.private_page("http://127.0.0.1:1/"):
        pass
