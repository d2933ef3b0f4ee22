"""The colons that several tests of the lumen ask for, each made once."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from vfix_engine.anatomy.lumen.centreline import Centreline, centreline_between
from vfix_engine.anatomy.lumen.synthetic import SyntheticCourse, synthetic_colon, synthetic_course
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.geometry.mesh import TriangleMesh


@pytest.fixture(scope="session")
def colon(trial_data: Path) -> TriangleMesh:
    """The surface of a real colon."""
    return read_mesh(trial_data / "colon" / "colon_surface_lps_mm.stl", assume=True)[0]


@pytest.fixture(scope="session")
def colon_info(trial_data: Path) -> dict[str, NDArray[np.float64]]:
    """Landmarks of the real colon in LPS mm, by name, from the anus on."""
    text = (trial_data / "colon" / "colon_info.json").read_text(encoding="utf-8")
    return {name: np.array(mark["lps"]) for name, mark in json.loads(text)["landmarks"].items()}


@pytest.fixture(scope="session")
def published_centreline(trial_data: Path) -> NDArray[np.float64]:
    """The real colon's centreline (n, 3) in LPS mm as its authors have it."""
    file = trial_data / "colon" / "colon_centreline_published_lps_mm.csv"
    return np.genfromtxt(file, delimiter=",", skip_header=1)[:, 1:4]


@pytest.fixture(scope="session")
def colon_centreline(colon: TriangleMesh, colon_info: dict[str, NDArray[np.float64]]) -> Centreline:
    """Ours, of the whole real colon."""
    return centreline_between(colon, colon_info["anus"], colon_info["appendix_tip"])


@pytest.fixture(scope="session")
def made_up_colon() -> TriangleMesh:
    """The surface of the synthetic colon of seed 0."""
    return synthetic_colon()


@pytest.fixture(scope="session")
def made_up_course() -> SyntheticCourse:
    """What the synthetic colon of seed 0 was made of."""
    return synthetic_course()
