"""The openings of a head: found once, stored beside the case and not in it; over REST and on the command line."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rest_client import Client
from session_doubles import HEAD, case_of_ct

from app.cases.service import CaseFrame
from app.commands import case_openings
from app.imaging import openings
from app.imaging.openings import Openings
from app.services import Services
from vfix_engine.anatomy.nostrils import Nostril
from vfix_engine.anatomy.phantom import load_nose_ct
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume


@pytest.fixture
def services(phantom_services: Services) -> Services:
    return phantom_services


@pytest.fixture
def nothing_left(services: Services) -> Iterator[None]:
    yield
    for file in derived(services):
        file.unlink()


def derived(services: Services) -> list[Path]:
    return sorted(services.settings.derived_dir.glob(f"*.{Openings.file}"))


def not_found_again(volume: Volume, **more: object) -> object:
    raise AssertionError("the openings are known")


def nostrils(*sides: str) -> tuple[Nostril, ...]:
    at = {"right": -7.0, "left": 7.0, "": 0.0}
    return tuple(Nostril(side, np.array([at[side], 1.0, 2.0]), np.array([0.0, 0.6, 0.8]), 4.0) for side in sides)  # type: ignore[arg-type]


@pytest.mark.usefixtures("nothing_left")
@pytest.mark.parametrize("sides", [("right", "left"), ("left",), ("",), ()], ids=str)
def test_they_are_found_once_and_read_again(
    services: Services, monkeypatch: pytest.MonkeyPatch, sides: tuple[str, ...]
) -> None:
    hu = np.full((8, 8, 8), -1000, np.int16)
    hu[2:6, 2:6, 2:6], hu[0, 0, 0] = 900, 10 * len(sides) + len("".join(sides))  # no two scans are the same
    case = case_of_ct(services, "Box", Volume(hu, np.zeros(3), np.ones(3), np.eye(3)))
    monkeypatch.setattr(openings, "nostrils_of_volume", lambda volume, **more: nostrils(*sides))
    job = services.jobs.wait(services.openings.start(case.id).id, 60.0)
    assert (job.state, job.kind, job.case_id, job.result) == ("done", "openings", case.id, case.id)
    found = services.openings.make(case.id)
    assert tuple(one.side for one in found.items) == sides
    assert [one.name for one in found.items] == [f"{side} nostril".strip().capitalize() for side in sides]
    (file,) = derived(services)
    monkeypatch.setattr(openings, "nostrils_of_volume", not_found_again)
    assert Openings(services.store, services.cases, services.jobs).make(case.id) == found
    monkeypatch.setattr(openings, "nostrils_of_volume", lambda volume, **more: nostrils(*sides))
    whole = file.read_bytes()
    for damaged in (whole[:300], whole.replace(np.float64(0.8).tobytes(), np.float64(np.nan).tobytes())):
        file.write_bytes(damaged)
        assert Openings(services.store, services.cases, services.jobs).make(case.id) == found
        assert file.read_bytes() == whole or not sides
    services.cases.delete(case.id)


def test_only_the_ct_of_a_head_has_them(services: Services) -> None:
    surfaces = {"bone": services.cases.case_surface(HEAD)}
    bare = services.cases.create("Bare", frame=CaseFrame("LPS", False), surfaces=surfaces)
    with pytest.raises(InputError, match="only the CT of a head"):
        services.openings.make(bare.id)
    services.cases.delete(bare.id)


@pytest.mark.usefixtures("nothing_left")
def test_rest_and_the_command_line_say_where_they_are(
    services: Services, client: Client, capsys: pytest.CaptureFixture[str]
) -> None:
    case = case_of_ct(services, "Nose", load_nose_ct())
    job = client.post(f"/api/v1/cases/{case.id}/openings")
    assert (job.status_code, job.json()["kind"], job.json()["case_id"]) == (202, "openings", case.id)
    assert services.jobs.wait(job.json()["id"], 60.0).result == case.id
    told = client.get(f"/api/v1/cases/{case.id}/openings").json()
    assert [(one["id"], one["name"]) for one in told] == [
        ("nostril-right", "Right nostril"),
        ("nostril-left", "Left nostril"),
    ]
    assert case_openings.run(argparse.Namespace(json=True), services, case) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["case"] == case.id
    assert printed["openings"] == [pytest.approx(one) if isinstance(one, float) else one for one in told]
    assert case_openings.run(argparse.Namespace(json=False), services, case) == 0
    x, y, z = told[0]["position"]
    assert f"Right nostril: {x:.1f} {y:.1f} {z:.1f} mm (LPS)" in capsys.readouterr().out
    assert client.get("/api/v1/cases/nothing/openings").status_code == 404
    assert client.post("/api/v1/cases/nothing/openings").status_code == 404
    services.cases.delete(case.id)
