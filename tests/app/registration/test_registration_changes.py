"""What an undo of a registration says: every part of its content that can change has words."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import pytest
from registration_contents import content_of

from app.registration.calibration_records import PointerTip, RobotToTracker
from app.registration.changes import changes
from app.registration.document import IDENTITY, FiducialPair, RegistrationContent
from app.registration.file_metadata import FileMetadata
from app.registration.found_beads import BeadSearchRecord, FoundBead
from app.registration.touched_surface import Refinement, TouchedSurface

BEAD = FoundBead("bead-1", (1.0, 2.0, 3.0), 3.0, 2000.0, 40)
TOUCHED = TouchedSurface("bone", ((1.0, 2.0, 3.0), (2.0, 2.0, 3.0)), "file")
REFINED = replace(TOUCHED, refinement=Refinement(0.3, 2, 1.25, 0.5))
TIP = PointerTip((0.0, 0.0, 90.0), 0.1, 0.1, 60.0, 100, "file")
ROBOT = RobotToTracker(IDENTITY, 0.1, 0.1, (0.0,) * 36, 20, "file")
CONTENT = replace(content_of(), beads=(BEAD,))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"to": "base"}, "Registered to the robot's base instead of the patient."),
        ({"transform": (*IDENTITY[:3], 9.0, *IDENTITY[4:])}, "Another transform is taken over."),
        ({"pairs": CONTENT.pairs[1:]}, f"Point ‘{CONTENT.pairs[0].label}’ is gone."),
        ({"made_from": "given"}, "The transform is taken over from elsewhere, which was fitted to the points."),
        ({"fle_mm": 0.5}, "Error of one point: 0.5 mm instead of estimated from the fit."),
        ({"beads": ()}, "Bead ‘F1’ is gone."),
        ({"search": BeadSearchRecord(None, 2000.0)}, "Beads were looked for."),
        ({"surface": TOUCHED}, "Points touched on a surface: 2 instead of 0."),
        ({"pointer": TIP}, "The calibration of the pointer is new."),
        ({"robot": ROBOT}, "The calibration of the robot is new."),
        ({"said": FileMetadata(simulated=True)}, "Another transform is taken over."),
    ],
)
def test_every_part_of_a_registration_has_words(change: dict[str, Any], words: str) -> None:
    assert changes(CONTENT, CONTENT) == ()
    assert changes(CONTENT, replace(CONTENT, **change)) == (words,)
    assert changes(replace(CONTENT, **change), CONTENT)


def test_no_part_of_a_registration_is_forgotten() -> None:
    assert {field.name for field in fields(RegistrationContent)} == {
        "to", "transform", "pairs", "made_from", "fle_mm", "beads", "search", "surface", "pointer", "robot", "said",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"label": "Nasion"}, "Point ‘Nasion’: renamed from ‘{}’."),
        ({"in_image": None}, "Point ‘{}’: the place in the image is gone."),
        ({"measured": (0.0, 0.0, 0.0)}, "Point ‘{}’: the measured place moved by "),
        ({"enabled": False}, "Point ‘{}’: left out of the fit."),
        ({"weight": 2.5}, "Point ‘{}’: weight 2.5 instead of 1."),
        ({"measured_from": "simulated"}, "Point ‘{}’: simulated instead of typed."),
        ({"bead": "bead-1"}, "Point ‘{}’: at a found bead."),
    ],
)
def test_every_part_of_a_point_has_words(change: dict[str, Any], words: str) -> None:
    first, *others = CONTENT.pairs
    (said,) = changes(CONTENT, replace(CONTENT, pairs=(replace(first, **change), *others)))
    assert said.startswith(words.format(first.label))
    assert set(FiducialPair.__dataclass_fields__) == {
        "label", "in_image", "measured", "id", "enabled", "weight", "measured_from", "bead",
    }  # fmt: skip


@pytest.mark.parametrize(
    "change",
    [{"position": (1.0, 2.0, 5.0)}, {"diameter_mm": 4.0}, {"peak_hu": 2500.0}, {"voxels": 41}, {"rejected": True},
     {"name": "Mastoid"}],
)  # fmt: skip
def test_every_part_of_a_bead_has_words(change: dict[str, Any]) -> None:
    assert len(changes(CONTENT, replace(CONTENT, beads=(replace(BEAD, **change),)))) == 1


def test_a_refinement_is_told_by_how_far_it_moved() -> None:
    before, after = replace(CONTENT, surface=TOUCHED), replace(CONTENT, surface=REFINED, made_from="surface")
    assert changes(before, after) == (
        "Refined on the touched points, by up to 1.2 mm.",
        "The transform is refined on a surface, which was fitted to the points.",
    )
    assert changes(after, before)[0] == "The refinement on the touched points is gone."
