// Files that are dropped or chosen: single ones, several, and folders; sorted into what one upload has to carry.

/** @typedef {{ file: File, path: string }} Found path: with its folders, where there are such */
/** @typedef {{ files: Found[], names: File | null }} Sorted names: a table that names the labels of a segmentation */

export const ACCEPTED = ".nrrd,.nhdr,.raw,.nii,.gz,.mha,.mhd,.zraw,.hdr,.img,.zip,.dcm,.ply,.stl,.obj,.glb,.vtk,.vtp,.json,.csv,.tsv";
const READABLE = /\.(nrrd|nii|nii\.gz|mha|zip|ply|stl|obj|glb|vtk|vtp|dcm|ima)$/i;
const TABLE = /\.(json|csv|tsv)$/i;
const MASK = /\.nii(\.gz)?$/i;
const SEGMENTATION = /\.seg\.nrrd$/i;
// Beside the slices on a hospital's disc.
const COMPANION = new RegExp(
  "(^|/)(dicomdir|\\..*|thumbs\\.db|readme|licen[cs]e|autorun|.*\\.(txt|md|pdf|html?|xml|xslt?|xsd|dtd|log|rtf|docx?|xlsx?|pptx?" +
  "|chm|hlp|jpe?g|png|gif|bmp|tiff?|svg|ico|icns|ttf|exe|dll|ocx|sys|drv|com|scr|msi|cab|bat|cmd|sh|so|dylib|jar|class|jnlp|js" +
  "|css|php|inf|ini|cfg|conf|config|manifest|properties|plist|nib|strings|lnk|url|desktop|db|sqlite))$", "i");
const HEADER = /\.(nhdr|mhd|hdr)$/i;

/**
 * Everything that was dropped, folders with what is in them.
 * @param {DataTransfer} transfer
 * @returns {Promise<Found[]>}
 */
export async function dropped(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry()).filter((entry) => entry !== null);
  if (!entries.length) return [...transfer.files].map((file) => ({ file, path: file.name }));
  return (await Promise.all(entries.map((entry) => held(entry)))).flat();
}

/**
 * @param {FileSystemEntry} entry
 * @returns {Promise<Found[]>}
 */
async function held(entry) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => { /** @type {FileSystemFileEntry} */ (entry).file(resolve, reject); });
    return [{ file, path: entry.fullPath.replace(/^\//, "") }];
  }
  const reader = /** @type {FileSystemDirectoryEntry} */ (entry).createReader();
  /** @type {FileSystemEntry[]} */
  const entries = [];
  for (;;) {
    /** @type {FileSystemEntry[]} a hundred at a time, none at the end */
    const some = await new Promise((resolve, reject) => { reader.readEntries(resolve, reject); });
    if (!some.length) break;
    entries.push(...some);
  }
  return (await Promise.all(entries.map((one) => held(one)))).flat();
}

/**
 * @param {Iterable<File>} files
 * @returns {Found[]}
 */
export function chosen(files) {
  return [...files].map((file) => ({ file, path: file.webkitRelativePath || file.name }));
}

/**
 * What an upload carries: a table beside one other file names its labels; companions of a folder are left out.
 * @param {Found[]} found
 * @returns {Sorted}
 */
export function sorted(found) {
  const tables = found.filter(({ path }) => TABLE.test(path));
  const others = found.filter(({ path }) => !TABLE.test(path) && (found.length === 1 || !COMPANION.test(path)));
  return { files: others, names: tables.length === 1 && others.length === 1 ? tables[0].file : null };
}

/**
 * Why these files cannot be a head or a segmentation, as far as their names tell; '' where they may be.
 * @param {Found[]} files
 */
export function refusal(files) {
  if (!files.length) return "there is no file in it that can be a head.";
  if (files.length > 1) return "";
  const [{ path }] = files;
  if (HEADER.test(path)) return "the voxels lie in a second file, which this one only names. Choose both files together.";
  if (READABLE.test(path) || !/\.[a-z][a-z0-9]{0,4}$/i.test(path)) return "";
  return "a head is imported from a DICOM folder or .zip, .nrrd, .nii, .nii.gz, .mha, .ply, .stl, .obj, .glb, .vtk or .vtp.";
}

/**
 * Whether the names say that this is a segmentation: several NIfTI files are masks, one of each structure.
 * @param {Found[]} files
 */
export function isSegmentation(files) {
  if (files.length > 1) return files.every(({ path }) => MASK.test(path));
  return files.length === 1 && SEGMENTATION.test(files[0].path);
}

/**
 * The form of an upload.
 * @param {Sorted} what
 * @param {boolean} [described] whether the file's series description may become the name
 */
export function formOf({ files, names }, described = false) {
  const form = new FormData();
  for (const { file, path } of files) form.append("file", file, path);
  if (names) form.append("names", names);
  if (described) form.append("use_description", "yes");
  return form;
}

/**
 * What the upload is called while it goes on.
 * @param {Found[]} files
 */
export function uploadWords(files) {
  if (files.length === 1) return `‘${files[0].file.name}’`;
  return `${files.length} files`;
}
