"""The live link: sends the open plan in Slicer's frame, and receives proposals that do not change it."""

import contextlib
import math
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from app.cases.service import Case
from app.documents.documents import Documents
from app.kit.errors import PlanLocked
from app.link import LinkFault, ListPoint, PointList, Text, Transform
from app.link.messages import HEADER_BYTES, parse_header
from app.live import LiveBoard, LiveLink, frames
from app.live import incoming as module
from app.live.incoming import MAX_REGISTRATIONS, Intake
from app.live.outgoing import plan_messages, registration_messages
from app.plans.model import Plan, PlanContent, PlanPoint
from app.plans.operations.document import LockPlan, UndoPlan
from app.plans.operations.instruments import UseRegistration
from app.plans.operations.points import MovePoint
from app.plans.operations.versions import GoBack
from app.plans.paths import PlanPath
from app.plans.service import PlanService
from app.plans.versions import PlanVersions
from app.registration.document import RegistrationContent
from app.registration.kind import REGISTRATION
from app.settings import LinkAddress, Settings, link_address, tracker_address
from app.store import Store
from vfix_engine.errors import InputError, PlanError

POINTS = (
    PlanPoint("a", "entry", (-29.512345678901, 1 / 3, -14.0), (0.6, 0.0, -0.8), 12.5),
    PlanPoint("b", "end", (1.5, -2.25, 7.0)),
)
TARGETS = (PlanPoint("t", "Öffnung", (1.0, 2.0, 3.125)),)
# Neither symmetric nor its own inverse.
TURN = np.array([[0.0, -1.0, 0.0, 5.5], [0.0, 0.0, -1.0, -7.25], [1.0, 0.0, 0.0, 1 / 3], [0.0, 0.0, 0.0, 1.0]])
RAS = np.array([-1.0, -1.0, 1.0])


@dataclass
class Parts:
    live: LiveBoard
    plans: PlanService
    versions: PlanVersions
    registrations: Documents[RegistrationContent]


@pytest.fixture
def parts(store: Store, plans: PlanService) -> Parts:
    return Parts(LiveBoard(), plans, plans.versions, Documents(store, REGISTRATION))


@pytest.fixture
def plan(parts: Parts, case: Case) -> Plan:
    made = parts.plans.create(case.id, "Way", PlanContent(paths=(PlanPath(points=POINTS),), targets=TARGETS))
    parts.live.opened("page", made.id)
    return made


@pytest.fixture
def intake(parts: Parts, monkeypatch: pytest.MonkeyPatch) -> Intake:
    monkeypatch.setattr(module, "SETTLED_S", 0.0)
    return Intake(parts.live, parts.plans, parts.versions, parts.registrations)


def in_scene(points: tuple[PlanPoint, ...]) -> tuple[ListPoint, ...]:
    """Points as they come back from Slicer: RAS, rounded to float32."""
    return tuple(ListPoint(p.label, tuple((RAS * p.position).astype(np.float32).tolist())) for p in points)


def test_the_plan_is_told_in_the_scenes_frame(plan: Plan) -> None:
    path, targets, words = plan_messages(plan)
    assert isinstance(path, PointList)
    assert isinstance(targets, PointList)
    assert [point.name for point in path.points] == ["entry", "end"]
    np.testing.assert_array_equal([point.position for point in path.points], [RAS * p.position for p in POINTS])
    np.testing.assert_array_equal(targets.points[0].position, RAS * TARGETS[0].position)
    assert isinstance(words, Text)
    assert "Not for clinical use" in words.text


def test_long_labels_are_told(parts: Parts, case: Case) -> None:
    long = parts.plans.create(
        case.id, "Long", PlanContent(paths=(PlanPath(points=(PlanPoint("a", "ö" * 40, (0.0, 0.0, 0.0)),)),))
    )
    words = plan_messages(long)[2]
    assert isinstance(words, Text)
    assert "1 labels are longer than 63 bytes and are cut" in words.text


def test_only_the_registration_that_the_plan_goes_by_is_told(parts: Parts, plan: Plan) -> None:
    given = RegistrationContent("patient", tuple(TURN.ravel().tolist()), made_from="given")
    own = parts.registrations.create(plan.case_id, "Own", given)
    unmade = parts.registrations.create(plan.case_id, "Not made yet", RegistrationContent())
    listed = parts.registrations.list(plan.case_id)
    for without in (plan, replace(plan, content=replace(plan.content, registration=unmade.id))):
        for message in registration_messages(without, listed):
            np.testing.assert_array_equal(message.matrix, np.eye(4))
    to_patient, to_base = registration_messages(
        replace(plan, content=replace(plan.content, registration=own.id)), listed
    )
    assert (to_patient.name, to_base.name) == ("Registration", "RegistrationToBase")
    np.testing.assert_array_equal(to_patient.matrix, frames.registration_to_ras(TURN))
    np.testing.assert_array_equal(to_base.matrix, np.eye(4))


def test_a_registration_to_the_robots_base_has_a_name_of_its_own_both_ways(
    parts: Parts, intake: Intake, plan: Plan
) -> None:
    """One to the patient that is equal is another one: the robot would be placed elsewhere by it."""
    given = RegistrationContent("base", tuple(TURN.ravel().tolist()), made_from="given")
    own = parts.registrations.create(plan.case_id, "Own", given)
    used = replace(plan, content=replace(plan.content, registration=own.id))
    to_patient, to_base = registration_messages(used, parts.registrations.list(plan.case_id))
    np.testing.assert_array_equal(to_patient.matrix, np.eye(4))
    np.testing.assert_array_equal(to_base.matrix, frames.registration_to_ras(TURN))
    intake.receive(to_base)  # an echo
    assert intake.settle() == []
    moved = to_base.matrix.copy()
    moved[0, 3] += 1.0
    intake.receive(Transform("RegistrationToBase", moved))
    intake.receive(Transform("Registration", to_base.matrix))
    assert len(intake.settle()) == 2
    assert sorted(one.content.to for one in parts.registrations.list(plan.case_id)) == ["base", "base", "patient"]


def test_a_case_takes_a_bounded_number_of_registrations(parts: Parts, intake: Intake, plan: Plan) -> None:
    def propose(number: int) -> list[str]:
        matrix = np.eye(4)
        matrix[0, 3] = 10.0 * (number + 1)
        intake.receive(Transform("Registration", matrix))
        return intake.settle()

    for number in range(MAX_REGISTRATIONS):
        assert "check it" in propose(number)[0]
    assert "delete some of them" in propose(MAX_REGISTRATIONS)[0]
    assert len(parts.registrations.list(plan.case_id)) == MAX_REGISTRATIONS


def test_a_pose_and_a_registration_move_places_of_the_scene_as_they_move_those_of_the_image() -> None:
    place = np.array([3.0, -4.0, 5.0])
    on_tool = frames.pose_to_ras(TURN) @ [*place, 1.0]
    np.testing.assert_allclose(on_tool[:3], RAS * (TURN[:3, :3] @ place + TURN[:3, 3]), atol=1e-12)
    on_patient = frames.registration_to_ras(TURN) @ [*(RAS * place), 1.0]
    np.testing.assert_allclose(on_patient[:3], TURN[:3, :3] @ place + TURN[:3, 3], atol=1e-12)
    np.testing.assert_allclose(frames.registration_to_ras(frames.registration_to_ras(TURN)), TURN, atol=1e-15)


def test_an_echo_proposes_nothing(parts: Parts, intake: Intake, plan: Plan) -> None:
    """What Slicer sends back as it came is no change, although float32 has rounded it."""
    assert intake.receive(PointList("Path", in_scene(POINTS))) == ""
    assert intake.receive(PointList("Targets", in_scene(TARGETS))) == ""
    assert intake.settle() == []
    assert parts.versions.list(plan.id) == ()


def test_a_moved_point_becomes_a_version_and_the_open_plan_stays(parts: Parts, intake: Intake, plan: Plan) -> None:
    sent = list(in_scene(POINTS))
    sent[1] = ListPoint("end", (-4.0, 5.0, 6.0))
    intake.receive(PointList("Path", tuple(sent)))
    (words,) = intake.settle()
    assert "From 3D Slicer: Path" in words
    assert parts.plans.get(plan.id) == plan
    (version,) = parts.versions.list(plan.id)
    assert version.content.points[0] == POINTS[0]  # to the last bit, with its direction and roll
    assert version.content.points[1] == PlanPoint("b", "end", (4.0, -5.0, 6.0))
    assert version.content.targets == TARGETS
    assert parts.versions.differences(plan.id, version.id)
    after = parts.plans.do(plan.id, GoBack(version_id=version.id))
    assert after.content.points == version.content.points
    assert parts.plans.do(plan.id, UndoPlan()).content.points == POINTS


def test_new_targets_get_identifiers_of_their_own(parts: Parts, intake: Intake, plan: Plan) -> None:
    intake.receive(PointList("Targets", (*in_scene(TARGETS), ListPoint("F-2", (1.0, 1.0, 1.0)))))
    intake.settle()
    (version,) = parts.versions.list(plan.id)
    assert version.content.targets[0] == TARGETS[0]
    assert version.content.targets[1].position == (-1.0, -1.0, 1.0)
    assert version.content.points == POINTS
    intake.receive(PointList("Targets", (ListPoint("F-3", (9.0, 9.0, 9.0)),)))
    intake.settle()
    assert [one.name for one in parts.versions.list(plan.id)] == [
        "From 3D Slicer: Targets",
        "From 3D Slicer: Targets 2",
    ]


def test_proposals_without_end_leave_the_users_versions_room(
    parts: Parts, intake: Intake, plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.plans.versions.MAX_PROPOSED", 2)
    for x in range(4):
        intake.receive(PointList("Targets", (ListPoint("T", (float(x), 0.0, 0.0)),)))
        assert "Proposed as version" in intake.settle()[0]
    assert [one.name for one in parts.versions.list(plan.id)] == [
        "From 3D Slicer: Targets 3",
        "From 3D Slicer: Targets 4",
    ]


def test_only_what_rests_is_proposed(parts: Parts, plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SETTLED_S", 0.2)
    intake = Intake(parts.live, parts.plans, parts.versions, parts.registrations)
    for x in range(20):  # a hand that drags
        intake.receive(PointList("Targets", (ListPoint("T", (float(x), 0.0, 0.0)),)))
        assert intake.settle() == []
    time.sleep(0.25)
    assert len(intake.settle()) == 1
    (version,) = parts.versions.list(plan.id)
    assert version.content.targets[0].position == (-19.0, 0.0, 0.0)


def test_a_locked_plan_refuses(parts: Parts, intake: Intake, plan: Plan) -> None:
    parts.plans.do(plan.id, LockPlan(locked=True))
    with pytest.raises(PlanLocked, match="unlock it"):
        intake.receive(PointList("Path", (ListPoint("P", (0.0, 0.0, 0.0)),)))
    assert intake.settle() == []


def test_one_that_is_locked_meanwhile_refuses(parts: Parts, intake: Intake, plan: Plan) -> None:
    intake.receive(PointList("Path", (ListPoint("P", (0.0, 0.0, 0.0)),)))
    parts.plans.do(plan.id, LockPlan(locked=True))
    assert "locked" in intake.settle()[0]
    assert parts.versions.list(plan.id) == ()


def test_a_deleted_plan_refuses(parts: Parts, intake: Intake, plan: Plan) -> None:
    parts.plans.documents.delete(plan.id)
    with pytest.raises(PlanError, match="is deleted"):
        intake.receive(PointList("Path", (ListPoint("P", (0.0, 0.0, 0.0)),)))


def test_without_an_open_plan_all_is_refused(parts: Parts, intake: Intake) -> None:
    with pytest.raises(PlanError, match="no plan is open"):
        intake.receive(PointList("Path", (ListPoint("P", (0.0, 0.0, 0.0)),)))


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ((), "0 points"),
        (tuple(ListPoint("P", (0.0, 0.0, float(n))) for n in range(301)), "301 points"),
        ((ListPoint("P", (2e4, 0.0, 0.0)),), "beyond 10000 mm"),
        ((ListPoint("a\nb", (0.0, 0.0, 0.0)),), "control character"),
    ],
)
def test_points_that_are_no_plans_are_refused(
    intake: Intake, plan: Plan, points: tuple[ListPoint, ...], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        intake.receive(PointList("Path", points))


def test_a_registration_becomes_a_document_once(parts: Parts, intake: Intake, plan: Plan) -> None:
    sent = frames.registration_to_ras(TURN).astype(np.float32).astype(np.float64)
    intake.receive(Transform("Registration", sent))
    (words,) = intake.settle()
    assert "check it" in words
    (made,) = parts.registrations.list(plan.case_id)
    assert (made.content.to, made.content.made_from) == ("patient", "given")
    np.testing.assert_allclose(made.content.registration.transform, TURN, atol=1e-6)
    intake.receive(Transform("Registration", sent))  # an echo
    assert intake.settle() == []


def test_a_registration_out_of_a_transform_file_is_not_taken_for_one_of_the_link(
    parts: Parts, intake: Intake, plan: Plan
) -> None:
    """3D Slicer shows a .tfm in RAS on both sides, the link only that of the image: half a turn lies between them."""
    given = RegistrationContent("patient", tuple(TURN.ravel().tolist()), made_from="given")
    parts.registrations.create(plan.case_id, "Own", given)
    flip = np.diag([-1.0, -1.0, 1.0, 1.0])
    intake.receive(Transform("Registration", (flip @ TURN @ flip).astype(np.float32).astype(np.float64)))
    (words,) = intake.settle()
    assert words.startswith("'Own' has the patient's frame turned by half a turn")
    assert len(parts.registrations.list(plan.case_id)) == 1


def test_an_echo_is_known_though_another_registration_is_like_it_in_a_file(
    parts: Parts, intake: Intake, plan: Plan
) -> None:
    """What is stored is looked for before what may have come out of a file, and of what leads to the same only."""
    flip = np.diag([-1.0, -1.0, 1.0, 1.0])
    for name, to, matrix in (("A", "patient", TURN), ("B", "patient", flip @ TURN), ("C", "base", TURN)):
        given = RegistrationContent(to, tuple(matrix.ravel().tolist()), made_from="given")  # type: ignore[arg-type]
        parts.registrations.create(plan.case_id, name, given)
    intake.receive(Transform("Registration", frames.registration_to_ras(flip @ TURN)))
    assert intake.settle() == []
    turned = frames.registration_to_ras(flip @ TURN)
    turned[0, 3] += 5.0
    intake.receive(Transform("RegistrationToBase", turned))
    assert "check it" in intake.settle()[0]


def test_the_identity_is_no_registration(parts: Parts, intake: Intake, plan: Plan) -> None:
    """It is what the link itself tells where there is none, and what a new transform of Slicer is."""
    assert "says that there is none" in intake.receive(Transform("Registration", np.eye(4)))
    assert intake.settle() == []
    assert parts.registrations.list(plan.case_id) == ()


@pytest.mark.parametrize("scale", [(1.01, 1.0, 1.0), (-1.0, 1.0, 1.0)])
def test_a_matrix_that_is_not_rigid_is_no_registration(
    intake: Intake, plan: Plan, scale: tuple[float, float, float]
) -> None:
    with pytest.raises(LinkFault, match="not rigid"):
        intake.receive(Transform("Registration", np.diag([*scale, 1.0])))


@pytest.mark.parametrize("moved", [1e6, 1e15])
def test_a_registration_beyond_reach_is_refused(parts: Parts, intake: Intake, plan: Plan, moved: float) -> None:
    matrix = np.eye(4)
    matrix[0, 3] = moved
    with pytest.raises(InputError, match="beyond 10000 mm"):
        intake.receive(Transform("Registration", matrix))
    assert intake.settle() == []
    assert parts.registrations.list(plan.case_id) == ()


def test_what_nobody_asked_for_is_passed_over(intake: Intake, plan: Plan) -> None:
    assert intake.receive(Text("Path", "words")) == ""
    assert intake.receive(PointList("Fiducials", (ListPoint("P", (math.nan, 0.0, 0.0)),))) == ""
    assert intake.receive(Transform("ToolTip", np.zeros((4, 4)))) == ""
    assert intake.settle() == []


# -- against another implementation's client


@pytest.fixture
def pyigtl() -> Any:
    return pytest.importorskip("pyigtl", reason="pip install pyigtl tries the link against another implementation")


@pytest.fixture
def link(parts: Parts, plan: Plan) -> Iterator[LiveLink]:
    made = LiveLink(LinkAddress("127.0.0.1", 0), parts)
    made.port = made.start()  # type: ignore[attr-defined]
    yield made
    made.close()


@pytest.fixture
def peer(pyigtl: Any, link: LiveLink) -> Iterator[Any]:
    made = pyigtl.OpenIGTLinkClient(host="127.0.0.1", port=link.port)  # type: ignore[attr-defined]
    yield made
    made.stop()


def positions(message: Any) -> Any:
    return np.array(message.positions) * RAS


def heard(peer: Any, name: str, wanted: Callable[[Any], bool]) -> None:
    """Wait for a message that is wanted; those before it are passed over."""
    end = time.monotonic() + 5.0
    while not wanted(peer.wait_for_message(name, timeout=5)):
        assert time.monotonic() < end


def test_another_implementation_hears_the_plan_and_its_changes(parts: Parts, plan: Plan, peer: Any) -> None:
    path = peer.wait_for_message("Path", timeout=5)
    np.testing.assert_allclose(positions(path), [p.position for p in POINTS], rtol=1e-7)
    assert path.names == ["entry", "end"]
    assert peer.wait_for_message("Targets", timeout=5).names == ["Öffnung"]
    content = RegistrationContent("patient", tuple(TURN.ravel().tolist()), made_from="given")
    parts.plans.do(plan.id, UseRegistration(registration=parts.registrations.create(plan.case_id, "R", content).id))
    told = frames.registration_to_ras(TURN)
    heard(peer, "Registration", lambda message: np.allclose(message.matrix, told, rtol=1e-6, atol=1e-7))
    parts.plans.do(plan.id, MovePoint(point_id="b", position=(40.0, 50.0, 60.0)))
    heard(peer, "Path", lambda message: np.allclose(positions(message)[1], [40.0, 50.0, 60.0]))


def test_another_implementation_hears_that_a_registration_does_not_apply_any_more(
    parts: Parts, plan: Plan, case: Case, peer: Any
) -> None:
    """By another plan, which goes by none; by the first one again; and when no page shows any plan."""
    content = RegistrationContent("patient", tuple(TURN.ravel().tolist()), made_from="given")
    parts.plans.do(plan.id, UseRegistration(registration=parts.registrations.create(plan.case_id, "R", content).id))
    told, none = frames.registration_to_ras(TURN), np.eye(4)
    heard(peer, "Registration", lambda message: np.allclose(message.matrix, told, atol=1e-6))
    other = parts.plans.create(case.id, "Other way", PlanContent(paths=(PlanPath(points=POINTS),), targets=TARGETS))
    parts.live.opened("another page", other.id)
    heard(peer, "Registration", lambda message: np.array_equal(message.matrix, none))
    heard(peer, "Plan", lambda message: "Other way" in message.string and "no registration" in message.string)
    parts.live.opened("another page", None)  # the first page still shows its plan
    heard(peer, "Registration", lambda message: np.allclose(message.matrix, told, atol=1e-6))
    parts.live.opened("page", None)
    heard(peer, "Registration", lambda message: np.array_equal(message.matrix, none))
    heard(peer, "Plan", lambda message: message.string == "No plan is open.")


def test_another_implementation_hears_where_the_tool_is(parts: Parts, peer: Any) -> None:
    peer.wait_for_message("Path", timeout=5)
    parts.live.show_tool(TURN, "hands-on")
    matrix = peer.wait_for_message("ToolTip", timeout=5).matrix
    np.testing.assert_allclose(matrix, frames.pose_to_ras(TURN), rtol=1e-6, atol=1e-7)
    heard(peer, "ToolMode", lambda message: message.string == "hands-on")


def test_how_the_tool_is_driven_is_said_before_the_pose_and_to_whoever_comes_later(
    parts: Parts, link: LiveLink
) -> None:
    """HAZ-41: a free hand has no certificate, in 3D Slicer either."""
    told: list[Any] = []
    link._ended.set()
    link._thread.join()
    link._server.broadcast = lambda messages: told.append([one.name for one in messages])  # type: ignore[method-assign]
    for driven in ("hands-on", "hands-on", "freehand, without the certificate"):
        parts.live.show_tool(TURN, driven)
        link._send_tool()
    assert told == [["ToolMode", "ToolTip"], ["ToolTip"], ["ToolMode", "ToolTip"]]
    assert Text("ToolMode", "freehand, without the certificate") in link._greeting()


def test_poses_are_told_60_times_in_a_second_at_most(parts: Parts, link: LiveLink) -> None:
    told: list[Any] = []
    link._server.broadcast = lambda messages: told.extend(messages)  # type: ignore[method-assign]
    begin = time.monotonic()
    while time.monotonic() - begin < 1.0:
        parts.live.show_tool(TURN, "hands-on")
        time.sleep(0.001)
    poses = [one for one in told if isinstance(one, Transform)]
    assert 0 < len(poses) <= 62


def test_another_implementation_proposes_a_target(pyigtl: Any, parts: Parts, plan: Plan, peer: Any) -> None:
    peer.wait_for_message("Path", timeout=5)
    peer.send_message(pyigtl.PointMessage([[-8.0, -9.0, 10.0]], names=["new"], device_name="Targets"))
    end = time.monotonic() + 8.0
    while not (versions := parts.versions.list(plan.id)):
        assert time.monotonic() < end
        time.sleep(0.05)
    assert [(p.label, p.position) for p in versions[0].content.targets] == [("new", (8.0, 9.0, 10.0))]
    assert "Proposed as version" in peer.wait_for_message("Status", timeout=5).string


# -- addresses


def test_addresses_are_read() -> None:
    assert link_address("18944") == LinkAddress("127.0.0.1", 18944)
    assert link_address("[::1]:5") == LinkAddress("::1", 5)
    assert tracker_address("plus.local:18944/StylusTipToReference") == LinkAddress(
        "plus.local", 18944, "StylusTipToReference"
    )


@pytest.mark.parametrize("text", ["", "x", "0", "70000", "localhost:", "-1"])
def test_a_port_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="port"):
        link_address(text)


@pytest.mark.parametrize("text", ["localhost:18944", "localhost:18944/", "h:1/a name of 21 letters."])
def test_a_tracker_without_a_name_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="HOST:PORT/NAME"):
        tracker_address(text)


def test_the_network_is_let_in_only_where_it_is_asked_for(tmp_path: Any) -> None:
    with pytest.raises(InputError, match="asks nobody for a token"):
        Settings(home=tmp_path, igtl=link_address("0.0.0.0:18944"))
    Settings(home=tmp_path, igtl=link_address("0.0.0.0:18944"), allow_remote=True)
    assert Settings(home=tmp_path).igtl is None


def test_a_new_client_is_greeted_once(parts: Parts, link: LiveLink, plan: Plan) -> None:
    """And it is told of what changes after that, once as well."""
    once = dict.fromkeys(("Path", "Targets", "Plan", "Registration", "RegistrationToBase"), 1)
    with socket.create_connection(("127.0.0.1", link.port), timeout=5.0) as opened:  # type: ignore[attr-defined]
        assert names_within(opened, 1.0) == once
        parts.plans.do(plan.id, MovePoint(point_id="b", position=(40.0, 50.0, 60.0)))
        assert names_within(opened, 1.0) == once


def names_within(opened: socket.socket, seconds: float) -> Counter[str]:
    """The messages that come within some seconds, by their names."""
    data, end = b"", time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        opened.settimeout(left)
        with contextlib.suppress(TimeoutError):
            data += opened.recv(1 << 16)
    found: Counter[str] = Counter()
    while data:
        header = parse_header(data[:HEADER_BYTES])
        found[header.name] += 1
        data = data[HEADER_BYTES + header.size :]
    return found
