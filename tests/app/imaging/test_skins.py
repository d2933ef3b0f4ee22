"""The skin of a case: made once, stored beside the case and not in it, gone with it; and what a click on it means."""

from __future__ import annotations

import argparse
import io
import json
import stat
import zipfile
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from session_doubles import HEAD, Now, case_of_ct

from app.cases.purge import Purge
from app.cases.service import Case, CaseFrame
from app.commands import case_skin
from app.exchange.patient_images import FACE_WARNING
from app.imaging import skins
from app.imaging.derived_of_ct import _key_of
from app.imaging.skins import Skins
from app.kit.errors import NotFound
from app.scene import palette
from app.scene.view import ClickRay
from app.services import Services
from app.workspace.case_view import CaseView
from app.workspace.commands import SetView
from vfix_engine.errors import ImageError, InputError
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.files.volume import Volume

MIDDLE, SKIN, BONE = 24.0, 18.0, 10.0  # mm: centre and radii of a ball of tissue around one of bone


SCANS, COLOUR = count(), palette.hex_colour(palette.SKIN)


def ct(number: int) -> Volume:
    """No two of one number: cases of the same scan share their skin."""
    k, j, i = np.indices((48, 48, 48)).astype(float) - MIDDLE
    r = np.sqrt(i**2 + j**2 + k**2)
    hu = np.where(r < BONE, 900.0, np.clip(-300.5 + 500.0 * (SKIN - r), -1000.0, 40.0))
    hu[0, 0, 0] = number
    return Volume(hu.astype(np.int16), np.zeros(3), np.ones(3), np.eye(3))


@pytest.fixture
def services(phantom_services: Services) -> Services:
    return phantom_services


@pytest.fixture
def case(services: Services) -> Case:
    return case_of_ct(services, "Ball", ct(next(SCANS)))


@pytest.fixture(autouse=True)
def nothing_left(services: Services) -> Iterator[None]:
    yield
    for file in derived(services):
        file.unlink()


def derived(services: Services) -> list[Path]:
    folder = services.settings.derived_dir
    return sorted(folder.iterdir()) if folder.exists() else []


def not_made(volume: Volume, **more: object) -> object:
    raise AssertionError("the skin is known")


def test_it_is_made_once_and_read_again(services: Services, case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    job = services.jobs.wait(services.skins.start(case.id).id, 60.0)
    assert (job.state, job.kind, job.case_id, job.result) == ("done", "skin", case.id, case.id)
    (file,) = derived(services)
    assert file.name.startswith(case.volumes[0].source.removeprefix("sha256:"))
    again = Skins(services.store, services.cases, services.jobs)
    with monkeypatch.context() as patch:
        patch.setattr(skins, "skin_of_volume", not_made)
        mesh = again.make(case.id)
    assert np.abs(np.linalg.norm(mesh.vertices - MIDDLE, axis=1) - SKIN).max() < 0.2
    file.write_bytes(file.read_bytes()[:500])
    mended = Skins(services.store, services.cases, services.jobs).make(case.id)
    assert np.array_equal(mended.vertices, mesh.vertices)
    assert len(file.read_bytes()) > 500


def test_no_export_holds_it_and_a_purge_takes_it(services: Services, case: Case) -> None:
    """HAZ-34: it is a face."""
    target = [io.BytesIO(), io.BytesIO()]
    services.archive_writer.write(case.id, target[0])
    before = services.cases.get(case.id)
    mesh = services.skins.make(case.id)
    services.archive_writer.write(case.id, target[1])
    assert services.cases.get(case.id) == before
    names = [zipfile.ZipFile(one).namelist() for one in target]
    assert names[0] == names[1]
    held = b"".join(zipfile.ZipFile(target[1]).read(name) for name in names[1])
    assert mesh.vertices[:4].tobytes() not in held
    (file,) = derived(services)
    volume = services.cases.volume(case)
    assert volume is not None
    other = case_of_ct(services, "The same scan", volume)
    Purge(services.store).run(case.id)
    assert derived(services) == [file], "another case has this scan"
    services.purge.run(other.id)
    assert derived(services) == []
    assert not services.skins._known.has(file.name.partition(".")[0]), "it is a face, in memory too"


def test_the_command_line_asks_before_it_writes_a_face(
    services: Services, case: Case, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "face.ply"
    wanted = argparse.Namespace(output=file, with_images=False, json=True)
    with pytest.raises(InputError, match="--with-images"):
        case_skin.run(wanted, services, case)
    assert not file.exists()
    wanted.with_images = True
    assert case_skin.run(wanted, services, case) == 0
    for written in (file, *derived(services)):
        assert stat.S_IMODE(written.stat().st_mode) == 0o600
    mesh, _ = read_mesh(file)
    assert json.loads(capsys.readouterr().out) == {"case": case.id, "file": str(file), "triangles": len(mesh.faces)}
    assert np.array_equal(mesh.vertices, services.skins.make(case.id).vertices)


def test_only_the_ct_of_a_head_has_one(services: Services) -> None:
    surfaces = {"bone": services.cases.case_surface(HEAD)}
    bare = services.cases.create("Bare", frame=CaseFrame("LPS", False), surfaces=surfaces)
    with pytest.raises(InputError, match="only the CT of a head"):
        services.skins.start(bare.id)
    view = opened(services, bare.id)
    view.handle(SetView(type="view.set", skin=True))
    assert skin_of(view) == {
        "possible": False,
        "shown": False,
        "opacity": 0.5,
        "colour": COLOUR,
        "words": "only the CT of a head shows skin.",
    }


def opened(services: Services, case_id: str) -> CaseView:
    view = CaseView(services, Now(), lambda request: request())
    view.open(case_id)
    return view


def skin_of(view: CaseView) -> object:
    return view.sections()["view"].build()["skin"]  # type: ignore[index]


def test_a_click_on_it_means_the_air_before_it(services: Services, case: Case) -> None:
    view = opened(services, case.id)
    ray = ClickRay(np.array([200.0, MIDDLE, MIDDLE + 3.0]), np.array([-1.0, 0.0, 0.0]))

    def hit() -> tuple[str, float]:
        found = view.hit(ray)
        assert found is not None
        return found.kind, float(np.linalg.norm(found.position - MIDDLE))

    assert hit() == ("bone", pytest.approx(BONE, abs=0.5))
    view.handle(SetView(type="view.set", skin=True, skin_opacity=0.6))
    assert skin_of(view) == {"possible": True, "shown": True, "opacity": 0.6, "colour": COLOUR, "words": FACE_WARNING}
    assert hit() == ("skin", pytest.approx(SKIN + 1.0, abs=0.1))
    view.handle(SetView(type="view.set", cut="left"))
    kind, _ = hit()
    assert kind == "bone", "the half that is cut away lets it through"
    view.handle(SetView(type="view.set", cut="whole", skin=False))
    assert hit()[0] == "bone"
    assert [layer.name for layer in view.layers()][-1] == "case.skin", "hidden, it stays in the scene"
    view.open(case.id)
    assert skin_of(view) == {"possible": True, "shown": False, "opacity": 0.6, "colour": COLOUR, "words": ""}


def test_a_skin_that_cannot_be_made_is_told_and_a_cancelled_one_is_not(
    services: Services, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(volume: Volume, **more: object) -> object:
        raise ImageError("this CT shows no air.")

    def cancelled(volume: Volume, *, progress: object) -> object:
        services.jobs.cancel(services.jobs.going_on()[1][-1].id)
        progress("Finding the skin", 0.5)  # type: ignore[operator]
        raise AssertionError

    view = opened(services, case.id)
    for make, words in ((fails, "this CT shows no air."), (cancelled, "")):
        monkeypatch.setattr(skins, "skin_of_volume", make)
        view.handle(SetView(type="view.set", skin=True))
        assert skin_of(view) == {"possible": True, "shown": False, "opacity": 0.5, "colour": COLOUR, "words": words}
    assert derived(services) == []


def test_a_start_removes_what_a_kill_has_left(services: Services, case: Case) -> None:
    """Of a case that was removed for good while its skin was made; not that of a case which is only deleted."""
    services.skins.make(case.id)
    shipped = _key_of(services.cases.get(HEAD))
    services.store.derived.put(shipped, Skins.file, lambda file: file.write(b"of the head that comes along"))
    kept = derived(services)
    assert len(kept) == 2
    services.store.derived.put("0" * 64, Skins.file, lambda file: file.write(b"a face"))
    services.cases.delete(case.id)
    services.sweep()
    assert derived(services) == kept


def test_a_case_removed_meanwhile_does_not_take_the_skin_of_another(
    services: Services, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both have one scan, and so one job."""
    volume = services.cases.volume(case)
    assert volume is not None
    other = case_of_ct(services, "The same scan", volume)
    made = skins.skin_of_volume

    def removed(volume: Volume, **more: object) -> object:
        services.purge.run(case.id)
        return made(volume, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(skins, "skin_of_volume", removed)
    job = services.jobs.wait(services.skins.start(case.id).id, 60.0)
    assert (job.state, len(derived(services))) == ("done", 1)
    monkeypatch.setattr(skins, "skin_of_volume", not_made)
    services.skins.make(other.id)


def test_the_skin_of_a_case_removed_meanwhile_is_not_kept(
    services: Services, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = skins.skin_of_volume

    def removed(volume: Volume, **more: object) -> object:
        services.purge.run(case.id)
        return made(volume, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(skins, "skin_of_volume", removed)
    with pytest.raises(NotFound):
        services.skins.make(case.id)
    assert derived(services) == []
