"""The picture of the shipped plan, and a drive along a path."""

from __future__ import annotations

from .named_page import NamedPage


def planned(page: NamedPage) -> None:
    page.go_to("Plan")
    page.judged()
    page.press("Oblique")
    page.take("plan")


def drive(page: NamedPage, to_mm: float) -> None:
    """Drive forwards along the path by key."""
    station = page.station
    reached = lambda: station.rehearsal()["progress_mm"] >= to_mm  # noqa: E731
    station.drive_until("ArrowUp", f"{to_mm:g} mm of the path", reached, 120.0)
    page.page.keyboard.up("ArrowUp")
