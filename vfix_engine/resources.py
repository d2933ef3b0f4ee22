"""Location of the shipped files: beside the code in a wheel, at the top of a checkout."""

from __future__ import annotations

from pathlib import Path


def assets_dir() -> Path:
    """Return the folder of the shipped assets (phantom, robots, tools, sample plans)."""
    installed = Path(__file__).resolve().parent / "assets"
    return installed if installed.is_dir() else installed.parents[1] / "assets"
