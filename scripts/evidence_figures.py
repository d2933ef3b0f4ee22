"""Figures of docs/evidence.md from the traces in docs/evidence/li2004.json and li2007.json, as SVG beside them."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from benchmarks.plots import ACCENT, INK, MARK, SOFT, empty_figure
from vfix_engine.robots import RobotModel
from vfix_engine.study.experiment.apparatus import ROBOT

REPORTS = Path(__file__).resolve().parents[1] / "docs" / "evidence"
COLOURS = {"freehand": SOFT, "hands-on": ACCENT, "teleoperated": MARK}
DASHES = {"freehand": "-", "hands-on": "-", "teleoperated": (0, (4, 1.5))}
WIDTH, LEFT = 7.5, 0.75  # inches
AROUND_MM = 45.0  # of the tool's shaft before the entry
CLOSE_MM = {"flat_mm": 0.5, "seen_mm": 5.0}  # half of the width of a close-up

Trials = Mapping[str, Mapping[str, Any]]
Make = Callable[[Mapping[str, Any]], Figure]


def drawn(report: Mapping[str, Any]) -> dict[str, str]:
    """Every figure as SVG by its file name; equal reports give equal text."""
    study = report["study"]
    return {f"{study}_{number}.svg": _svg(make(report["traces"])) for number, make in FIGURES[study].items()}


def inspection(traces: Mapping[str, Any]) -> Figure:
    """Figure 7: the tip about the target."""
    figure = empty_figure(WIDTH, 3.9, LEFT, "The tip about the inspected target", "One trial; hand on the handle.")
    trial = traces["trials"]["inspection"]
    for place, (name, words) in enumerate((("off_mm", "by encoders"), ("seen_off_mm", "by the tracker"))):
        axes = _axes(figure, place, 2, 3.9)
        points = np.array(trial[name])
        axes.plot(points[:, 0], points[:, 2], "+", color=ACCENT, markersize=4, markeredgewidth=0.7)
        axes.plot([0.0], [0.0], "o", color=MARK, markersize=5, fillstyle="none")
        axes.set(xlabel=f"to the left, mm, {words}", ylabel="up, mm" if place == 0 else "")
        most = 1.15 * float(np.abs(points[:, [0, 2]]).max())
        axes.set(xlim=(-most, most), ylim=(-most, most), aspect="equal")
    return figure


def swept(mode: str, title: str) -> Make:
    """Figures 8 and 9: the tool in some poses of a trial, in the plane of the path."""

    def make(traces: Mapping[str, Any]) -> Figure:
        figure = empty_figure(WIDTH, 3.7, LEFT, title, "The tool's axis in 24 poses, in the plane of the path.")
        axes = _axes(figure, 0, 1, 3.7)
        for pose in traces["trials"][mode]["tool"]:
            points = np.array(pose)
            axes.plot(points[:, 0], points[:, 1], color=ACCENT, linewidth=0.8, alpha=0.5)
        path = np.array(traces["path"])
        axes.plot(path[:, 0], path[:, 1], color=INK, linewidth=1.4)
        if mode == "inspection":
            axes.plot(*traces["target"], "o", color=MARK, markersize=6, fillstyle="none")
        axes.set(xlim=(path[:, 0].min() - AROUND_MM, path[:, 0].max() + 10.0), aspect="equal", anchor="W")
        axes.set(ylim=(path[:, 1].min() - 15.0, path[:, 1].max() + 25.0))
        axes.set(xlabel="along the path's plane, mm", ylabel="across, mm")
        return figure

    return make


def errors(name: str, modes: Sequence[str], title: str) -> Make:
    """Figures 11 and 15: the error of one trial in each mode over time."""

    def make(traces: Mapping[str, Any]) -> Figure:
        figure = empty_figure(WIDTH, 3.3, LEFT, title, "One trial of one simulated subject in each mode.")
        axes = _axes(figure, 0, 1, 3.3)
        for mode in modes:
            trial = traces["trials"][mode]
            axes.plot(trial["t_s"], trial[name], color=COLOURS[mode], linestyle=DASHES[mode], linewidth=1.2, label=mode)
        axes.set(xlabel="time, s", ylabel="error, mm", xlim=(0.0, None), ylim=(0.0, None))
        axes.legend(frameon=False, fontsize=8.5)
        return figure

    return make


def along(modes: Sequence[str], title: str) -> Make:
    """Figure 6 of Li 2004: the error of one trial in each mode along the path, the robot's by its encoders."""

    def make(traces: Mapping[str, Any]) -> Figure:
        below = "One trial of the simulated user; freehand by the tracker, hands-on by the encoders."
        figure = empty_figure(WIDTH, 3.3, LEFT, title, below)
        axes = _axes(figure, 0, 1, 3.3)
        for mode in modes:
            trial = traces["trials"][mode]
            axes.plot(trial["progress_mm"], trial["seen_error_mm"], color=COLOURS[mode], linewidth=1.2, label=mode,
                      linestyle="-" if mode == "hands-on" else (0, (4, 1.5)))  # fmt: skip
        axes.set(xlabel="along the path, mm", ylabel="error, mm", xlim=(0.0, None), ylim=(0.0, None))
        axes.legend(frameon=False, fontsize=8.5)
        return figure

    return make


def paths(name: str, error: str, modes: Sequence[str], title: str) -> Make:
    """Figures 12 and 16: the way of the tip in the plane of the path, and close up."""

    def make(traces: Mapping[str, Any]) -> Figure:
        height = 5.6
        below = "In the plane of the path; below close up, where hands-on is farthest off, and stretched across."
        figure = empty_figure(WIDTH, height, LEFT, title, below)
        path, ways = np.array(traces["path"]), {mode: np.array(traces["trials"][mode][name]) for mode in modes}
        half = CLOSE_MM[name]
        middle = float(ways["hands-on"][int(np.argmax(traces["trials"]["hands-on"][error])), 0])
        for bottom, tall in ((3.05, 1.65), (0.55, 1.95)):
            axes = figure.add_axes((LEFT / WIDTH, bottom / height, 1.0 - (LEFT + 0.25) / WIDTH, tall / height))
            _quiet(axes)
            axes.plot(path[:, 0], path[:, 1], color=INK, linewidth=2.4, alpha=0.3, label="path")
            for mode, way in ways.items():
                axes.plot(way[:, 0], way[:, 1], color=COLOURS[mode], linestyle=DASHES[mode], linewidth=1.1, label=mode)
            axes.set_ylabel("across, mm")
            axes.ticklabel_format(useOffset=False)
            if bottom > 1.0:
                axes.set(aspect="equal", anchor="W")
                axes.legend(frameon=False, fontsize=8.5, loc="center left", bbox_to_anchor=(0.3, 0.3), ncols=2)
            else:
                near = [way[np.abs(way[:, 0] - middle) < half, 1] for way in (path, *ways.values())]
                low, high = min(one.min() for one in near if len(one)), max(one.max() for one in near if len(one))
                edge = 0.1 * (high - low)
                axes.set(xlim=(middle - half, middle + half), ylim=(low - edge, high + edge))
                axes.set_xlabel("along, mm")
        return figure

    return make


def velocities(revolute: bool, title: str) -> Make:
    """Figures 13 and 14: speeds of the joints, hands-on and teleoperated."""

    def make(traces: Mapping[str, Any]) -> Figure:
        robot = RobotModel.load(ROBOT)
        joints = [number for number, turning in enumerate(robot.revolute) if bool(turning) == revolute]
        height = 1.1 + 1.0 * len(joints)
        figure = empty_figure(WIDTH, height, LEFT, title, "Left hands-on, right teleoperated; one trial of each.")
        speeds = {mode: np.array(traces["trials"][mode]["speed"]) for mode in ("hands-on", "teleoperated")}
        scale = float(np.degrees(1.0)) if revolute else 1.0
        for row, joint in enumerate(joints):
            most = 1.05 * scale * max(float(np.abs(one[joint]).max()) for one in speeds.values())
            for place, (mode, speed) in enumerate(speeds.items()):
                bottom = (0.5 + (len(joints) - 1 - row) * 1.0) / height
                across = (WIDTH - LEFT - 0.9) / 2.0
                left = (LEFT + place * (across + 0.5)) / WIDTH
                axes = figure.add_axes((left, bottom, across / WIDTH, 0.72 / height))
                _quiet(axes)
                axes.plot(traces["trials"][mode]["t_s"], scale * speed[joint], color=COLOURS[mode], linewidth=0.9)
                axes.set(ylim=(-most, most), xlim=(0.0, None))
                axes.xaxis.set_major_locator(MaxNLocator(integer=True))
                axes.tick_params(labelsize=7.5, labelbottom=row == len(joints) - 1)
                if place == 0:
                    axes.set_ylabel(f"joint {joint + 1}", fontsize=8.5)
                if row == len(joints) - 1:
                    axes.set_xlabel("time, s")
        return figure

    return make


OF_2004: Mapping[int, Make] = {
    5: swept("hands-on", "The tool during path following with the robot"),
    6: along(("freehand", "hands-on"), "Error along the path"),
}
OF_2007: Mapping[int, Make] = {
    7: inspection,
    8: swept("inspection", "The tool during target inspection"),
    9: swept("hands-on", "The tool during path following, hands-on"),
    11: errors("error_mm", ("hands-on", "teleoperated"), "Error by the encoders"),
    12: paths("flat_mm", "error_mm", ("hands-on", "teleoperated"), "The tip by the encoders"),
    13: velocities(False, "Speeds of the prismatic joints, mm/s"),
    14: velocities(True, "Speeds of the revolute joints, degrees/s"),
    15: errors("seen_error_mm", ("freehand", "hands-on", "teleoperated"), "Error by the tracker"),
    16: paths("seen_mm", "seen_error_mm", ("freehand", "hands-on", "teleoperated"), "The tip by the tracker"),
}
FIGURES: Mapping[str, Mapping[int, Make]] = {"li2004": OF_2004, "li2007": OF_2007}


def _axes(figure: Figure, place: int, of: int, height: float) -> Axes:
    """Axes below the title: the ``place``-th of some beside each other."""
    across = (WIDTH - LEFT - 0.25 - 0.6 * (of - 1)) / of
    left = (LEFT + place * (across + 0.6)) / WIDTH
    axes = figure.add_axes((left, 0.55 / height, across / WIDTH, (height - 1.35) / height))
    _quiet(axes)
    return axes


def _quiet(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(visible=True, linewidth=0.6)
    axes.set_axisbelow(True)


def _svg(figure: Figure) -> str:
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"


def main() -> int:
    """Write the figures."""
    for study in FIGURES:
        report = json.loads((REPORTS / f"{study}.json").read_text(encoding="utf-8"))
        for name, text in drawn(report).items():
            (REPORTS / name).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
