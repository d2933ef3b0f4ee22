"""`vfix report`: HTML on recorded runs, with the figures of scores and series; a free hand is told apart (HAZ-41)."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.exchange.run_report.figures import BOTTOM, HEIGHT, TOP, Axes, PlottedLine, figure, ticks
from app.exchange.run_report.report import MOST_RUNS, report_html, speed_of
from app.exchange.run_report.reported import RunToReport
from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.runtime import Command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.requests import SetSettings
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec


class Page(HTMLParser):
    """Text by class of the element, and everything that refers to something outside of the page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.references: list[str] = []
        self.rows: list[list[str]] = []
        self._cell = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.references += [value or "" for name, value in attrs if name in ("src", "href", "xlink:href", "data")]
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th") and self.rows:
            self.rows[-1].append("")
            self._cell = True

    def handle_endtag(self, tag: str) -> None:
        self._cell = self._cell and tag not in ("td", "th")

    def handle_data(self, data: str) -> None:
        if self._cell:
            self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A push of 6 N towards a wall, of a hand on the robot and of a free one, which enters it."""
    scene = SceneSpec.of(straight_scene(wall(4.0)))
    settings, place = ControlSettings(), tmp_path_factory.mktemp("runs")
    for spec in (RigidSpec(scene, settings), FreehandSpec(scene, replace(settings, dt_s=0.02))):
        system = spec.build()
        writer = RunWriter(place / spec.world, spec, system.row_layout)
        driver = Driver(system, log=writer)
        for _ in range(round(2.0 / spec.control.dt_s)):
            driver.step(Command(np.array([0.0, 6.0, 0.0])))
        writer.close()
    return place / "rigid", place / "freehand"


def test_runs_are_compared_on_one_page_without_the_network(
    folders: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "report.html"
    assert main(["report", *map(str, folders), "-o", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["file"] == str(file)
    text = file.read_text(encoding="utf-8")
    page = Page(text)
    assert page.references == []
    assert "@page { size: A4" in text
    assert not re.search(r"url\(|@import|https?://", text)
    assert "Run B was driven by a free hand: bone does not stop the tool." in text
    assert text.count("Without the certificate") == 1
    rigid, free = (RunToReport(Run.read(folder), folder.name) for folder in folders)
    rows = {row[0]: row[1:] for row in page.rows if row}
    assert rows[""] == ["A" + "hands-on", "B" + "freehand, without the certificate"]
    assert rows["Contacts"] == ["0", "1"]
    assert rows["Deepest contact, mm"] == ["0.00", f"{free.score.max_depth_mm:.2f}"]
    least = [one.score.least_clearance_mm["bone"] for one in (rigid, free)]
    assert rows["Least clearance, bone, mm"] == [f"{value:.2f}".replace("-", "−") for value in least]
    assert least[1] < 0.0 < rigid.spec.control.margin_mm <= least[0]
    assert rows["Margin kept by the certificate, mm"] == [f"{rigid.spec.control.margin_mm:.2f}", "none"]
    assert rows["Held, s"][0] == f"{rigid.score.held_s:.1f}"
    reasons = {(row[0], row[3]) for row in page.rows if len(row) == 5}
    assert free.holds
    for one, label in ((rigid, "A"), (free, "B")):
        for hold in one.holds[:3]:
            assert (label, hold.reason[:1].upper() + hold.reason[1:]) in reasons
    for value in least:
        assert f"{value:.2f} mm to bone".replace("-", "−") in text
    assert main(["report", str(folders[1]), "-o", str(file)]) == 0
    single = file.read_text(encoding="utf-8")
    assert "Driven by a free hand: bone does not stop the tool." in single
    assert f'<dt>Contacts</dt><dd><b class="caution">{free.score.contacts}</b>' in single


def test_the_margin_is_what_was_kept_and_a_recording_that_lacks_something_is_told(
    folders: tuple[Path, Path], tmp_path: Path
) -> None:
    """The first settings of a drive say neither what was set later, nor what is added for the surface."""
    spec = RigidSpec(SceneSpec.of(straight_scene(wall(4.0))), ControlSettings(dt_s=0.005, surface_error_mm=0.1))
    system = spec.build()
    writer = RunWriter(tmp_path / "one", spec, system.row_layout)
    driver = Driver(system, log=writer)
    driver.step(Command(np.zeros(3)))
    driver.apply(SetSettings(replace(spec.control, margin_mm=0.1)))
    driver.step(Command(np.zeros(3)))
    writer.abandon()
    cut, whole = Run.read(tmp_path / "one.part"), Run.read(folders[0])
    page = Page(report_html([RunToReport(cut, "cut"), RunToReport(whole, "whole")]))
    rows = {row[0]: row[1:] for row in page.rows if row}
    assert rows["Margin kept by the certificate, mm"] == ["0.20 – 0.40", "0.30"]
    assert rows["Recording"] == ["interrupted", "whole"]
    holey = RunToReport(replace(whole, lost=3), "holey")
    assert "3 steps lost" in report_html([holey])
    assert "Recording" not in report_html([RunToReport(whole, "whole")])


def test_a_curve_is_drawn_where_its_values_are() -> None:
    x, y = np.linspace(0.0, 10.0, 4001), np.full(4001, 2.0)
    y[1234], y[2000:2400] = 0.5, np.nan
    svg = figure(Axes("mm", "Clearance", (1.0, "margin")), [PlottedLine(x, y, "#000", worst=-1, mark=(1234, "here"))])
    lines = [
        np.array([[float(value) for value in pair.split(",")] for pair in points.split()])
        for points in re.findall(r'points="([^"]+)"', svg)
    ]
    assert len(lines) == 2, "nothing is drawn where there is no value"
    per_mm = (HEIGHT - TOP - BOTTOM) / 2.0
    low, high = max(line[:, 1].max() for line in lines), min(line[:, 1].min() for line in lines)
    assert (low, high) == pytest.approx((HEIGHT - BOTTOM - 0.5 * per_mm, TOP), abs=0.01), "one sample of 4,001"
    (cx, cy) = map(float, *re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', svg))
    assert cy == pytest.approx(low, abs=0.01)
    assert cx == pytest.approx(np.interp(x[1234], [0, 10], [lines[0][0, 0], 176.0]), abs=0.5)
    assert figure(Axes("mm", "Clearance"), [PlottedLine(x, np.full(4001, np.nan), "#000")]) == ""
    for low_high in ((0.0, 9e-5), (-0.3, 3.0), (0.0, 88.2)):
        found = ticks(*low_high, 4)
        assert found[0] <= low_high[0] + 1e-12
        assert found[-1] >= low_high[1] - 1e-12
        assert 2 <= len(found) <= 7
        np.testing.assert_allclose(np.diff(found), found[1] - found[0])


def test_speed_is_that_of_the_tip(folders: tuple[Path, Path]) -> None:
    series = RunToReport(Run.read(folders[1]), "one").series
    speed = speed_of(series)
    gone = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(series.tip, axis=0), axis=1)))
    for i in (20, 50, 80):
        expected = (gone[i] - np.interp(series.t[i] - 0.05, series.t, gone)) / 0.05
        assert speed[i] == pytest.approx(expected, rel=0.3, abs=0.05)


def test_what_cannot_be_reported_is_refused(
    folders: tuple[Path, Path], old_runs: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "report.html"
    for runs, name, words in (
        ([str(folders[0])], "report.pdf", "ends in .html"),
        ([str(folders[0])] * (MOST_RUNS + 1), "report.html", "1 to 6 runs"),
        ([str(folders[0]), old_runs["snake"]], "report.html", "one kind of runs"),
        (["run-nobody"], "report.html", "run-nobody"),
    ):
        assert main(["report", *runs, "-o", str(tmp_path / name)]) == 2
        assert words in capsys.readouterr().err
    assert not file.exists()
