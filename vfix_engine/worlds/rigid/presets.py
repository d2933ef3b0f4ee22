"""Presets of a rehearsal: the printed parameters of Li 2004 and Li 2007, and a list of what is not printed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ...control import ControlSettings
from ...control.tasks.printed_path import PrintedWeights
from ...robots import RobotModel
from ...virtual_fixtures.joint_limits import MOTION_WEIGHT
from .scene import Scene
from .spec import SceneSpec

OUTER_S = 1.0 / 30.0  # period of both papers' control loop
GAIN = 1.0  # mm/s per N, k of (10), assumed: between two periods the tip leaves a bent path by its step squared
_MOTION = {"dt_s": OUTER_S, "gain_mm_per_s_per_n": GAIN, "k_d": 0.2, "k_tau": 0.0, "capture_mm": 1.0}

_ASSUMED = {
    "k of (10)": "not printed: 1 mm/s per N, at which a full push of 5 N keeps to the path within 0.02 mm at the mean",
    "saturation of u": "not printed: u is in mm as printed, and limited to 1 mm, so that k_d stays a blend",
    "ε_bnd of (16)": "the margin of the plan, which the certificate enforces; Li 2004 prints 0.01, without a unit",
    "accelerations": "not printed: those of the robot's file and of the settings",
}
_INSPECTION = {
    "k of (24)": "0.01 is printed without a unit, and the map from f to a rotation is not printed: the torque of the "
    "force about the virtual point, with the rotation gain of the settings",
}
OURS = (
    "the certificate of each whole motion, with its margin, buffer and backtracking",
    "limits of speed and acceleration of the joints, and the ability to stop before a limit, a margin and the end",
    "the slew limit of the desired velocity",
    "the sign of D_c in (10): a force against it moves nothing",
    "(14) with a progress variable where it has no solution; such steps are counted",
    "the straight approach to the path and of the view, before (14) and (22) can hold",
    "the polyhedron of (23) inside the ball, with 32 even directions",
    "distances by the 16-wide tree, which finds the exact pairs of the covariance tree without grouped ones; "
    "`vfix rehearse` counts both",
    "the placement of the robot, which is searched with the usual program",
    "an ideal position servo: straight in joint space from set point to set point",
)
OFF = ("directions of the shaft", "soft zones and soft tissue", "limits of the tip's speed")


@dataclass(frozen=True)
class Preset:
    """A paper's parameters.

    settings: values of ``ControlSettings`` by name; weights: of the program; joints: W_j of every joint, in 1/mm and
    1/rad. printed: what the paper prints, by its symbol; assumed: what it does not, and what is taken instead.
    """

    name: str
    paper: str
    settings: Mapping[str, float]
    weights: PrintedWeights
    joints: float
    printed: Mapping[str, float]
    assumed: Mapping[str, str]

    def in_settings(self, settings: ControlSettings) -> ControlSettings:
        """The settings with the preset's values."""
        return replace(settings, **self.settings)

    def in_robot(self, robot: RobotModel) -> RobotModel:
        """The robot with the same W_j for every joint."""
        joints = tuple(replace(joint, weight=self.joints / MOTION_WEIGHT) for joint in robot.joints)
        return RobotModel(
            robot.name, robot.title, robot.source, joints, robot.visuals, robot.mount, robot.home, robot.upright,
            robot.notes,
        )  # fmt: skip

    def in_scene(self, scene: Scene) -> Scene:
        """The scene with the preset's robot and program, without directions of the shaft."""
        return replace(scene, robot=self.in_robot(scene.robot), shaft=None, printed=self.weights)

    def in_spec(self, scene: SceneSpec) -> SceneSpec:
        """The same for a scene that is sent to another process."""
        return replace(scene, robot=self.in_robot(scene.robot_model()), shaft=None, printed=self.weights)

    def report(self) -> dict[str, object]:
        """What is printed, what is assumed, what stays the package's own, and what is off."""
        return {
            "preset": self.name,
            "paper": self.paper,
            "printed": dict(self.printed),
            "assumed": dict(self.assumed),
            "ours": list(OURS),
            "off": list(OFF),
        }


PRESETS = {
    one.name: one
    for one in (
        Preset(
            "li2004",
            "Li & Taylor 2004",
            _MOTION,
            PrintedWeights(tip_mm=1.0, tip_rad=1.0, near=0.001, tolerance=0.01),
            0.001,
            {"rate_hz": 30.0, "k_d": 0.2, "k_τ": 0.0, "ε": 0.01, "w_tip": 1.0, "w_k": 0.001, "w_joints": 0.001},
            {**_ASSUMED, "unit of w_tip": "not printed: 1 per mm and 1 per rad"},
        ),
        Preset(
            "li2007",
            "Li, Ishii & Taylor 2007",
            _MOTION | {"target_tolerance_mm": 0.1, "view_distance_mm": 0.0},
            PrintedWeights(tip_mm=1.0, tip_rad=0.1, near=0.01, tolerance=0.01),
            0.01,
            {"rate_hz": 30.0, "k_d": 0.2, "k_τ": 0.0, "w_k": 0.01, "w_j": 0.01, "ε_t of (22) in mm": 0.1,
             "k of (24)": 0.01, "r in mm": 0.0},
            {
                **_ASSUMED,
                **_INSPECTION,
                "w_t": "'fairly high' for translation, 'low' for rotation: 1 per mm, 0.1 per rad",
                "ε_t of (14)": "'a small positive number': 0.01, as in Li 2004",
            },
        ),
    )
}  # fmt: skip
