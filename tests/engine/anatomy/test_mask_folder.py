"""A folder of masks: a file that cannot be used is named, since it is one of many."""

from pathlib import Path

import nibabel
import numpy as np
import pytest

from vfix_engine.anatomy.labels.mask_folder import read_mask_folder
from vfix_engine.errors import ImageError


def saved(file: Path, value: float = 1.0) -> Path:
    values = np.random.default_rng(0).integers(0, 2, (12, 14, 16)).astype(np.float32) * value
    image = nibabel.Nifti1Image(values, np.diag([-1.0, -1.0, 1.0, 1.0]))  # type: ignore[no-untyped-call]
    nibabel.save(image, file)
    return file


def test_a_mask_that_is_cut_off_is_named(tmp_path: Path) -> None:
    saved(tmp_path / "carotid.nii.gz")
    assert len(read_mask_folder(tmp_path).labels) == 1
    cut = saved(tmp_path / "optic_nerve_left.nii.gz")
    cut.write_bytes(cut.read_bytes()[: cut.stat().st_size // 2])
    with pytest.raises(ImageError, match=r"mask 'Optic nerve left' cannot be used: .*cut off"):
        read_mask_folder(tmp_path)


def test_a_mask_that_is_not_finite_is_named(tmp_path: Path) -> None:
    saved(tmp_path / "carotid.nii.gz")
    saved(tmp_path / "zygoma.nii.gz", np.nan)
    with pytest.raises(ImageError, match=r"mask 'Zygoma' cannot be used: .*not finite"):
        read_mask_folder(tmp_path)
