// VTK XML PolyData (.vtp) as 3D Slicer, ParaView and VMTK write it, as triangles. Format: https://docs.vtk.org,
// "VTK XML file formats"; how data are encoded: vtkXMLDataParser of VTK.
import {base64_source, bytes_source} from "./byte_source.js";
import {inflate} from "./inflate.js";

const LONG_TEXT = 512;  // letters: kept out of the document, for a file has 64 MB of them
const SIZES = {Int8: 1, UInt8: 1, Int16: 2, UInt16: 2, Int32: 4, UInt32: 4, Int64: 8, UInt64: 8, Float32: 4, Float64: 8};
const LIBRARIES = {vtkLZ4DataCompressor: "LZ4", vtkLZMADataCompressor: "LZMA"};
const ZLIB = "vtkZLibDataCompressor";

const number = (element, name) => {
  const text = element.getAttribute(name) ?? "0", value = Number(text);
  if (!Number.isInteger(value) || value < 0) throw new Error(`${name} of ${element.nodeName} is "${text.slice(0, 20)}", expected a whole number`);
  return value;
};

// Reads the bytes of a file. `max_triangles` bounds what is made of it; `pause` is awaited between parts of the work. Returns
// {positions, axes}: Float32Array, 9 numbers a triangle, and "LPS", "RAS" or "" as Slicer says it. Throws Error with words for a person.
export async function read_vtp(bytes, max_triangles, pause) {
  const file = open_file(bytes);
  file.pause = pause;
  await pause();
  const pieces = [...file.root.querySelectorAll(":scope > PolyData > Piece")];
  if (!pieces.length) throw new Error("it has no Piece of PolyData");
  const parts = [];
  let left = max_triangles;
  for (const [i, piece] of pieces.entries()) {
    try {
      parts.push(await read_piece(file, piece, left, max_triangles));
    } catch (error) {
      throw pieces.length > 1 ? new Error(`piece ${i + 1} of ${pieces.length}: ${error.message}`) : error;
    }
    left -= parts.at(-1).length / 9;
    await pause();
  }
  const positions = new Float32Array(9 * (max_triangles - left));
  let at = 0;
  for (const part of parts) { positions.set(part, at); at += part.length; }
  return {positions, axes: await axes_of(file)};
}

// 3D Slicer writes "LPS" or "RAS" and a zero into an array of texts.
async function axes_of(file) {
  const element = file.root.querySelector(':scope > PolyData > FieldData > Array[Name="SPACE"]');
  if (!element) return "";
  try {
    const axes = String.fromCharCode(...(await read_numbers(file, element, "UInt8", 4, "axes")).subarray(0, 3));
    return ["LPS", "RAS"].includes(axes) ? axes : "";
  } catch {
    return "";
  }
}

// ---- The document

// Raw appended data are cut off first, for they are no XML, and long texts put aside, for a document of them is slow to make.
function open_file(bytes) {
  const text = new TextDecoder("latin1").decode(bytes);  // one letter a byte
  const tag = /<AppendedData\b[^>]*>/.exec(text);
  const is_raw = tag !== null && /encoding\s*=\s*["']raw["']/.test(tag[0]);
  const texts = [], whole = is_raw ? `${text.slice(0, tag.index + tag[0].length)}</AppendedData></VTKFile>` : text;
  const skeleton = without_long_texts(whole.slice(Math.max(whole.indexOf("<"), 0)), texts);
  const root = new DOMParser().parseFromString(skeleton, "text/xml").documentElement;
  const trouble = root.nodeName === "parsererror" ? root : root.querySelector("parsererror");
  if (trouble) throw new Error("it is no complete XML; was it cut off while it was written?");
  check_root(root);
  const file = {root, texts, is_little: root.getAttribute("byte_order") !== "BigEndian",
                header_bytes: root.getAttribute("header_type") === "UInt64" ? 8 : 4, compressor: root.getAttribute("compressor") ?? ""};
  if (tag) file.appended = appended(bytes, text, tag, is_raw);
  return file;
}

// Long texts between tags go to `texts`; in their places stand their numbers.
function without_long_texts(document, texts) {
  let kept = "", at = 0;
  for (let end = 0, begin; (begin = document.indexOf(">", end) + 1) > 0 && (end = document.indexOf("<", begin)) > 0;) {
    if (end - begin < LONG_TEXT) continue;
    kept += `${document.slice(at, begin)}@${texts.push(document.slice(begin, end)) - 1}@`;
    at = end;
  }
  return kept + document.slice(at);
}

function check_root(root) {
  const type = root.getAttribute("type") ?? "nothing";
  if (root.nodeName !== "VTKFile") throw new Error(`it begins with ${root.nodeName.slice(0, 20)}, expected VTKFile`);
  if (type !== "PolyData") throw new Error(`it holds ${type.slice(0, 30)}, expected PolyData: extract its surface and save that as .vtp`);
  const library = root.getAttribute("compressor") ?? "";
  if (library && library !== ZLIB) {
    throw new Error(`it is compressed with ${LIBRARIES[library] ?? library.slice(0, 40)}, which is not read: save it with zlib or without compression`);
  }
}

// What follows the underscore, where offsets begin. Of raw data the last end tag is the end: bytes may look like one.
function appended(bytes, text, tag, is_raw) {
  const begin = text.indexOf("_", tag.index + tag[0].length) + 1;
  if (!begin) throw new Error("its appended data have no underscore, where they begin");
  const end = text.lastIndexOf("</AppendedData");
  const data = bytes.subarray(begin, end > begin ? end : bytes.length);
  return is_raw ? (at) => bytes_source(data, at) : (at) => base64_source(data, at);
}

// ---- One array

// `count` numbers as Float64Array. `what` names them for a person.
async function read_array(file, element, count, what) {
  if (!count) return new Float64Array();
  if (!element) throw new Error(`${what} are missing`);
  const type = element.getAttribute("type");
  if (!SIZES[type]) throw new Error(`${what} are of type ${String(type).slice(0, 20)}, which is not read`);
  return read_numbers(file, element, type, count, what);
}

async function read_numbers(file, element, type, count, what) {
  const format = element.getAttribute("format") ?? "ascii";
  if (format === "ascii") return ascii_numbers(text_of(file, element), count, what, file.pause);
  const source = source_of(file, element, format, what);
  const bytes = await (file.compressor ? packed_bytes : plain_bytes)(file, source, count * SIZES[type], what);
  await file.pause();
  return numbers_of(bytes, type, count, file.is_little);
}

function source_of(file, element, format, what) {
  if (format === "binary") return base64_source(new TextEncoder().encode(text_of(file, element)), 0);
  if (format !== "appended") throw new Error(`${what} have the format "${format.slice(0, 20)}", expected ascii, binary or appended`);
  if (!file.appended) throw new Error(`${what} are appended, and the file has no AppendedData: was it cut off while it was written?`);
  return file.appended(number(element, "offset"));
}

// Its own text: an array may also have InformationKeys, which have texts.
const text_of = ({texts}, element) => [...element.childNodes].filter(({nodeType}) => nodeType === Node.TEXT_NODE).map(({data}) => data).join("")
  .replace(/@(\d+)@/g, (_, i) => texts[i]);

async function ascii_numbers(text, count, what, pause) {
  const numbers = new Float64Array(count);
  let i = 0;
  for (const [word] of text.matchAll(/\S{1,40}/g)) {
    if (i < count) numbers[i] = Number(word);
    if (!(++i & 0x3fff)) await pause();
  }
  if (i !== count) throw new Error(`${what} are ${i} numbers, expected ${count}`);
  return numbers;
}

const cut_off = (what) => new Error(`${what} end too early: was the file cut off, or is an offset wrong?`);

function take(source, count, what) {
  const bytes = source.take(count);
  if (!bytes) throw cut_off(what);
  return bytes;
}

const header_numbers = (file, bytes) => numbers_of(bytes, file.header_bytes === 8 ? "UInt64" : "UInt32", bytes.length / file.header_bytes, file.is_little);

function plain_bytes(file, source, expected, what) {
  const [size] = header_numbers(file, take(source, file.header_bytes, what));
  if (size !== expected) throw new Error(`${what} say that they have ${size} bytes, expected ${expected}: are offsets, header_type and byte_order right?`);
  return take(source, expected, what);
}

// [blocks][size of a block][size of the last if it is smaller][compressed size of each], then the blocks.
async function packed_bytes(file, source, expected, what) {
  const head = header_numbers(file, take(source, 3 * file.header_bytes, what));
  const [count, size, rest] = head, total = count && rest ? (count - 1) * size + rest : count * size;
  if (total !== expected || count > expected) {
    throw new Error(`${what} say that they have ${total} bytes, expected ${expected}: are offsets, header_type and byte_order right?`);
  }
  const packed_sizes = header_numbers(file, take(source, count * file.header_bytes, what));
  const all = new Uint8Array(expected);
  for (let i = 0; i < count; ++i) {
    const unpacked = i === count - 1 && rest ? rest : size;
    const block = await inflate(take(source, packed_sizes[i], what), unpacked);
    if (!block) throw new Error(`block ${i + 1} of ${count} of ${what} cannot be unpacked: the file is damaged`);
    all.set(block, i * size);
  }
  return all;
}

function numbers_of(bytes, type, count, is_little) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), size = SIZES[type];
  const wide = (at) => view.getUint32(at + (is_little ? 0 : 4), is_little);
  const upper = (at) => (type === "Int64" ? view.getInt32(at + (is_little ? 4 : 0), is_little) : view.getUint32(at + (is_little ? 4 : 0), is_little));
  const get = size === 8 && type !== "Float64" ? (at) => upper(at) * 2 ** 32 + wide(at)
                                               : {Int8: (at) => view.getInt8(at), UInt8: (at) => view.getUint8(at)}[type] ??
                                                 ((getter) => (at) => view[getter](at, is_little))(`get${type.replace("UInt", "Uint")}`);
  const numbers = new Float64Array(count);
  for (let i = 0; i < count; ++i) numbers[i] = get(i * size);
  return numbers;
}

// ---- Triangles

async function read_piece(file, piece, left, max_triangles) {
  const counts = Object.fromEntries(["Points", "Polys", "Strips"].map((name) => [name, number(piece, `NumberOf${name}`)]));
  for (const [name, count] of Object.entries(counts)) {
    if (count > 3 * max_triangles) throw new Error(`it says that it has ${count} ${name.toLowerCase()}; ${max_triangles} triangles are shown at most: make a coarser surface`);
  }
  const points_array = piece.querySelector(":scope > Points > DataArray");
  const components = points_array ? number(points_array, "NumberOfComponents") : 3;
  if (components !== 3) throw new Error(`its points have ${components} coordinates each, expected 3`);
  const points = await read_array(file, points_array, 3 * counts.Points, "its points");
  const bad = points.findIndex((value) => !Number.isFinite(Math.fround(value)));
  if (bad >= 0) throw new Error(`point ${Math.floor(bad / 3)} has a coordinate that is no finite number`);
  const triangles = [];
  for (const [name, cut] of [["Polys", fan], ["Strips", strip]]) {
    const cells = await read_cells(file, piece, name, counts[name], counts.Points, 3 * max_triangles);
    await each_cell(cells, (begin, end) => cut(cells.connectivity, begin, end, triangles), file.pause);
    if (triangles.length > 3 * left) throw new Error(`it has more than ${max_triangles} triangles, which is the most that is shown: make a coarser surface`);
  }
  const corners = new Float32Array(3 * triangles.length);
  for (let i = 0; i < triangles.length; ++i) {
    for (let k = 0; k < 3; ++k) corners[3 * i + k] = points[3 * triangles[i] + k];
    if (!(i & 0xffff)) await file.pause();
  }
  return corners;
}

// {connectivity, offsets}: corners of all cells one after the other, and where each cell ends.
async function read_cells(file, piece, name, count, point_count, max_corners) {
  const array = (which) => piece.querySelector(`:scope > ${name} > DataArray[Name="${which}"]`), what = (which) => `the ${which} of its ${name.toLowerCase()}`;
  const offsets = await read_array(file, array("offsets"), count, what("offsets"));
  offsets.forEach((end, i) => {
    if (!Number.isInteger(end) || end < (i ? offsets[i - 1] : 0) || end > max_corners) throw new Error(`${what("offsets")} cannot be: number ${i} is ${end}`);
  });
  const corners = count ? offsets[count - 1] : 0;
  const connectivity = await read_array(file, array("connectivity"), corners, what("connectivity"));
  const bad = connectivity.findIndex((index) => !(Number.isInteger(index) && index >= 0 && index < point_count));
  if (bad >= 0) throw new Error(`${what("connectivity")} names point ${connectivity[bad]}, and there are ${point_count}, counted from 0`);
  return {connectivity, offsets};
}

async function each_cell({offsets}, take_cell, pause) {
  let begin = 0;
  for (let i = 0; i < offsets.length; ++i) {
    take_cell(begin, offsets[i]);
    begin = offsets[i];
    if (!(i & 0x3fff)) await pause();
  }
}

function fan(corners, begin, end, triangles) {
  for (let i = begin + 1; i + 1 < end; ++i) triangles.push(corners[begin], corners[i], corners[i + 1]);
}

// Every second triangle of a strip turns the other way round.
function strip(corners, begin, end, triangles) {
  for (let i = begin; i + 2 < end; ++i) {
    const is_odd = (i - begin) % 2;
    triangles.push(corners[i], corners[i + 1 + is_odd], corners[i + 2 - is_odd]);
  }
}
