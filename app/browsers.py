"""Find a Chromium-family browser, and open an address in the user's own one without showing it to other users.

Standard library only: the set-up scripts use it as well.
"""

import contextlib
import html
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

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
    neither hidden folders nor the system's temporary one.
    """
    descriptor, name = tempfile.mkstemp(prefix="vfix-opens-", suffix=".html", dir=Path.home())
    try:
        with open(descriptor, "w", encoding="utf-8") as file:
            file.write(_REDIRECT.format(address=html.escape(address)))
        yield Path(name)
    finally:
        Path(name).unlink(missing_ok=True)


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
