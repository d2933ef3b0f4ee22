"""What every test may ask for."""

import os
from pathlib import Path

import pytest

DEFAULT_TRIAL_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def trial_data() -> Path:
    """Folder of the real images and surfaces; they are not part of the project. VFIX_TRIAL_DATA says where it is."""
    folder = Path(os.environ.get("VFIX_TRIAL_DATA", DEFAULT_TRIAL_DATA))
    if not (folder / "head_ct").is_dir():
        pytest.fail(f"The trial data are not at {folder}; set VFIX_TRIAL_DATA to their folder.")
    return folder
