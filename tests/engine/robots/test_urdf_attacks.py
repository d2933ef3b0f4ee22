"""URDFs that want something else than to be a robot: other people's files, the machine's memory (HAZ-19, HAZ-20)."""

import itertools
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.engine.urdf_texts import GOOD, joint, links, urdf
from vfix_engine.errors import RobotError
from vfix_engine.robots import RobotModel
from vfix_engine.robots.urdf import parse_urdf
from vfix_engine.robots.xml_reader import read_xml

# HAZ-19: files that a URDF names

CANARY = "secret.stl"
STEPS = ["../", "..//", "./../", "a/../../", "meshes/../../", "../../../", "meshes/./../.././"]
SCHEMES = [
    "file://",
    "file:",
    "http://x/",
    "https://x/",
    "FILE://",
    "jar:file://",
    "ftp://x/",
    "data:,",
    "C:/",
    "\\\\x\\",
]


def payloads(outside: Path) -> list[str]:
    """Names that lead, or try to lead, to a file outside of the robot's folder."""
    absolute = outside.as_posix()
    found = [
        absolute,
        "//" + absolute,
        "~/secret.stl",
        "~root/secret.stl",
        "",
        " ",
        "/",
        ".",
        "meshes/..",
        "/etc/passwd",
    ]
    found += [
        f"{prefix}{step}{CANARY}" for prefix, step in itertools.product(("", "package://", "package://p/"), STEPS)
    ]
    found += [f"{scheme}{absolute}" for scheme in SCHEMES]
    found += [f"{scheme}../{CANARY}" for scheme in SCHEMES]
    found += [f"package://{scheme}{absolute}" for scheme in SCHEMES]
    found += [step.replace("/", "\\") + CANARY for step in STEPS]
    found += [step.replace(".", "%2e") + CANARY for step in STEPS]
    found += [step.replace("/", "%2f") + CANARY for step in STEPS]
    found += [
        f"package://{absolute}",
        f"package:///{absolute}",
        f"package://~/{CANARY}",
        "linked.stl",
        "linked/secret.stl",
    ]
    found += ["package://linked.stl", "./linked.stl", "meshes/../linked.stl", "circle/secret.stl", "x" * 5000]
    found += [f"{outside.parent.as_posix()}/./{CANARY}", f"package://linked/{CANARY}", f"meshes/up/up/{CANARY}"]
    found += [f"..\t/{CANARY}", f"\t{absolute}", f"&#x2e;&#x2e;/{CANARY}", f"&#47;{CANARY}"]
    found += [f"package://../{CANARY}", f"package://p//../../{CANARY}", f"package://package://../{CANARY}"]
    return found


@pytest.fixture
def opened() -> Iterator[Callable[[], list[str]]]:
    """What is opened by name while a test runs; an audit hook cannot be taken off again, so it is silenced."""
    names: list[str] = []
    listening = True

    def hear(event: str, arguments: tuple[object, ...]) -> None:
        if listening and event in ("open", "os.listdir", "os.scandir"):
            names.append(str(arguments[0]))

    sys.addaudithook(hear)
    yield lambda: list(names)
    listening = False


def test_no_name_leads_out_of_the_folder(tmp_path: Path, opened: Callable[[], list[str]]) -> None:
    """HAZ-19: more than 100 payloads, in visuals, collisions and textures: refused, and nothing outside is opened."""
    outside, folder = tmp_path / CANARY, tmp_path / "robot"
    outside.write_text("solid secret")
    (folder / "meshes").mkdir(parents=True)
    (folder / "linked.stl").symlink_to(outside)
    (folder / "linked").symlink_to(tmp_path)
    (folder / "meshes" / "up").symlink_to(folder.parent)
    (folder / "circle").symlink_to(folder / "circle")
    names = payloads(outside)
    assert len(set(names)) >= 100
    places = [
        '<visual><geometry><mesh filename="{}"/></geometry></visual>',
        '<collision><geometry><mesh filename="{}"/></geometry></collision>',
        '<visual><geometry><box size="1 1 1"/></geometry><material><texture filename="{}"/></material></visual>',
    ]
    unused = '<link name="lamp"><visual><geometry><mesh filename="../lamp.stl"/></geometry></visual></link>'
    (folder / "robot.urdf").write_text(urdf(links("a", "b"), unused, joint("one", "a", "b")))
    with pytest.raises(RobotError, match=r"link 'lamp': the file name '../lamp.stl' leads out .*; put the file beside"):
        RobotModel.load(folder / "robot.urdf")
    taken = []
    for number, name in enumerate(names):
        place = places[number % 3].format(name.replace('"', "&quot;"))
        file = folder / "robot.urdf"
        file.write_text(urdf(f'<link name="a">{place}</link>', links("b"), joint("one", "a", "b")))
        try:
            RobotModel.load(file)
            taken.append(name)
        except RobotError:
            pass
    assert taken == []
    heard = [name for name in opened() if CANARY in name or "passwd" in name or name.endswith("linked.stl")]
    assert [name for name in heard if name != str(outside)] == []
    assert heard.count(str(outside)) == 1  # where this test wrote it


# HAZ-20: entities

LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))
DOCUMENT_TYPES = [
    "<!DOCTYPE robot>",
    '<!DOCTYPE robot SYSTEM "http://example.org/robot.dtd">',
    '<!DOCTYPE robot SYSTEM "file:///etc/passwd">',
    '<!DOCTYPE robot PUBLIC "-//X//Y" "robot.dtd">',
    "<!DOCTYPE robot []>",
    '<!DOCTYPE robot [<!ENTITY x "y">]>',
    '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]>',
    '<!DOCTYPE robot [<!ENTITY x SYSTEM "http://169.254.169.254/">]>',
    '<!DOCTYPE robot [<!ENTITY % x SYSTEM "file:///etc/passwd"> %x;]>',
    "<!DOCTYPE robot [<!ENTITY % x \"<!ENTITY y 'z'>\"> %x;]>",
    f'<!DOCTYPE robot [<!ENTITY l0 "ha">{LAUGHS}]>',
    f'<!DOCTYPE robot [<!ENTITY x "{"A" * 100_000}">]>',
    '<!DOCTYPE robot [<!ENTITY x PUBLIC "a" "file:///dev/zero" NDATA b>]>',
    '<!DOCTYPE robot [<!NOTATION b SYSTEM "run.exe">]>',
    '<!DOCTYPE robot [<!ATTLIST robot name CDATA "default">]>',
    "<!DOCTYPE robot [<!ELEMENT robot ANY>]>",
    '<!DOCTYPE robot [<!ENTITY x "&x;">]>',
    '<!DOCTYPE x:robot SYSTEM "dev:/random" []>',
]


def harmful() -> list[bytes]:
    """Documents that make careless readers open files or fill the memory."""
    bodies = [GOOD.replace('name="test"', 'name="&x;"'), GOOD.replace("<link", "&l9;<link", 1)]
    found = [f'<?xml version="1.0"?>{head}{bodies[i % 2]}'.encode() for i, head in enumerate(DOCUMENT_TYPES)]
    found += [f'<?xml version="1.0" encoding="utf-16"?>{DOCUMENT_TYPES[6]}{GOOD}'.encode("utf-16")]
    found += [GOOD.replace('name="test"', 'name="&unknown;"').encode()]
    found += [b"<robot>" + b"<a>" * 100_000, b"<robot>" + b"<a/>" * 200_000 + b"</robot>"]
    found += [
        b"<robot " + b" ".join(b'a%d=""' % i for i in range(90_000)),
        b"\xff\xfe<",
        b"",
        b"\x00" * 100,
        b"<" * 900_000,
    ]
    found += [GOOD.encode() + b" " * (1 << 20), b'<?xml version="1.0" encoding="ebcdic-x"?><robot/>', GOOD.encode() * 2]
    return found


def test_no_entity_ever_exists(tmp_path: Path, opened: Callable[[], list[str]]) -> None:
    """HAZ-20: document types of every kind, bombs and floods, each refused in less than a second."""
    for number, document in enumerate(harmful()):
        # The processor's time, since other work on the machine is no fault of the reader's.
        start = time.process_time()
        with pytest.raises(RobotError) as refused:
            parse_urdf(document, tmp_path)
        assert time.process_time() - start < 1.0, number
        assert (number < 19) == ("document type" in str(refused.value)), (number, refused.value)
    assert [name for name in opened() if "passwd" in name or "zero" in name or "dtd" in name] == []


def test_a_file_is_not_read_beyond_its_cap(tmp_path: Path) -> None:
    """HAZ-20, HAZ-30: a robot is small; of a file that is not, only so much is read."""
    file = tmp_path / "large.urdf"
    with file.open("wb") as stream:
        stream.truncate(1 << 33)
    with pytest.raises(RobotError, match="larger than 1 MiB"):
        RobotModel.load(file)


def test_the_reader_keeps_what_matters() -> None:
    root = read_xml(b'<?xml version="1.0"?><!-- no --><a x="1"><b/>text<c y="&lt;"/><b z="2"/></a>')
    assert [child.tag for child in root.children] == ["b", "c", "b"]
    assert root.attributes == {"x": "1"}
    assert root.first("c") is not None
    assert [b.attributes for b in root.all("b")] == [{}, {"z": "2"}]
    assert root.first("d") is None
