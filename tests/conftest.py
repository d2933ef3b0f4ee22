"""What every test may ask for."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("vfix", deadline=None)  # how long a machine takes is no property of the code
settings.load_profile("vfix")

DEFAULT_TRIAL_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def trial_data() -> Path:
    """Folder of the real images and surfaces; they are not part of the project. VFIX_TRIAL_DATA says where it is.

    Without them a test is skipped and counted as such; where VFIX_TRIAL_DATA names a folder without them it fails.
    """
    named = os.environ.get("VFIX_TRIAL_DATA")
    folder = Path(named or DEFAULT_TRIAL_DATA)
    if not (folder / "head_ct").is_dir():
        if named:
            pytest.fail(f"VFIX_TRIAL_DATA is {named}, where the trial data are not.")
        pytest.skip("needs the trial data; VFIX_TRIAL_DATA names their folder")
    return folder
