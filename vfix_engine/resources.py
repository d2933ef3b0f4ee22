"""Where the files that travel with vfix are: in the wheel beside the code, in a checkout at the top."""

from __future__ import annotations

from pathlib import Path


def assets_dir() -> Path:
    """Folder of the shipped assets (phantom, robots, tools, sample plans)."""
    installed = Path(__file__).resolve().parent / "assets"
    return installed if installed.is_dir() else installed.parents[1] / "assets"
