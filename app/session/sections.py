"""Sections that belong to no single step."""

from __future__ import annotations

from typing import TypedDict

from app.steps.spec import Input
from app.workspace.sections import CameraSection, LabelView, SceneSection


class StepSection(TypedDict):
    """The step that is shown, what keys and clicks do in it, the steps that can be gone to, and what to do next."""

    name: str
    input: Input
    available: list[str]
    hint: str


class SessionSections(TypedDict, total=False):
    """The step, the scene with its labels, and the camera of a client."""

    step: StepSection
    scene: SceneSection
    camera: CameraSection
    labels: list[LabelView]
