"""Study II in the Drive tab: what is cut by messages is what the stored run is worth, to the last bit."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from lumen_driving import Driving, stored
from session_doubles import send

from app.cases.model import CAVITY_PHANTOM
from app.drives import commands as drives
from app.drives.shared_drives import SharedDrives
from app.services import Services
from app.tabs.drive import commands as c
from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.runtime.run import Run
from vfix_engine.study.diathermy.labels import Label
from vfix_engine.study.diathermy.table import measured
from vfix_engine.study.diathermy.task import table_iv
from vfix_engine.worlds.snake.cavity import cavity_case

# The straight robot looks up from (0, 0, 159). A hand to the right moves the marker to the right by as much as it goes
# on this label 40 mm ahead; another one is hidden by the wall, 125 mm ahead.
TO_CUT = Label(np.array([18.0, 0.0, 199.0]), np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0]), "before the camera")
HIDDEN = Label(np.array([-10.0, 0.0, 299.0]), np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0]), "behind the wall")
RIGHT, STILL = (drives.MoveAxes(type="axes", camera_x=share) for share in (0.3, 0.0))


@pytest.fixture
def shared() -> Iterator[SharedDrives[Any, Any]]:
    made: SharedDrives[Any, Any] = SharedDrives()
    yield made
    made.close()


def test_a_label_that_is_cut_by_messages_has_the_score_of_its_run(
    phantom_services: Services, shared: SharedDrives[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    routes = phantom_services.lumen_routes
    monkeypatch.setattr(routes.tasks, "labels", lambda route, choice: SimpleNamespace(labels=(TO_CUT, HIDDEN)))
    (route,) = routes.documents.list(CAVITY_PHANTOM)
    client = Driving(phantom_services, shared)
    client.open(route)
    send(client.tab, "drive.task", task="labels", seed=5)
    send(client.tab, "rehearsal.start")
    now = client.until(lambda shown: shown["rehearsal"]["state"] == "running")["drive_task"]["labels"]
    assert (now["traced"], now["aimed"], now["cutting"]) == (0, None, False)  # the marker's label is behind the wall

    def labels(shown: dict[str, Any]) -> dict[str, Any]:
        found: dict[str, Any] = shown["drive_task"]["labels"]
        return found

    client.tab.handle_now(c.CutTool(type="drive.cut", on=True))
    client.until(lambda shown: labels(shown)["cutting"] and labels(shown)["labels"][0]["end_mm"] > -5.0, RIGHT)
    client.tab.handle_now(STILL)
    client.tab.handle_now(c.CutTool(type="drive.cut", on=False))
    left = labels(client.until(lambda shown: not labels(shown)["cutting"]))["labels"][0]["end_mm"]
    assert -5.0 < left < 10.0
    client.tab.handle_now(c.CutTool(type="drive.cut", on=True))
    client.until(lambda shown: labels(shown)["traced"] == 1, RIGHT)
    client.tab.handle_now(STILL)
    client.tab.handle_now(c.CutTool(type="drive.cut", on=False))
    assert not labels(client.shown())["completed"]
    send(client.tab, "rehearsal.pause")
    client.until(lambda shown: shown["rehearsal"]["state"] == "paused")
    watch = client.tab.now.prepared.task  # type: ignore[union-attr]
    assert watch is not None
    assert watch.trouble == ""
    send(client.tab, "rehearsal.end")

    (run,) = stored(phantom_services, route)
    with phantom_services.runs.laid_out(run.id) as place:
        read = Run.read(place)
    found = measured(read, Wall(cavity_case().mesh).free)
    assert [one.to_dict() for one in found.labels] == [TO_CUT.to_dict(), HIDDEN.to_dict()]
    assert found.state == watch.state  # type: ignore[attr-defined]
    assert found.red.any()
    score = phantom_services.run_scores.of(run.id)["task"]
    rows = {row["name"]: row["value"] for row in score["rows"]}
    row = table_iv(found.state)[0]
    assert (score["title"], score["completed"], score["lacking"]) == ("Labels", False, "")
    assert (rows["Labels traced"], rows["Labels missed"]) == (1.0, 1.0)
    assert rows["Time per label"] == row["time_s"]
    assert rows["Angle error"] == row["angle_error_deg"]
    assert rows["Distance from the arrow"] == row["line_error_mm"]
    done = [
        {"name": f"Label {n}", "done_s": one.done_s, "share": (one.end_mm + 10.0) / 20.0}
        for n, one in enumerate(found.state.labels, start=1)
    ]
    assert score["items"] == done
    assert phantom_services.run_scores.task(run.id).at(1e4).state == watch.state  # type: ignore[union-attr]
