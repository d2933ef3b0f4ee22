"""Names in files of any character set: none loses a letter."""

import io
import os
import zipfile
from pathlib import Path

import nibabel
import numpy as np
import pydicom
import pytest
from imaging_phantoms import asymmetric_volume, dicom_slices, save_dicom
from label_files import save_dicom_seg, save_nifti, save_seg_nrrd

from vfix_engine.errors import SeriesUnclear
from vfix_engine.imaging.dicom import read_series
from vfix_engine.imaging.labels.mask_folder import read_mask_folder
from vfix_engine.imaging.labels.names import read_names
from vfix_engine.imaging.labels.reading import read_label_map
from vfix_engine.imaging.text_bytes import text_of_bytes

NAME = "Gehörgang für Übung"
CHARSETS = ["utf-8", "latin-1"]
VOLUME = asymmetric_volume()
MASK = VOLUME.hu > 300


def test_text_is_utf8_then_what_is_declared_then_latin1() -> None:
    assert text_of_bytes("Ł".encode(), ["latin-1"]) == "Ł"
    assert text_of_bytes("Łuk".encode("iso8859_2"), ["iso8859_2"]) == "Łuk"
    assert text_of_bytes("Öhr".encode("latin-1"), ["utf-8", "no such set"]) == "Öhr"
    assert text_of_bytes("a\u2019b".encode("cp1252")) == "a\u2019b"
    assert text_of_bytes("Ö\tä".encode("utf-16")) == "Ö\tä"
    assert [text_of_bytes(bytes([code])) != "" for code in range(256)].count(True) == 256


@pytest.mark.parametrize("charset", CHARSETS)
def test_tables_of_names(tmp_path: Path, charset: str) -> None:
    for file, text in (
        ("n.csv", f"label,name\n1,{NAME}\n"),
        ("n.json", f'{{"1": "{NAME}"}}'),
        ("n.tsv", f"1\t{NAME}\n"),
    ):
        (tmp_path / file).write_bytes(text.encode(charset))
        assert read_names(tmp_path / file)[1].name == NAME


@pytest.mark.parametrize("charset", CHARSETS)
@pytest.mark.parametrize("declared", ["UTF-8", "ISO-8859-1", None])
def test_label_table_in_a_nifti_header(tmp_path: Path, charset: str, declared: str | None) -> None:
    file = save_nifti(tmp_path / "labels.nii", MASK.astype(np.uint8), VOLUME.transform_index_to_lps, {1: NAME})
    image = nibabel.load(str(file))
    xml = image.header.extensions[0].get_content()
    said = b'<?xml version="1.0" encoding="UTF-8"?>'
    assert said in xml
    xml = xml.replace(said, b"" if declared is None else said.replace(b"UTF-8", declared.encode()))
    image.header.extensions[0] = nibabel.nifti1.Nifti1Extension(0, xml.replace(NAME.encode(), NAME.encode(charset)))
    nibabel.save(image, str(tmp_path / "again.nii"))
    assert [label.name for label in read_label_map(tmp_path / "again.nii", {}).labels] == [NAME]


@pytest.mark.parametrize("charset", CHARSETS)
def test_segments_of_slicer(tmp_path: Path, charset: str) -> None:
    mark = "x" * len(NAME.encode(charset))
    segment = {"Name": mark, "LabelValue": 1, "Layer": 0}
    file = save_seg_nrrd(tmp_path / "a.seg.nrrd", [MASK.astype(np.uint8)], [segment], VOLUME.transform_index_to_lps)
    file.write_bytes(file.read_bytes().replace(mark.encode(), NAME.encode(charset), 1))
    assert [label.name for label in read_label_map(file, {}).labels] == [NAME]


@pytest.mark.parametrize("charset", CHARSETS)
@pytest.mark.parametrize("declared", ["ISO_IR 192", "ISO_IR 100", None])
def test_segments_and_series_of_dicom(tmp_path: Path, charset: str, declared: str | None) -> None:
    """Whatever character set the file declares, rightly or not."""
    mark = "x" * (len(NAME.encode(charset)) + len(NAME.encode(charset)) % 2)
    raw = NAME.encode(charset).ljust(len(mark))
    slices = dicom_slices(VOLUME)
    slices[0].SeriesInstanceUID = "1.2.3"
    for one in slices:
        one.SeriesDescription = mark
        one.SpecificCharacterSet = declared
    folder = save_dicom(slices, tmp_path / "series")
    for file in folder.iterdir():
        file.write_bytes(file.read_bytes().replace(mark.encode(), raw))
    with pytest.raises(SeriesUnclear) as asked:
        read_series(folder)
    assert {one["description"] for one in asked.value.series} == {NAME}
    seg = pydicom.dcmread(save_dicom_seg(tmp_path / "seg.dcm", [MASK], [mark], VOLUME))
    seg.SpecificCharacterSet = declared
    stream = io.BytesIO()
    pydicom.dcmwrite(stream, seg)
    (tmp_path / "seg.dcm").write_bytes(stream.getvalue().replace(mark.encode(), raw))
    assert [label.name for label in read_label_map(tmp_path / "seg.dcm", {}).labels] == [NAME]


@pytest.mark.parametrize("charset", CHARSETS)
def test_masks_in_a_folder_and_in_zips(tmp_path: Path, charset: str) -> None:
    """A zip of Unix has the bytes of its names, one of Windows cp437, and a flag where it is UTF-8."""
    data = save_nifti(tmp_path / "m.nii", MASK.astype(np.uint8), VOLUME.transform_index_to_lps).read_bytes()
    (tmp_path / "masks").mkdir()
    with open(os.path.join(os.fsencode(tmp_path / "masks"), f"{NAME}.nii".encode(charset)), "wb") as file:
        file.write(data)
    assert [label.name for label in read_mask_folder(tmp_path / "masks").labels] == [NAME]
    for name, system in ((NAME.encode(charset), 3), (NAME.encode("cp437"), 0)):
        packed = tmp_path / f"{system}.zip"
        with zipfile.ZipFile(packed, "w") as archive:
            entry = zipfile.ZipInfo("x" * len(name) + ".nii")
            entry.create_system = system
            archive.writestr(entry, data)
        packed.write_bytes(packed.read_bytes().replace(b"x" * len(name), name))
        assert [label.name for label in read_mask_folder(packed).labels] == [NAME]
    with zipfile.ZipFile(tmp_path / "flag.zip", "w") as archive:
        archive.writestr(f"{NAME}.nii", data)
    assert [label.name for label in read_mask_folder(tmp_path / "flag.zip").labels] == [NAME]
