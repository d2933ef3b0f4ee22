"""The shipped head as a folder of DICOM slices as from a scanner, with an invented patient."""

from __future__ import annotations

from pathlib import Path

import pydicom
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

from vfix_engine.files.volume import Volume

INTERCEPT = -1024
WINDOW_HU = (2000, 300)  # width and centre that the files suggest
_ENTROPY = ["vfix", "shipped head"]  # for the same identifiers each time


def write_dicom_folder(volume: Volume, folder: Path) -> Path:
    """Create `folder`, write one CT file per slice into it, and return it.

    volume: HU along the axes of LPS; its slices are along its first index.
    """
    folder.mkdir(parents=True, exist_ok=True)
    study, series, frame = (generate_uid(entropy_srcs=[*_ENTROPY, part]) for part in ("study", "series", "frame"))
    for k in range(len(volume.hu)):
        one = _slice(volume, k)
        one.StudyInstanceUID, one.SeriesInstanceUID, one.FrameOfReferenceUID = study, series, frame
        pydicom.dcmwrite(folder / f"IM{k + 1:04d}.dcm", one, enforce_file_format=True)
    return folder


def _slice(volume: Volume, k: int) -> FileDataset:
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = CTImageStorage
    meta.MediaStorageSOPInstanceUID = generate_uid(entropy_srcs=[*_ENTROPY, str(k)])
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    one = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    one.SOPClassUID, one.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
    one.PatientName, one.PatientID = "Phantom^Synthetic", "PHANTOM-1"
    one.Modality, one.SeriesNumber, one.SeriesDescription = "CT", 2, "Sinus, bone"
    one.InstanceNumber = k + 1
    one.Rows, one.Columns = volume.hu.shape[1:]
    one.SamplesPerPixel, one.PhotometricInterpretation = 1, "MONOCHROME2"
    one.BitsAllocated, one.BitsStored, one.HighBit, one.PixelRepresentation = 16, 16, 15, 0
    one.PixelSpacing = [f"{volume.spacing[1]:.10g}", f"{volume.spacing[0]:.10g}"]
    one.SliceThickness = f"{volume.spacing[2]:.10g}"
    one.ImageOrientationPatient = [f"{value:.10f}" for value in volume.direction[:, :2].T.ravel()]
    one.ImagePositionPatient = [f"{value:.10f}" for value in volume.index_to_lps([0, 0, k])]
    one.RescaleSlope, one.RescaleIntercept, one.RescaleType = 1, INTERCEPT, "HU"
    one.WindowWidth, one.WindowCenter = WINDOW_HU
    one.PixelData = (volume.hu[k].astype("<i4") - INTERCEPT).astype("<u2").tobytes()
    return one
