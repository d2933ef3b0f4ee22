"""Segmentations written by the libraries of their formats: pynrrd, nibabel and highdicom."""

from pathlib import Path

import highdicom
import nibabel
import nrrd
import numpy as np
import pydicom
from highdicom.color import CIELabColor
from highdicom.sr.coding import CodedConcept
from pydicom.uid import UID, generate_uid

from tests.engine.imaging_phantoms import dicom_slices
from vfix_engine.anatomy.labels.reading import AnatomyPlace
from vfix_engine.files.volume import Volume

RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


def ellipsoid(shape: tuple[int, int, int], centre: tuple[float, ...], radii: tuple[float, ...]) -> np.ndarray:
    """Mask [k, j, i] of an ellipsoid; centre and radii in voxels along i, j, k."""
    k, j, i = np.indices(shape)
    return sum(((a - c) / r) ** 2 for a, c, r in zip((i, j, k), centre, radii, strict=True)) <= 1.0


def place_of(volume: Volume) -> AnatomyPlace:
    return AnatomyPlace(volume.bounds, volume.transform_index_to_lps, volume.hu.shape[::-1])


def save_seg_nrrd(
    file: Path, layers: list[np.ndarray], segments: list[dict[str, object]], transform: np.ndarray, **header: object
) -> Path:
    """As 3D Slicer writes it. layers: [k, j, i] of labels; segments: Name, LabelValue, Layer, Color of each."""
    stored = np.stack([layer.T for layer in layers]) if len(layers) > 1 else layers[0].T
    directions: list[object] = [list(column) for column in transform[:3, :3].T]
    kinds = ["domain"] * 3
    if len(layers) > 1:
        directions, kinds = [[np.nan] * 3, *directions], ["list", *kinds]
    fields: dict[str, object] = {
        "space": "left-posterior-superior",
        "kinds": kinds,
        "space directions": np.array(directions, dtype=float),
        "space origin": transform[:3, 3],
        "encoding": "gzip",
        "Segmentation_MasterRepresentation": "Binary labelmap",
    }
    for number, segment in enumerate(segments):
        fields |= {f"Segment{number}_{key}": str(value) for key, value in segment.items()}
    nrrd.write(str(file), np.asfortranarray(stored.astype(np.uint8)), fields | header, index_order="F")
    return file


def save_nifti(file: Path, labels: np.ndarray, transform: np.ndarray, names: dict[int, str] | None = None) -> Path:
    """As TotalSegmentator writes it, with the label table in an extension where there are names."""
    image = nibabel.Nifti1Image(labels.T.astype(np.uint8), RAS @ transform)
    image.header.set_xyzt_units("mm")
    if names is not None:
        rows = "\n".join(
            f'<Label Key="{value}" Red="1.0" Green="0.5" Blue="0.0" Alpha="1"><![CDATA[{name}]]></Label>'
            for value, name in names.items()
        )
        xml = (
            '<?xml version="1.0" encoding="UTF-8"?> <CaretExtension>  <Date><![CDATA[2013-07-14T05:45:09]]></Date>   '
            f'<VolumeInformation Index="0">   <LabelTable>\n{rows}\n  </LabelTable>  <StudyMetaDataLinkSet>  '
            "</StudyMetaDataLinkSet>  <VolumeType><![CDATA[Label]]></VolumeType>   </VolumeInformation>"
            "</CaretExtension>\n              "
        )
        image.header.extensions.append(nibabel.nifti1.Nifti1Extension(0, xml.encode()))
    nibabel.save(image, str(file))
    return file


def ct_series(volume: Volume) -> list[pydicom.Dataset]:
    """The CT of a volume as DICOM slices with all that a segmentation refers to."""
    slices = dicom_slices(volume)
    study, frame = generate_uid(), generate_uid()
    for number, one in enumerate(slices):
        one.StudyInstanceUID, one.FrameOfReferenceUID = study, frame
        one.PatientID = one.StudyID = one.AccessionNumber = "Canary"
        one.PatientBirthDate, one.PatientSex = "19700101", "O"
        one.StudyDate = one.StudyTime = one.ReferringPhysicianName = one.PositionReferenceIndicator = ""
        one.SliceThickness, one.InstanceNumber = volume.spacing[2], number + 1
    return slices


def save_dicom_seg(
    file: Path, masks: list[np.ndarray], names: list[str], volume: Volume, kind: str = "BINARY", **options: object
) -> Path:
    """A SEG of masks [k, j, i] on the grid of a volume, by highdicom."""
    slices = ct_series(volume)
    code = CodedConcept("85756007", "SCT", "Tissue")
    described = [
        highdicom.seg.SegmentDescription(
            segment_number=number,
            segment_label=name,
            segmented_property_category=code,
            segmented_property_type=code,
            algorithm_type=highdicom.seg.SegmentAlgorithmTypeValues.MANUAL,
            display_color=CIELabColor(53.0, 80.0, 67.0),  # near red
        )
        for number, name in enumerate(names, start=1)
    ]
    if kind == "LABELMAP":
        pixels = np.zeros(masks[0].shape, dtype=np.uint8)
        for number, mask in enumerate(masks, start=1):
            pixels[mask] = number
    else:
        pixels = np.stack(masks, axis=-1).astype(np.uint8)
    seg = highdicom.seg.Segmentation(
        source_images=slices,
        pixel_array=pixels,
        segmentation_type=kind,
        segment_descriptions=described,
        series_instance_uid=UID(generate_uid()),
        series_number=7,
        sop_instance_uid=UID(generate_uid()),
        instance_number=1,
        manufacturer="Canary",
        manufacturer_model_name="Canary",
        software_versions="Canary",
        device_serial_number="Canary",
        series_description="Canary",
        **options,
    )
    seg.save_as(str(file))
    return file
