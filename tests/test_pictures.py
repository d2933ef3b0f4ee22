"""The docs' pictures come from one script, which goes through the tutorial by the names that the tutorial tells."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest

from pictures.album import MOST_BYTES, small_png
from pictures.dicom_folder import WINDOW_HU, write_dicom_folder
from vfix_engine.files.dicom import read_series
from vfix_engine.files.volume import Volume

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
NAMES = ("planning", "registration", "colonoscopy")
TUTORIALS = {name: (ROOT / "docs" / f"{name}_tutorial.md").read_text("utf-8") for name in NAMES}
OF_TUTORIALS = {file for name, text in TUTORIALS.items() for file in re.findall(rf"images/({name}_\w+)\.png", text)}
OF_THE_PAGE = sorted({*OF_TUTORIALS, "plan"})


def spoken(files: list[Path]) -> set[str]:
    """Every text that modules use."""
    nodes = [node for file in files for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))]
    return {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}


WORDS = spoken(sorted((ROOT / "scripts" / "pictures").glob("*.py")))


@pytest.mark.parametrize("name", OF_THE_PAGE)
def test_a_picture_is_there_small_and_made_by_the_script(name: str) -> None:
    assert name in WORDS
    assert (IMAGES / f"{name}.png").stat().st_size <= MOST_BYTES


def test_the_tutorial_shows_every_picture_that_is_made_for_it() -> None:
    assert {word for word in WORDS if re.fullmatch(rf"({'|'.join(NAMES)})_\w+", word)} == OF_TUTORIALS
    assert {file.stem for name in TUTORIALS for file in IMAGES.glob(f"{name}_*")} == OF_TUTORIALS


@pytest.mark.parametrize(("name", "least"), [("planning", 30), ("registration", 12), ("colonoscopy", 12)])
def test_what_the_tutorial_quotes_is_used_on_the_page(name: str, least: int) -> None:
    """Names of controls are in italics, words of the page in quotation marks, places in the form that is typed."""
    quoted = {*re.findall(r"(?<!\*)\*([^*\n]+)\*(?!\*)", TUTORIALS[name]), *re.findall(r"‘([^’\n]+)’", TUTORIALS[name])}
    quoted |= set(re.findall(r"`([LR] [^`]+)`", TUTORIALS[name]))
    assert len(quoted) > least
    assert quoted - {"italics"} - WORDS == set()


def test_the_folder_is_the_head_that_was_written(tmp_path: Path) -> None:
    hu = np.random.default_rng(5).integers(-1000, 2000, (12, 20, 16)).astype(np.int16)
    head = Volume(hu, np.array([-8.0, 4.5, 20.0]), np.array([0.7, 0.8, 1.5]), np.eye(3))
    back = read_series(write_dicom_folder(head, tmp_path / "dicom")).volume
    assert np.array_equal(back.hu, head.hu)
    assert np.allclose([back.spacing, back.origin], [head.spacing, head.origin])
    assert back.window == WINDOW_HU


def test_a_picture_gets_smaller_or_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    png = (IMAGES / "lumen.png").read_bytes()
    assert small_png(png).startswith(b"\x89PNG")
    monkeypatch.setattr("pictures.album.MOST_BYTES", 1000)
    with pytest.raises(ValueError, match="1,000 are allowed"):
        small_png(png)
