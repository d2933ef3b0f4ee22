"""Find a Chromium-family browser, and open an address in the user's own one without showing it to other users.

Standard library only: the set-up scripts use it as well.
"""

import contextlib
import html
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

PAGE_STAYS_S = 120.0  # a slow browser has read the page by then
_PAGE = ("vfix-opens-", ".html")
_COMMANDS = (
    "chromium",
    "chromium-browser",
    "google-chrome-stable",
    "google-chrome",
    "chrome",
    "microsoft-edge-stable",
    "microsoft-edge",
    "msedge",
)
_MAC_APPLICATIONS = (
    "Google Chrome.app/Contents/MacOS/Google Chrome",
    "Chromium.app/Contents/MacOS/Chromium",
    "Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
_WINDOWS_PROGRAMS = (
    "Google/Chrome/Application/chrome.exe",
    "Chromium/Application/chrome.exe",
    "Microsoft/Edge/Application/msedge.exe",
)


def find_browser() -> str | None:
    """Path of a Chrome, Chromium or Edge: VFIX_BROWSER first, then the search path, then the usual places."""
    asked_for = os.environ.get("VFIX_BROWSER")
    if asked_for:
        return shutil.which(asked_for)
    on_path = (shutil.which(command) for command in _COMMANDS)
    in_place = (str(place) for place in _usual_places() if place.is_file())
    return next((found for found in (*on_path, *in_place) if found), None)


@contextlib.contextmanager
def private_page(address: str) -> Iterator[Path]:
    """A file that sends a browser on to `address`; only its owner can read it, and it is removed in the end.

    A browser is told where to go on its command line, which every user of the machine can read: the address with its
    token does not belong there. The file lies in the home folder itself, since browsers that come as snaps read
    neither hidden folders nor the system's temporary one. Raises OSError where there is no home folder or no room.
    """
    descriptor, name = tempfile.mkstemp(prefix=_PAGE[0], suffix=_PAGE[1], dir=_home())
    try:
        with open(descriptor, "w", encoding="utf-8") as file:
            file.write(_REDIRECT.format(address=html.escape(address)))
        yield Path(name)
    finally:
        Path(name).unlink(missing_ok=True)


def remove_old_pages() -> None:
    """Remove the pages that planners have left which were killed; those of one that runs are younger."""
    with contextlib.suppress(OSError):
        for page in _home().glob(f"{_PAGE[0]}????????{_PAGE[1]}"):
            with contextlib.suppress(OSError):
                if time.time() - page.lstat().st_mtime > 2.0 * PAGE_STAYS_S:
                    page.unlink()


def _home() -> Path:
    try:
        return Path.home()
    except RuntimeError as error:
        raise OSError(str(error)) from error


_REDIRECT = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>vfix</title><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={address}"></head>
<body><p><a href="{address}">Open the planner</a></p></body></html>
"""


def _usual_places() -> list[Path]:
    if sys.platform == "darwin":
        folders = [Path("/Applications"), Path.home() / "Applications"]
        return [folder / application for folder in folders for application in _MAC_APPLICATIONS]
    if sys.platform == "win32":
        variables = ("PROGRAMFILES", "PROGRAMFILES(X86)", "LOCALAPPDATA")
        folders = [Path(os.environ[name]) for name in variables if name in os.environ]
        return [folder / program for folder in folders for program in _WINDOWS_PROGRAMS]
    return [Path("/opt/google/chrome/chrome"), Path("/snap/bin/chromium")]
