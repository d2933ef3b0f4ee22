"""URDFs from outside: what is read, what is left out and said, and what is refused (HAZ-23)."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from tests.engine.urdf_texts import GOOD, LIMIT, joint, links, urdf
from vfix_engine.errors import RobotError
from vfix_engine.resources import assets_dir
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.robots.joints import MOST_JOINTS
from vfix_engine.robots.urdf import parse_urdf


def load(tmp_path: Path, text: str, tool_frame: str | None = None) -> RobotModel:
    file = tmp_path / "test.urdf"
    file.write_text(text)
    return RobotModel.load(file, tool_frame)


# What is read


def test_a_plain_urdf_is_a_robot_and_says_what_was_assumed(tmp_path: Path) -> None:
    robot = load(tmp_path, GOOD)
    assert [j.name for j in robot.joints] == ["one", "two"]
    assert robot.joints[0].axis == (1.0, 0.0, 0.0)  # the standard's default
    np.testing.assert_allclose(robot.joints[0].placement[:3, 3], [100.0, 0.0, 200.0])
    assert robot.speed.tolist() == [2.0, 2.0]
    assert [note for note in robot.notes if "acceleration" in note]
    assert robot.mount.hold == "tail"
    # The tool's shaft runs along z of the last link.
    pose = robot.placed(np.eye(4), Tool.load("endoscope_0"))
    last = pose.link_placements(robot.home)[-1]
    np.testing.assert_allclose(pose.tip(robot.home).position, last[:3, 3] + 175.0 * last[:3, 2], atol=1e-9)


def test_the_real_double_pendulum_is_where_pinocchio_puts_it(trial_data: Path, tmp_path: Path) -> None:
    """HAZ-07: a URDF from elsewhere, with a fixed last joint and no speeds, against a reference in metres."""
    folder = trial_data / "formats" / "robots"
    reference = json.loads((folder / "reference_double_pendulum_pinocchio.json").read_text())
    plain = RobotModel.load(folder / "double_pendulum_simple.urdf")
    assert [note for note in plain.notes if "does not move" in note]
    (tmp_path / "pendulum.urdf").write_bytes((folder / "double_pendulum_simple.urdf").read_bytes())
    words = {"lower": -3, "upper": 3, "speed": 1, "acceleration": 20, "source": "assumed"}
    config = {
        "schema": "vfix-robot/2", "name": "pendulum", "title": "Pendulum", "source": "example-robot-data",
        "urdf": "pendulum.urdf", "joints": {"joint1": words, "joint2": words},
    }  # fmt: skip
    (tmp_path / "pendulum.json").write_text(json.dumps(config))
    robot = RobotModel.load(tmp_path / "pendulum.json")
    assert robot.upper.tolist() == [3.0, 3.0]
    assert len(robot.visuals) == 3
    back = np.eye(4)
    back[:3, :3] = Rotation.from_euler("x", -90, degrees=True).as_matrix()  # from the flange to its link
    placed = robot.placed(np.eye(4), back)
    for case in reference["cases"]:
        tip, expected = placed.tip(np.array(case["q"])), np.array(case["T"])
        np.testing.assert_allclose(tip.rotation, expected[:3, :3], atol=1e-12)
        np.testing.assert_allclose(tip.position / 1e3, expected[:3, 3], atol=1e-12)
        jacobian = tip.jacobian.copy()
        jacobian[:3] /= 1e3
        np.testing.assert_allclose(jacobian, case["jacobian_world_aligned_linear_then_angular"], atol=1e-12)


def test_random_trees_are_read_as_pinocchio_reads_them(tmp_path: Path) -> None:
    """Angles, axes, fixed joints and prismatic ones in any order, against another reader of the same file."""
    random = np.random.default_rng(7)
    for _ in range(20):
        n = int(random.integers(2, 8))
        kinds = [*random.choice(["revolute", "prismatic", "fixed"], n - 1), "revolute"]
        parts = [links(*(f"l{i}" for i in range(n + 1)))]
        for i, kind in enumerate(kinds):
            numbers = [" ".join(f"{v:.6f}" for v in random.normal(size=3)) for _ in range(3)]
            inside = f'<origin xyz="{numbers[0]}" rpy="{numbers[1]}"/><axis xyz="{numbers[2]}"/>{LIMIT}'
            ends = f'<parent link="l{i}"/><child link="l{i + 1}"/>'
            parts.append(f'<joint name="j{i}" type="{kind}">{ends}{inside}</joint>')
        robot = load(tmp_path, urdf(*parts))
        model = pin.buildModelFromXML(urdf(*parts))
        data = model.createData()
        q = random.uniform(robot.lower, robot.upper)
        pin.forwardKinematics(model, data, q * np.where(robot.revolute, 1.0, 1e-3))
        ours = robot.placed(np.eye(4)).link_placements(q)
        for i in range(1, model.njoints):
            np.testing.assert_allclose(ours[i][:3, :3], data.oMi[i].rotation, atol=1e-12)
            np.testing.assert_allclose(ours[i][:3, 3] / 1e3, data.oMi[i].translation, atol=1e-12)


def test_a_branch_is_drawn_still_and_said(tmp_path: Path) -> None:
    box = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
    finger = f'<link name="finger">{box}</link>'
    text = urdf(
        links("a", "b", "c"), finger, joint("one", "a", "b"), joint("two", "b", "c"), joint("grip", "b", "finger")
    )
    with pytest.raises(RobotError, match="2 ends; name the tool frame: c, finger"):
        load(tmp_path, text)
    robot = load(tmp_path, text, "c")
    assert [j.name for j in robot.joints] == ["one", "two"]
    assert [note for note in robot.notes if "grip" in note and "drawn at 0" in note]
    assert [v.link for v in robot.visuals] == [1]
    np.testing.assert_allclose(robot.visuals[0].position, [100.0, 0.0, 200.0])
    assert [j.name for j in load(tmp_path, text, "finger").joints] == ["one", "grip"]


def test_a_continuous_joint_gets_a_finite_range_and_says_so(tmp_path: Path) -> None:
    robot = load(tmp_path, urdf(links("a", "b"), joint("one", "a", "b", "continuous", '<limit velocity="1"/>')))
    assert robot.revolute.all()
    assert robot.upper[0] == pytest.approx(16 * np.pi)
    assert "eight turns" in robot.notes[0]


def test_shapes_keep_their_place_and_colour(tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_bytes(b"")
    shapes = (
        '<visual><origin xyz="0 0.1 0"/><geometry><cylinder radius="0.01" length="0.2"/></geometry>'
        '<material name="red"/></visual>'
        '<visual><geometry><mesh filename="package://part.stl" scale="0.001 0.001 0.001"/></geometry></visual>'
        '<visual><geometry><mesh filename="gone.stl"/></geometry></visual>'
    )
    red = '<material name="red"><color rgba="1 0 0 1"/></material>'
    robot = load(tmp_path, urdf(red, f'<link name="a">{shapes}</link>', links("b"), joint("one", "a", "b")))
    cylinder, mesh = robot.visuals
    assert cylinder.size == (10.0, 200.0, 0.0)
    assert cylinder.position == (0.0, 100.0, 0.0)
    assert cylinder.colour == (255, 0, 0)
    assert mesh.file == (tmp_path / "part.stl").resolve()
    assert mesh.size == (1.0, 1.0, 1.0)
    assert [note for note in robot.notes if "gone.stl" in note]


# HAZ-23: nonsense

NUMBERS = ["nan", "inf", "-inf", "1e999", "1_0", "", "zero", "0x10", "1,5", "1e13"]
WRONG: list[tuple[str, str]] = [
    *((joint("one", "a", "b", inside=f'<limit lower="{n}" upper="1" velocity="1"/>'), "lower") for n in NUMBERS),
    *((joint("one", "a", "b", inside=f'<limit lower="-1" upper="{n}" velocity="1"/>'), "upper") for n in NUMBERS),
    *((joint("one", "a", "b", inside=f'<limit effort="{n}" velocity="1"/>'), "effort") for n in NUMBERS),
    *((joint("one", "a", "b", inside=f'<limit effort="1" velocity="{n}"/>'), "velocity") for n in NUMBERS),
    *((joint("one", "a", "b", inside=f'{LIMIT}<axis xyz="0 {n} 1"/>'), "axis") for n in NUMBERS[:8]),
    *((joint("one", "a", "b").replace("0.1 0 0.2", f"0 0 {n}"), "origin xyz") for n in NUMBERS),
    *((joint("one", "a", "b").replace("0.1 0 0", f"0 0 {n}"), "origin") for n in NUMBERS[:6]),
    *((joint("one", "a", "b", kind), "type") for kind in ("floating", "planar", "screw", "", "Revolute", "spherical")),
    *(
        (joint("one", "a", "b", inside=f'{LIMIT}<axis xyz="{a}"/>'), "direction")
        for a in ("0 0 0", "-0 0 0", "1e-9 0 0")
    ),
    *((joint("one", "a", "b", inside=f'{LIMIT}<axis xyz="{a}"/>'), "numbers") for a in ("1", "1 0", "1 0 0 0", " ")),
    *(
        (joint("one", "a", "b", inside=f'<limit lower="{low}" upper="{high}" velocity="1"/>'), "above")
        for low, high in (("1", "-1"), ("0.1", "0"), ("3.2", "3.1"), ("-1", "-1.0001"))
    ),
    (joint("one", "a", "b", inside='<limit lower="0" upper="1" velocity="-1"/>'), "must not be negative"),
    (joint("one", "a", "b", inside='<limit lower="0" upper="1" effort="-1"/>'), "must not be negative"),
    (joint("one", "a", "b", inside=f'{LIMIT}<dynamics damping="nan"/>'), "damping"),
    (joint("one", "a", "b", inside=f'{LIMIT}<dynamics friction="-1"/>'), "friction"),
    (joint("one", "a", "b", inside=f'{LIMIT}<mimic joint="ghost"/>'), "mimics 'ghost'"),
    (joint("one", "a", "b", inside=f'{LIMIT}<mimic joint="one"/>'), "no other joint"),
    (joint("one", "a", "b", inside=""), "no limits"),
    (joint("one", "a", "b", "prismatic", ""), "no limits"),
    (joint("", "a", "b"), "no name"),
    (joint("x" * 300, "a", "b"), "too long or not printable"),
    (joint("one", "a", "b") + joint("one", "b", "c") + links("c"), "two joints"),
    (joint("one", "a", "ghost"), "not there"),
    (joint("one", "ghost", "b"), "not there"),
    (joint("one", "a", "a"), "to itself"),
    (joint("one", "a", "b").replace('<parent link="a"/>', ""), "one parent link"),
    (joint("one", "a", "b").replace('<child link="b"/>', '<child link="b"/><child link="a"/>'), "one child link"),
    (joint("one", "a", "b") + joint("two", "b", "a"), "circle"),
    (joint("one", "a", "b") + links("c", "d") + joint("two", "c", "d") + joint("three", "d", "c"), "circle"),
    (joint("one", "a", "b") + links("c") + joint("two", "c", "b"), "two parents"),
    (joint("one", "a", "b") + joint("two", "a", "b"), "two parents"),
    (joint("one", "a", "b") + links("c"), "not connected"),
    (joint("one", "a", "b") + links("b"), "two links"),
    (joint("one", "a", "b") + '<link name=" "/>', "no name"),
    (joint("one", "a", "b", "fixed"), "no joint between"),
    ("", "not connected"),
    (joint("one", "a", "b") + '<link name="c"><inertial><mass value="nan"/></inertial></link>', "mass"),
    (joint("one", "a", "b") + '<link name="c"><inertial><mass value="-1"/></inertial></link>', "mass"),
    (joint("one", "a", "b") + '<link name="c"><inertial><inertia ixx="inf"/></inertial></link>', "ixx"),
    (joint("one", "a", "b") + '<link name="c"><visual/></link>', "geometry"),
    *(
        (joint("one", "a", "b") + f'<link name="c"><visual><geometry><{s}/></geometry></visual></link>', word)
        for s, word in (
            ("torus", "torus"),
            ('box size="1 1"', "numbers"),
            ('box size="1 -1 1"', "positive"),
            ('sphere radius="nan"', "radius"),
            ('cylinder radius="1" length="0"', "positive"),
            ('mesh filename="a.stl" scale="0 1 1"', "scale"),
        )
    ),
    (joint("one", "a", "b") + '<xacro:macro xmlns:xacro="x" name="m"/>', "xacro"),
    (joint("one", "a", "b") + '<material name="m"><color rgba="1 2"/></material>', "colour"),
]


@pytest.mark.parametrize("number", range(len(WRONG)))
def test_nonsense_is_refused_with_the_reason(tmp_path: Path, number: int) -> None:
    """HAZ-23: more than 100 files, each with one thing wrong in it, told by its name."""
    assert len(WRONG) >= 100
    part, word = WRONG[number]
    with pytest.raises(RobotError, match=word) as refused:
        load(tmp_path, urdf(links("a", "b"), part))
    assert len(str(refused.value)) < 500
    assert str(tmp_path) not in str(refused.value)


def test_a_joint_that_follows_another_cannot_be_in_the_chain(tmp_path: Path) -> None:
    """HAZ-23: a gripper's second finger may mimic the first; a joint that moves the tool may not."""
    mimic = joint("two", "b", "c", inside=f'{LIMIT}<mimic joint="one"/>')
    text = urdf(links("a", "b", "c"), joint("one", "a", "b"), mimic)
    with pytest.raises(RobotError, match="mimics 'one'"):
        load(tmp_path, text)
    assert len(load(tmp_path, text, "b").joints) == 1


def chain(count: int) -> str:
    """A URDF of so many continuous joints in a row."""
    names = [f"l{i}" for i in range(count + 1)]
    every = (joint(f"j{i}", names[i], names[i + 1], "continuous", "") for i in range(count))
    return urdf(links(*names), *every)


def test_a_chain_has_at_most_as_many_joints_as_can_be_controlled(tmp_path: Path) -> None:
    """HAZ-23: fixed joints and branches do not count; 3,000 joints are refused when they are read, not in a step."""
    longest = load(tmp_path, chain(MOST_JOINTS))
    assert longest.placed(np.eye(4)).tip(longest.home).jacobian.shape == (6, MOST_JOINTS)
    assert len(load(tmp_path, chain(100), f"l{MOST_JOINTS}").joints) == MOST_JOINTS
    for count in (MOST_JOINTS + 1, 3_000):
        with pytest.raises(RobotError, match=f"{count:,} moving joints .* at most {MOST_JOINTS}"):
            load(tmp_path, chain(count))


def mutants() -> Iterator[str]:
    """The shipped PSM with a character too many or too few, or cut off, at every 25th place."""
    text = (assets_dir() / "robots" / "dvrk_psm.urdf").read_text()
    for position in range(0, len(text), 25):
        yield text[:position]
        yield text[:position] + "-" + text[position:]
        yield text[:position] + text[position + 1 :]


def test_damaged_files_are_read_or_refused_and_nothing_else(tmp_path: Path) -> None:
    """HAZ-16, HAZ-23: more than 500 mutants of a real file; no other error than ours."""
    read = refused = 0
    for text in mutants():
        try:
            parse_urdf(text.encode(), tmp_path)
            read += 1
        except RobotError:
            refused += 1
    assert read + refused > 500
    assert refused > read / 2
