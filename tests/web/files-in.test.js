// Files that come in: what one upload carries, and what is no head by its name alone.
import assert from "node:assert/strict";
import { test } from "node:test";
import "./page.js";

const { isSegmentation, leftOutWords, refusal, sorted, uploadWords } = await import("../../app/tabs/patient/files-in.js");

/**
 * @param {...string} paths
 * @returns {any[]}
 */
const found = (...paths) => paths.map((path) => ({ path, file: new File([path.includes("image") ? `${"\0".repeat(128)}DICM` : "MZ"], path.split("/").at(-1) ?? "") }));

test("a table beside one file names its labels, beside several it is left out", async () => {
  const named = await sorted(found("labels.nii.gz", "names.csv"));
  assert.equal(named.names?.name, "names.csv");
  assert.deepEqual(named.leftOut, []);
  assert.equal((await sorted(found("a.dcm", "b.dcm", "names.csv"))).names, null);
  assert.equal((await sorted(found("labels.nii.gz", "a.csv", "b.json"))).names, null);
});

test("what lies beside the slices on a disc is left out, not a slice of whatever name", async () => {
  const { files, leftOut } = await sorted(found(
    "disc/DICOMDIR", "disc/.DS_Store", "disc/readme.TXT", "disc/IM0001", "disc/b.dcm", "disc/viewer.exe", "disc/V/core.DLL", "disc/V/app.ico", "disc/AUTORUN.INF", "disc/V/viewer.ini", "disc/image.exe", "disc/.image"));
  assert.deepEqual(files.map((one) => one.path), ["disc/IM0001", "disc/b.dcm", "disc/image.exe", "disc/.image"]);
  assert.equal(leftOutWords(leftOut), "6 files of other programs were not sent (.dll, .exe, .ico, .inf, .ini, .txt).");
  assert.equal(leftOutWords(leftOut.slice(0, 1)), "1 file of another program was not sent (.txt).");
  assert.equal(leftOutWords((await sorted(found("d/a.dcm", "d/b.dcm", "d/DICOMDIR", "d/.DS_Store"))).leftOut), "");
  const many = found(..."exe dll ocx ico inf ini chm".split(" ").map((end) => `d/x.${end}`), "d/AUTORUN", "d/a", "d/b");
  assert.match(leftOutWords((await sorted(many)).leftOut), /^8 files .* \(\.chm, \.dll, \.exe, \.ico, \.inf, \.ini, …\)\.$/);
});

test("a file that cannot be a head says why, one without an ending may be DICOM", () => {
  assert.match(refusal(found("v.nhdr")), /header and voxel file together/);
  assert.match(refusal(found("notes.docx")), /DICOM folder/);
  assert.match(refusal([]), /no file/);
  for (const path of ["IM0001", "v.nii.gz", "v.NRRD", "s.vtp", "1.2.840.113619.2"]) assert.equal(refusal(found(path)), "", path);
  assert.equal(refusal(found("v.nhdr", "v.raw")), "");
});

test("only the name of a segmentation says that it is one", () => {
  assert.ok(isSegmentation(found("a/Head.seg.nrrd")));
  assert.ok(isSegmentation(found("t/liver.nii.gz", "t/eye_left.nii")), "masks, one of each structure");
  assert.ok(!isSegmentation(found("head.nrrd")));
  assert.equal(uploadWords(found("a/b.zip")), "‘b.zip’");
  assert.equal(uploadWords(found("a", "b")), "2 files");
});
