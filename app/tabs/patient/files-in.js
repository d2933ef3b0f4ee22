// Files that are dropped or chosen: single ones, several, and folders; sorted into what one upload has to carry.

/** @typedef {{ file: File, path: string }} Found path: with its folders, where there are such */
/**
 * names: a table that names the labels of a segmentation. leftOut: what is not sent, as it belongs to other programs
 * @typedef {{ files: Found[], names: File | null, leftOut: Found[] }} Sorted
 */

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
const OF_THE_SYSTEM = /(^|\/)(dicomdir|\.[^/]*|thumbs\.db|desktop\.ini)$/i; // which nobody misses
const DICOM_AT = 128; // [byte] where a DICOM file says that it is one
const KINDS_SHOWN = 6;
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
 * What an upload carries: a table beside one other file names its labels; companions of a folder are left out, unless
 * they are images by what is in them.
 * @param {Found[]} found
 * @param {(file: File) => Promise<boolean>} [isImage]
 * @returns {Promise<Sorted>}
 */
export async function sorted(found, isImage = beginsAsDicom) {
  const tables = found.filter(({ path }) => TABLE.test(path));
  const sent = await Promise.all(found.map(async ({ file, path }) => {
    if (TABLE.test(path)) return false;
    return found.length === 1 || !COMPANION.test(path) || (!/(^|\/)dicomdir$/i.test(path) && await isImage(file));
  }));
  const files = found.flatMap((one, at) => (sent[at] ? [one] : []));
  const names = tables.length === 1 && files.length === 1 ? tables[0].file : null;
  const leftOut = found.filter(({ file, path }, at) => !sent[at] && file !== names && !OF_THE_SYSTEM.test(path));
  return { files, names, leftOut };
}

/** @param {File} file */
async function beginsAsDicom(file) {
  return await file.slice(DICOM_AT, DICOM_AT + 4).text() === "DICM";
}

/**
 * How many files are not sent, and of which kinds; '' where all are.
 * @param {Found[]} leftOut
 */
export function leftOutWords(leftOut) {
  if (!leftOut.length) return "";
  const kinds = [...new Set(leftOut.map(({ path }) => /\.[^./]+$/.exec(path)?.[0].toLowerCase() ?? path.split("/").at(-1)?.toLowerCase() ?? ""))].sort();
  const shown = kinds.slice(0, KINDS_SHOWN).join(", ") + (kinds.length > KINDS_SHOWN ? ", …" : "");
  return leftOut.length === 1 ? `1 file of another program was not sent (${shown}).` : `${leftOut.length} files of other programs were not sent (${shown}).`;
}

/**
 * Why these files cannot be a case or a segmentation, as far as their names tell; '' where they may be.
 * @param {Found[]} files
 */
export function refusal(files) {
  if (!files.length) return "no file in it can be a case.";
  if (files.length > 1) return "";
  const [{ path }] = files;
  if (HEADER.test(path)) return "choose header and voxel file together.";
  if (READABLE.test(path) || !/\.[a-z][a-z0-9]{0,4}$/i.test(path)) return "";
  return "not a file of a case. Such are a DICOM folder or .zip, .nrrd, .nii, .nii.gz, .mha, .ply, .stl, .obj, .glb, .vtk or .vtp.";
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
 * @param {Pick<Sorted, "files" | "names">} what
 * @param {boolean} [described] whether the file's series description may become the name
 * @param {boolean} [lumen] whether it is the wall of a lumen, and no head
 */
export function formOf({ files, names }, described = false, lumen = false) {
  const form = new FormData();
  for (const { file, path } of files) form.append("file", file, path);
  if (names) form.append("names", names);
  if (lumen) form.append("kind", "lumen");
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
