"""Cases: every coordinate comes back, names are kept as typed, deletion can be taken back."""

import hashlib
from dataclasses import asdict

import numpy as np
import pytest

from app.cases.service import Case, CaseBead, CaseFrame, CaseService
from app.cases.structures import Provenance, is_closed, within_a_sentence
from app.kit.cache import Cache
from app.kit.errors import NotFound
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services, build_services
from app.store import Store
from app.store.errors import StoreDamaged
from app.store.models import CaseRow
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.resources import assets_dir

LPS = CaseFrame("LPS", assumed=False)


def a_volume() -> Volume:
    hu = np.arange(60, dtype=np.int16).reshape(3, 4, 5)
    return Volume(hu, np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.25, 2.0]), np.eye(3))


def test_a_case_comes_back_bit_for_bit(store: Store, cases: CaseService, case: Case) -> None:
    mesh = cases.case_surface(case.id)
    bead = CaseBead("bead 1", (1.0, 2.0, 3.0))
    frame = CaseFrame("RAS", assumed=True)
    made = cases.create("CT", frame=frame, surfaces={"bone": mesh}, volume=a_volume(), beads=(bead,))
    again = CaseService(store)
    known = again.get(made.id)
    assert known == made
    assert (known.spacing_mm, known.has_volume, known.beads, known.frame) == ((0.5, 0.25, 2.0), True, (bead,), frame)
    assert np.array_equal(again.case_surface(made.id).vertices, mesh.vertices)
    volume = again.volume(again.get(made.id))
    assert volume is not None
    assert np.array_equal(volume.hu, a_volume().hu)
    assert np.array_equal(volume.spacing, a_volume().spacing)


def test_a_surface_alone_has_no_volume_and_shows_its_bone(cases: CaseService, case: Case) -> None:
    assert cases.volume(case) is None
    assert list(cases.display_meshes(case.id)) == ["bone"]


def test_the_hash_follows_the_content_not_the_name(cases: CaseService, case: Case) -> None:
    mesh = cases.case_surface(case.id)
    assert cases.create("Other", frame=LPS, surfaces={"bone": mesh}).content_hash == case.content_hash
    moved = TriangleMesh(mesh.vertices + 1e-9, mesh.faces)
    assert cases.create("Moved", frame=LPS, surfaces={"bone": moved}).content_hash != case.content_hash


def test_a_case_is_renamed_and_deleted_in_one_transaction(store: Store, cases: CaseService, case: Case) -> None:
    before = store.changes.count
    changed = cases.change(case.id, name="Gone", deleted=True)
    assert (changed.name, bool(changed.deleted_at), store.changes.count) == ("Gone", True, before + 1)
    with pytest.raises(InputError, match="empty"):
        cases.change(case.id, name="", deleted=False)
    assert cases.get(case.id) == changed


def test_deleted_cases_leave_the_list_and_come_back(cases: CaseService, case: Case) -> None:
    cases.delete(case.id)
    assert cases.list() == ()
    assert [c.id for c in cases.list(include_deleted=True)] == [case.id]
    assert cases.restore(case.id) == case
    assert cases.list() == (case,)


@pytest.mark.parametrize("name", ["<img src=x onerror=alert(1)>", "Müller-Weiß ♥ 头", " padded "])
def test_names_are_kept_as_typed(cases: CaseService, case: Case, name: str) -> None:
    """HAZ-32: nothing is stripped or escaped here; who shows a name shows it as text."""
    assert cases.rename(case.id, name).name == name


@pytest.mark.parametrize(
    "name",
    [
        "",
        "  ",
        "a\nb",
        "a\0b",
        "x" * 121,
        "abc\u202etxt",
        "\ud800",
        "a\u2028b",
        "\u200b",
        "\ufeff \u2060",
        "\u3164",
        "\u0301",
        "a\ufffe",
        "a\ufdd0",
        "a\U0010ffff",
    ],
)
def test_names_that_hide_or_break_something_are_refused(cases: CaseService, case: Case, name: str) -> None:
    with pytest.raises(InputError):
        cases.rename(case.id, name)
    with pytest.raises(InputError):
        cases.create(name, frame=LPS, surfaces={"bone": cases.case_surface(case.id)})
    assert cases.get(case.id) == case


def test_what_is_not_there_is_said(cases: CaseService, case: Case) -> None:
    for call in (cases.get, cases.rename, cases.delete, cases.restore, cases.case_surface):
        with pytest.raises(NotFound):
            call(*("nobody", "name")[: 2 if call == cases.rename else 1])
    with pytest.raises(NotFound, match="bone"):
        cases.case_surface(case.id, "brain")
    with pytest.raises(InputError):
        cases.create("No bone", frame=LPS, surfaces={})


def test_the_head_phantom_is_there_with_a_plan(phantom_services: Services) -> None:
    case = phantom_services.cases.embedded_case()
    assert case.frame == LPS
    assert [volume.name for volume in case.volumes] == ["head", "nose"]
    assert "bone" not in phantom_services.cases.display_meshes(case.id)
    assert len(case.beads) == 5
    assert len(phantom_services.plans.get(SAMPLE_PLAN).content.points) >= 6


def test_what_a_user_did_to_the_phantom_stays(phantom_services: Services) -> None:
    cases, plans = phantom_services.cases, phantom_services.plans
    case = cases.embedded_case()
    cases.rename(case.id, "My head")
    plans.documents.delete(SAMPLE_PLAN)
    again = build_services(phantom_services.settings)
    try:
        assert again.cases.embedded_case().name == "My head"
        assert again.plans.get(SAMPLE_PLAN).deleted_at is not None
    finally:
        again.close()
        cases.rename(case.id, case.name)
        plans.documents.restore(SAMPLE_PLAN)


def test_the_cache_keeps_the_newest_and_forgets_failures() -> None:
    cache: Cache[str, int] = Cache(2)
    made: list[str] = []

    def make(key: str) -> int:
        made.append(key)
        return len(made)

    for key in "abacab":
        cache.get(key, lambda key=key: make(key))
    assert "".join(made) == "abcb"
    with pytest.raises(ZeroDivisionError):
        cache.get("z", lambda: 1 // 0)
    assert cache.get("z", lambda: 7) == 7


def test_a_head_is_driven_beside_its_bone_and_a_lumen_within_its_wall(cases: CaseService, case: Case) -> None:
    mesh = cases.case_surface(case.id)
    lumen = cases.create("Colon", frame=LPS, surfaces={"outside": mesh, "lumen": mesh}, kind="lumen")
    assert (case.kind, case.anatomy.id, lumen.kind, lumen.anatomy.id) == ("head", "bone", "lumen", "lumen")
    assert cases.tree(lumen).mesh.content_hash == mesh.content_hash
    assert list(cases.display_meshes(lumen.id)) == ["outside"]
    assert lumen.surface_uncertainty_mm is None
    for kind, missing in (("head", {"lumen": mesh}), ("lumen", {"bone": mesh})):
        with pytest.raises(InputError, match=f"needs a {'bone' if kind == 'head' else 'lumen'} surface"):
            cases.create("None", frame=LPS, surfaces=missing, kind=kind)  # type: ignore[arg-type]


def test_structures_are_found_by_id_and_told_by_name(cases: CaseService, case: Case) -> None:
    assert case.structure("bone").provenance == Provenance("surface")
    assert cases.structure_mesh(case.id, "bone").content_hash == cases.case_surface(case.id, "bone").content_hash
    assert (case.structure_words("bone"), case.structure_words("optic-nerve")) == ("Bone", "optic-nerve")
    assert case.structure_names() == {"bone": "bone"}
    assert [within_a_sentence(name) for name in ("Optic nerve", "ICA", "")] == ["optic nerve", "ICA", ""]
    with pytest.raises(NotFound, match=r"no structure 'Bone'.*bone"):
        cases.structure_mesh(case.id, "Bone")


def test_a_surface_has_an_inside_where_it_is_closed(case: Case, cases: CaseService) -> None:
    whole = cases.case_surface(case.id)
    assert case.structure("bone").has_inside is True
    turned = whole.faces.copy()
    turned[0] = turned[0][::-1]
    for faces in (whole.faces[1:], turned, [*whole.faces, whole.faces[0]]):
        assert not is_closed(TriangleMesh(whole.vertices, faces))


def test_a_structure_of_an_unknown_role_or_none_at_all_is_damage(store: Store, cases: CaseService, case: Case) -> None:
    for wrong in ([], [{**asdict(case.structures[0]), "role": "brain"}], [{"id": "bone"}]):
        with store.writing() as session:
            row = session.get(CaseRow, case.id)
            assert row is not None
            row.document = {**row.document, "structures": wrong}
        with pytest.raises(StoreDamaged):
            cases.get(case.id)


def test_the_bone_of_the_shipped_head_is_a_structure(phantom_services: Services) -> None:
    bone = phantom_services.cases.embedded_case().structure("bone")
    file = (assets_dir() / "head_phantom" / "bone_nose.ply").read_bytes()
    assert bone.geometry == f"sha256:{hashlib.sha256(file).hexdigest()}"
    assert (bone.provenance, bone.deviation_mm) == (Provenance("shipped"), 0.112)
