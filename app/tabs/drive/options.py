"""The section of what is chosen for drives of a lumen."""

from __future__ import annotations

from app.lumen.drive_options import LINKS, LumenDriveOptions
from app.tabs.drive.sections import DriveOptionsView, LinkValuesView


def options_view(options: LumenDriveOptions, open_: bool) -> DriveOptionsView:
    """The choice, and the values that each distal link has by it. open_: this client may change it."""
    from vfix_engine.snake.haptics.haptics import HapticSettings

    usual = HapticSettings().for_links(LINKS)
    bounds = options.bounds_mm or (None,) * LINKS
    thresholds = options.thresholds_mm or usual.threshold
    springs = options.springs_n_per_mm or usual.spring
    links: list[LinkValuesView] = [
        {"bound_mm": bound, "threshold_mm": threshold, "spring_n_per_mm": spring}
        for bound, threshold, spring in zip(bounds, thresholds, springs, strict=True)
    ]
    return {"arm": options.arm, "preset": options.preset, "links": links, "open": open_}
