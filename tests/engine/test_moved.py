"""Names of version 0.1 that were printed in docs and examples still lead to what they name."""

import sys
import warnings
from importlib import import_module

import pytest

from vfix_engine.moved import MOVED, RENAMED, current_class, current_name

# What docs, examples and the changelog of version 0.1 print: module, names in it.
PRINTED = {
    "vfix_engine": "fixtures",
    "vfix_engine.fixtures": "Constraint DeeperPlace Objective OrientationCone RemoteCentre Rows Situation SoftRegion "
    "SoftZone StepState Zone weighted zones",
    "vfix_engine.geometry.distance_field": "field_of_level",
    "vfix_engine.geometry.path": "SplinePath",
    "vfix_engine.geometry.proximity": "ProximityTree",
    "vfix_engine.geometry.shapes": "Sphere",
    "vfix_engine.geometry.tool_depth": "",
    "vfix_engine.imaging.airway": "inner_air",
    "vfix_engine.imaging.enclosing": "enclosing_surface",
    "vfix_engine.imaging.head_import": "",
    "vfix_engine.imaging.islands": "",
    "vfix_engine.imaging.labels.painting": "",
    "vfix_engine.imaging.mesh_files": "read_mesh",
    "vfix_engine.imaging.opened_bone": "opened_bone",
    "vfix_engine.imaging.overlay": "read_overlay",
    "vfix_engine.imaging.phantom": "load_head_ct load_landmarks",
    "vfix_engine.imaging.segmentation": "segment",
    "vfix_engine.imaging.solids": "",
    "vfix_engine.imaging.synthetic_beads": "",
    "vfix_engine.imaging.tissue_regions": "",
    "vfix_engine.lumen.conform.conformance": "",
    "vfix_engine.lumen.conform.follow": "",
    "vfix_engine.lumen.drive": "Command DriveSettings SnakeDrive drive_lumen",
    "vfix_engine.lumen.pathway": "Pathway",
    "vfix_engine.lumen.pathway.tissue_motion": "",
    "vfix_engine.lumen.picture": "LumenPictures",
    "vfix_engine.lumen.query.query": "Query",
    "vfix_engine.lumen.synthetic": "synthetic_colon synthetic_course write_stl",
    "vfix_engine.lumen.system": "DriveSpec LumenContours SnakeSystemSpec",
    "vfix_engine.simulation.cone_surface": "",
    "vfix_engine.simulation.inspection_cone": "",
    "vfix_engine.simulation.placing": "place_robot started_at",
    "vfix_engine.simulation.preparation": "prepare",
    "vfix_engine.simulation.realtime": "RehearsalProcess SceneSpec",
    "vfix_engine.simulation.rehearsal": "Command Rehearsal",
    "vfix_engine.simulation.rigid_spec": "RigidSpec",
    "vfix_engine.simulation.scene": "Scene",
    "vfix_engine.worlds": "prepare spec_of",
}


@pytest.mark.parametrize("name", PRINTED)
def test_a_printed_name_leads_to_what_it_names(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        module = import_module(name)
        for word in PRINTED[name].split():
            assert getattr(module, word) is not None
    assert module is import_module(current_name(name))


def test_an_old_name_warns_and_is_no_second_copy(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("vfix_engine.fixtures")]:
        monkeypatch.delitem(sys.modules, name)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        old = import_module("vfix_engine.fixtures.zones")
    assert [str(one.message) for one in caught if one.category is DeprecationWarning] == [
        "vfix_engine.fixtures is vfix_engine.virtual_fixtures now",
        "vfix_engine.fixtures.zones is vfix_engine.virtual_fixtures.zones now",
    ]
    new = import_module("vfix_engine.virtual_fixtures.zones")
    assert old is new
    assert new.__spec__ is not None
    assert new.__spec__.name == "vfix_engine.virtual_fixtures.zones"


def test_a_module_that_never_was_is_not_found() -> None:
    with pytest.raises(ModuleNotFoundError, match=r"vfix_engine\.fixtures\.nothing"):
        import_module("vfix_engine.fixtures.nothing")


def test_every_entry_is_needed_and_leads_somewhere() -> None:
    for old, new in MOVED.items():
        parent, _, last = old.rpartition(".")
        assert current_name(parent) + "." + last != new, f"{old} follows from the entry of its package"
        import_module(new)


def test_a_recorded_class_is_found_under_its_name_of_today() -> None:
    assert current_class("vfix_engine.lumen.system.planning.Plan") == (
        "vfix_engine.worlds.snake.plans.messages",
        "PlannerAnswer",
    )
    for name, new in RENAMED.items():
        assert hasattr(import_module(name.rpartition(".")[0]), new)
