"""The Review tab replays a task: polyps and labels as they were at the moment that is shown, forwards and backwards."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lumen_cases import TUBE_MM, tube, tube_mesh
from session_doubles import CLIENT, HEAD, Now, sections_of, send

from app.cases.model import CAVITY_PHANTOM
from app.kit.errors import NotFound
from app.services import Services
from app.tabs.review.tab import ReviewTab
from app.workspace.workspace import Workspace
from vfix_engine.errors import InputError
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import BUTTON_CUT, COMMAND_SIZE, Command, command_to_row, no_command
from vfix_engine.runtime.requests import Note
from vfix_engine.runtime.run import RunWriter
from vfix_engine.study.diathermy import table
from vfix_engine.study.diathermy.labels import Label
from vfix_engine.study.polyps.printed import PROUD_MM
from vfix_engine.study.polyps.series import task_note
from vfix_engine.study.polyps.task import Polyp, PolypTask, surface_hash
from vfix_engine.worlds.snake import DriveSpec
from vfix_engine.worlds.snake.cavity import cavity_case
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.spec import LumenContours

DT, HOLD_S = 0.1, 1.0
CUT = replace(no_command(), buttons=BUTTON_CUT)
LABELS = tuple(Label(np.array([18.0, 0.0, z]), -np.eye(3)[2], np.eye(3)[0], "") for z in (199.0, 600.0))


def polyp(z: float) -> Polyp:
    """On the axis of the tube."""
    return Polyp(z, (0.0, -PROUD_MM, z), (0.0, 1.0, 0.0), (0.0, 0.0, z))


def kept(services: Services, case_id: str, note: Note, steps: list[tuple[float, float, Command]]) -> str:
    """A run of a straight robot of two links along z; steps: place of its base on x and z in mm, and the command."""
    line = np.column_stack([np.zeros((9, 2)), np.linspace(0.0, TUBE_MM, 9)])
    spec = DriveSpec(LumenContours(line, np.full((9, 1), 14.0)), SnakeModel(2), drive=DriveSettings(manipulated=2))
    names = [column.name for column in spec.columns]
    folder: Path = services.runs.new_folder()
    writer = RunWriter(folder, spec, spec.columns, 3)
    writer.event("request", note)
    for number, (x, z, command) in enumerate(steps):
        row = dict.fromkeys(names, 0.0) | {"t": DT * (number + 1), "tip_s": z, "tip_x": x, "tip_z": z + 56.0}
        row |= {"base_00": 1.0, "base_11": 1.0, "base_22": 1.0, "base_03": x, "base_23": z, "beyond_bound": -1.0}
        line_of = np.array([*np.zeros(COMMAND_SIZE), *(row[name] for name in names)])
        command_to_row(command, line_of[:COMMAND_SIZE])
        writer.tick(line_of)
    writer.close()
    return services.runs.keep(folder, origin="page", case_id=case_id).id


class Reviewed:
    """A client in the Review tab of a case."""

    def __init__(self, services: Services, case_id: str, run: str) -> None:
        self.workspace = Workspace(CLIENT, services, Now(), lambda request: request())
        self.tab, self.run = ReviewTab(self.workspace), run
        self.workspace.open_case(case_id)
        self.tab.active = True

    def at(self, t_s: float) -> dict[str, Any]:
        send(self.tab, "review.moment", run=self.run, t_s=t_s)
        told: dict[str, Any] = sections_of(self.tab)["replayed_task"]
        assert (told["run"], told["waits"], told["words"]) == (self.run, False, "")
        return told

    def drawn(self) -> Any:
        """The key of the one layer."""
        (layer,) = self.tab.layers()
        return layer.key


def test_polyps_are_shown_as_they_were(phantom_services: Services) -> None:
    case = tube(phantom_services)
    task = PolypTask((polyp(100.0), polyp(150.0)), 0.0, 155.0, hold_s=HOLD_S, surface=surface_hash(tube_mesh()))
    far, near = 0.0, 100.0 - 15.0 - 56.0 - 6.0  # the base from where a camera 6 mm before the tip is 15 mm away
    run = kept(phantom_services, case.id, task_note(task), [(0.0, z, no_command()) for z in [far] * 5 + [near] * 15])
    review = Reviewed(phantom_services, case.id, run)

    first = review.at(0.3)["now"]
    assert (first["cleared"], first["viewed"], first["of"], first["hold_s"]) == (0, False, 2, HOLD_S)
    assert [(polyp["at"][2], polyp["colour"]) for polyp in first["polyps"]] == [(100.0, 0.0), (150.0, 0.0)]
    assert [shape.name for shape in review.drawn()] == ["1", "2"]
    blue = review.drawn()
    viewed = review.at(1.1)["now"]
    assert (viewed["viewed"], viewed["held_s"], viewed["cleared"]) == (True, 0.5, 0)
    assert [round(polyp["colour"], 2) for polyp in viewed["polyps"]] == [1.0, 0.0]  # at the best place
    assert review.drawn()[0].colour != blue[0].colour
    assert review.drawn()[1].colour == blue[1].colour
    end = review.at(99.0)["now"]
    assert (end["cleared"], [polyp["cleared"] for polyp in end["polyps"]]) == (1, [True, False])
    assert [shape.name for shape in review.drawn()] == ["1 ✓", "2"]
    assert review.at(0.3)["now"] == first
    assert review.drawn() == blue  # backwards too

    with pytest.raises(NotFound):
        send(review.tab, "review.moment", run="nobody", t_s=0.0)
    send(review.tab, "review.moment", run=None)
    assert (sections_of(review.tab)["replayed_task"], review.tab.layers()) == (None, [])
    review.at(0.3)
    review.tab.leave()
    assert sections_of(review.tab)["replayed_task"] is None
    review.workspace.open_case(HEAD)
    with pytest.raises(InputError, match="another case"):
        send(review.tab, "review.moment", run=run, t_s=0.0)


def test_labels_are_shown_with_what_was_left_on_them_and_the_way_of_the_tip(phantom_services: Services) -> None:
    mesh = phantom_services.cases.case_surface(CAVITY_PHANTOM)
    assert surface_hash(mesh) == surface_hash(cavity_case().mesh)
    # The marker goes along the arrow of the first label, from its tail at 8 mm; the button is let go of at 22.5 mm.
    along = [(8.0 + 0.5 * step, 100.0, CUT if 1 <= step < 30 else no_command()) for step in range(40)]
    run = kept(phantom_services, CAVITY_PHANTOM, table.task_note(LABELS, 5, surface_hash(mesh)), along)
    review = Reviewed(phantom_services, CAVITY_PHANTOM, run)

    def at(t_s: float) -> tuple[dict[str, Any], float, int]:
        labels = review.at(t_s)["labels"]
        first, second, way = review.drawn()
        assert (first, second) == (labels["labels"][0]["end_mm"], -10.0)
        return labels, first, way

    whole, end, way = at(0.0)
    assert (whole["traced"], whole["aimed"], whole["cutting"], end, way) == (0, None, False, -10.0, 0)
    between, end, some = at(1.55)
    assert (between["aimed"], between["cutting"]) == (1, True)
    assert end == pytest.approx(-3.0, abs=0.21)
    let_go, end, more = at(99.0)
    assert (let_go["aimed"], let_go["cutting"], let_go["traced"]) == (1, False, 0)
    assert end == pytest.approx(4.5, abs=0.21)
    assert 5 < some < more
    again, _, way = at(1.55)
    assert (again, way) == (between, some)  # backwards too
