"""A small head that is like no mirror image of itself, and the ways to write it."""

from pathlib import Path

import numpy as np
import pydicom
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

from vfix_engine.files.volume import Volume


def asymmetric_volume(direction: np.ndarray | None = None) -> Volume:
    """Air with one dense box per axis, each of another size and place, and a ramp that tells every voxel apart."""
    hu = np.full((9, 12, 15), -1000, dtype=np.int16)
    hu[2:4, 3:9, 4:12] = 700
    hu[4:7, 3:5, 4:7] = 1200
    hu[4:6, 7:9, 10:12] = 400
    hu += (np.arange(hu.size) % 97).reshape(hu.shape).astype(np.int16)
    axes = np.eye(3) if direction is None else direction
    return Volume(hu, np.array([-31.5, 12.25, 40.0]), np.array([0.75, 0.5, 1.25]), axes)


def rotation(degrees: tuple[float, float, float]) -> np.ndarray:
    """Turn about x, then y, then z."""
    a, b, c = np.radians(degrees)
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def dicom_slices(volume: Volume, series: str | None = None) -> list[FileDataset]:
    """One CT dataset per k, stored with an intercept of -1024."""
    series = series or generate_uid()
    made = []
    for k in range(volume.hu.shape[0]):
        meta = FileMetaDataset()
        meta.MediaStorageSOPClassUID = CTImageStorage
        meta.MediaStorageSOPInstanceUID = generate_uid()
        meta.TransferSyntaxUID = ExplicitVRLittleEndian
        one = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
        one.SOPClassUID, one.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
        one.Modality, one.SeriesInstanceUID, one.InstanceNumber = "CT", series, k + 1
        one.PatientName = "Canary^Patient"
        one.Rows, one.Columns = volume.hu.shape[1:]
        one.SamplesPerPixel, one.PhotometricInterpretation = 1, "MONOCHROME2"
        one.BitsAllocated, one.BitsStored, one.HighBit, one.PixelRepresentation = 16, 16, 15, 0
        one.PixelSpacing = [f"{volume.spacing[1]:.10g}", f"{volume.spacing[0]:.10g}"]
        one.ImageOrientationPatient = [f"{value:.10f}" for value in volume.direction[:, :2].T.ravel()]
        one.ImagePositionPatient = [f"{value:.10f}" for value in volume.index_to_lps([0, 0, k])]
        one.RescaleSlope, one.RescaleIntercept = 1, -1024
        one.PixelData = (volume.hu[k].astype(np.int32) + 1024).astype("<u2").tobytes()
        made.append(one)
    return made


def save_dicom(slices: list[FileDataset], folder: Path) -> Path:
    """Write the slices in an order that is not the patient's."""
    folder.mkdir(exist_ok=True)
    for number, one in enumerate(reversed(slices)):
        pydicom.dcmwrite(folder / f"{number:03d}.dcm", one, enforce_file_format=True)
    return folder
