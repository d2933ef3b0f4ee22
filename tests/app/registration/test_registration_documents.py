"""Registrations as stored documents: what comes back, what was stored before, and what cannot be."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from registration_contents import pose

from app.registration.calibration_records import PointerTip, RobotToTracker
from app.registration.document import FiducialPair, RegistrationContent, check_registration
from app.registration.file_metadata import FileMetadata
from app.registration.fit_report import inconsistency, report_of
from app.registration.kind import REGISTRATION
from app.registration.touched_surface import Refinement, TouchedSurface
from vfix_engine.errors import InputError, VfixError


@pytest.mark.parametrize("moved", [1e4, 1e6, 1e15])
def test_a_registration_beyond_reach_is_refused_for_that(moved: float) -> None:
    transform = np.eye(4)
    transform[1, 3] = -moved
    content = RegistrationContent(transform=tuple(transform.ravel().tolist()), made_from="given")
    with pytest.raises(InputError, match=r"moves by 1e\+\d+ mm, beyond 10000 mm"):
        check_registration(content)
    transform[1, 3] = -9999.0
    check_registration(replace(content, transform=tuple(transform.ravel().tolist())))


def test_what_was_stored_before_comes_back_as_given() -> None:
    pair = {"label": "A", "in_image": [1.0, 2.0, 3.0], "measured": [4.0, 5.0, 6.0]}
    stored = {"to": "patient", "transform": pose().ravel().tolist(), "pairs": [pair, pair]}
    content = REGISTRATION.content("vfix-registration/1", stored, {})
    assert content.made_from == "given"
    assert [pair.id for pair in content.pairs] == ["pair-1", "pair-2"]
    np.testing.assert_array_equal(np.reshape(content.transform, (4, 4)), pose())
    assert REGISTRATION.content(REGISTRATION.schema, REGISTRATION.write(content), {}) == content
    empty = {"to": "patient", "transform": np.eye(4).ravel().tolist(), "pairs": []}
    assert REGISTRATION.content("vfix-registration/1", empty, {}) == RegistrationContent()


def test_what_it_was_measured_with_comes_back_as_it_was() -> None:
    turned = tuple(pose().ravel().tolist())
    pointer = PointerTip((18.0, -120.0, 0.1), 0.21, 0.05, 33.0, 60, "tracker")
    robot = RobotToTracker(turned, 0.05, 0.2, tuple((np.eye(6) / 3.0).ravel().tolist()), 20, "file")
    touched = TouchedSurface("bone", ((1.0, 2.0, 3.0),) * 12, "simulated", Refinement(0.15, 9, 1.2, 0.3))
    content = RegistrationContent(transform=turned, made_from="surface", surface=touched, pointer=pointer, robot=robot)
    stored = REGISTRATION.write(content)
    assert REGISTRATION.content(REGISTRATION.schema, json.loads(json.dumps(stored)), {}) == content
    del stored["said"]
    assert REGISTRATION.content("vfix-registration/3", stored, {}) == content
    for key in ("surface", "pointer", "robot"):
        del stored[key]
    before = REGISTRATION.content("vfix-registration/2", stored, {})
    assert before == replace(content, made_from="given", surface=None, pointer=None, robot=None)


def test_a_refined_one_that_lost_its_touched_points_keeps_its_transform() -> None:
    """Earlier versions left such documents; nothing here is the source of the transform, and no error is claimed."""
    content = RegistrationContent(transform=tuple(pose().ravel().tolist()), made_from="surface")
    stored = REGISTRATION.write(content)
    del stored["said"]
    read = REGISTRATION.content("vfix-registration/3", stored, {})
    assert read == replace(content, made_from="given")
    assert (report_of(read).state, inconsistency(read)) == ("given", "")


def test_what_its_file_says_comes_back_as_it_was() -> None:
    said = FileMetadata("base", True, 0.2375, 5, 0.31)
    content = RegistrationContent(to="base", made_from="given", said=said)
    stored = json.loads(json.dumps(REGISTRATION.write(content)))
    assert REGISTRATION.content(REGISTRATION.schema, stored, {}) == content
    for change in (
        {"to": "moon"},
        {"simulated": "yes"},
        {"fre_mm": -0.1},
        {"fle_mm": "0.3"},
        {"points": 0.5},
        {"x": 1},
    ):
        with pytest.raises(InputError):
            REGISTRATION.content(REGISTRATION.schema, {**stored, "said": {**stored["said"], **change}}, {})


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("pointer", {"tip": [1.0, 2.0]}),
        ("pointer", {"tip": "here"}),
        ("pointer", {"residual_mm": -0.1}),
        ("pointer", {"residual_mm": float("nan")}),
        ("pointer", {"poses": True}),
        ("pointer", {"measured_from": "typed"}),
        ("robot", {"transform": (2.0 * np.eye(4)).ravel().tolist()}),
        ("robot", {"transform": [1.0] * 15}),
        ("robot", {"covariance": (-np.eye(6)).ravel().tolist()}),
        ("robot", {"covariance": np.triu(np.ones((6, 6))).ravel().tolist()}),
        ("robot", {"covariance": [float("inf")] * 36}),
        ("robot", {"extra": 1}),
        ("surface", {"points": []}),
        ("surface", {"points": [[1.0, 2.0, 3.0]] * 2001}),
        ("surface", {"points": [[1.0, 2.0, 3e9]]}),
        ("surface", {"structure": "../bone"}),
        ("surface", {"refinement": {"residual_mm": 0.1, "kept": 13, "moved_mm": 1.0, "stability": 0.2}}),
        ("surface", {"refinement": {"residual_mm": 0.1}}),
    ],
)
def test_what_it_cannot_have_been_measured_with_is_refused(part: str, change: dict[str, Any]) -> None:
    turned = pose().ravel().tolist()
    parts: dict[str, Any] = {
        "pointer": {"tip": [1.0, 2.0, 3.0], "residual_mm": 0.1, "tip_error_mm": 0.1, "swing_deg": 30.0, "poses": 60,
                    "measured_from": "file"},
        "robot": {"transform": turned, "rotation_residual_deg": 0.1, "translation_residual_mm": 0.1,
                  "covariance": np.eye(6).ravel().tolist(), "poses": 9, "measured_from": "file"},
        "surface": {"structure": "bone", "points": [[1.0, 2.0, 3.0]] * 12, "measured_from": "file",
                    "refinement": None},
    }  # fmt: skip
    good = {**REGISTRATION.write(RegistrationContent()), **parts}
    REGISTRATION.content(REGISTRATION.schema, good, {})
    with pytest.raises(VfixError):
        REGISTRATION.content(REGISTRATION.schema, {**good, part: {**parts[part], **change}}, {})


@pytest.mark.parametrize(
    "change",
    [
        {"made_from": "thin air"},
        {"fle_mm": 0.0},
        {"fle_mm": 51.0},
        {"pairs": (FiducialPair("A", None, None, "p"), FiducialPair("B", None, None, "p"))},
        {"pairs": (FiducialPair("A", None, None, "p", weight=0.0),)},
        {"pairs": (FiducialPair("A", None, None, "p", measured_from="guessed"),)},  # type: ignore[arg-type]
        {"pairs": (FiducialPair("A", None, None, "p q"),)},
    ],
)
def test_what_cannot_be_is_refused(change: dict[str, Any]) -> None:
    content = replace(RegistrationContent(), **change)
    with pytest.raises(InputError):
        REGISTRATION.check(content)
    with pytest.raises(InputError):
        REGISTRATION.content(REGISTRATION.schema, REGISTRATION.write(content), {})
