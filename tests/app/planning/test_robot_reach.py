"""A robot that cannot reach reports which of its joints stops it, and how far it got."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from session_doubles import SAMPLE, open_sample, sections_of, send

from app.services import Services
from vfix_engine.control import ControlSettings
from vfix_engine.errors import StartRefused
from vfix_engine.geometry.path import SplinePath
from vfix_engine.resources import assets_dir
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.worlds.rigid.placing import place_robot


def short_arm() -> bytes:
    """The plain arm with a shoulder and an elbow that hardly move."""
    text = (assets_dir() / "robots" / "arm_6.urdf").read_text(encoding="utf-8")
    for name in ("elbow_pitch", "shoulder_pitch"):
        limit = rf'(<joint name="{name}".*?<limit lower=")[^"]*(" upper=")[^"]*'
        text = re.sub(limit, r"\g<1>0.5\g<2>0.53", text, flags=re.DOTALL)
    return text.encode()


def test_the_verdict_of_a_urdf_of_ones_own_names_the_joint(phantom_services: Services) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE)
    own = phantom_services.instruments.add_urdf("short.urdf", short_arm(), "tool_frame")
    step = open_sample(phantom_services, plan.id)
    send(step, "plan.tool", name="straight_pointer")
    send(step, "plan.robot", name=own.name, urdf=own.urdf, tool_frame=own.tool_frame)
    section = sections_of(step)["plan"]
    assert section is not None
    assert (section["robot"]["urdf"], section["tool"]["title"]) == (own.urdf, "Straight pointer")
    shown = step._evaluations.stored._answer(phantom_services.plans.get(plan.id), 0.3)
    assert re.match(r"Blocked\. Held at \d+ of 90 mm: joint 2 \(shoulder_pitch\) at its limit\.", shown.words)
    phantom_services.plans.documents.delete(plan.id)


def test_a_standing_robot_that_cannot_hold_the_tool_names_its_joints(phantom_services: Services) -> None:
    arm, plan = RobotModel.load("arm_6"), phantom_services.plans.get(SAMPLE)
    stiff = tuple(
        replace(joint, lower=home - 0.01, upper=home + 0.01) if number in (1, 2) else joint
        for number, (joint, home) in enumerate(zip(arm.joints, arm.home.tolist(), strict=True))
    )
    robot = RobotModel(arm.name, arm.title, arm.source, stiff, (), arm.mount, arm.home, arm.upright)
    path = SplinePath(np.array([point.position for point in plan.content.points]))
    words = r"joint 2 \(shoulder pitch\) and joint 3 \(elbow pitch\) are at their limits, \d+ mm from there"
    with pytest.raises(StartRefused, match=words):
        place_robot(
            phantom_services.cases.tree(phantom_services.cases.embedded_case()),
            robot,
            Tool.load("straight_pointer"),
            path,
            ControlSettings(),
        )
