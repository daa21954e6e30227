// The vessel's surface out of a file, as corners with smooth normals.
import {read_vtp} from "./vtp.js";

export const MAX_TRIANGLES = 400000;
const WORK_MS = 12;         // without a pause: the page has shapes to show meanwhile
const SAME_PLACE = 1000;    // corners that agree in 1/1000 mm are one

// Awaited, it lets the page go on when it is time to.
function make_pause() {
  let since = performance.now();
  return async () => {
    if (performance.now() - since < WORK_MS) return;
    await new Promise((go_on) => { setTimeout(go_on); });
    since = performance.now();
  };
}

// {positions, normals}: 9 numbers a triangle each; axes: "LPS", "RAS" or "" as the file says. `kind`: "stl" or "vtp". Throws Error with
// words for a person.
export async function read_vessel(buffer, kind) {
  const pause = make_pause();
  const {positions, axes} = await (kind === "vtp" ? read_vtp(new Uint8Array(buffer), MAX_TRIANGLES, pause) : read_stl(buffer, pause));
  if (!positions.length) throw new Error("it has no triangle");
  return {positions, normals: await smooth_normals(positions, pause), axes};
}

// ---- STL, binary or ASCII

async function read_stl(buffer, pause) {
  const head = new TextDecoder("latin1").decode(buffer.slice(0, 256)), count = buffer.byteLength >= 84 ? new DataView(buffer).getUint32(80, true) : 0;
  // A file that begins with "solid" may be binary all the same.
  const is_text = buffer.byteLength !== 84 + 50 * count && /^\s*solid/i.test(head);
  const positions = await (is_text ? corners_of_text(new TextDecoder("latin1").decode(buffer), pause) : corners_of_binary(new DataView(buffer), count, pause));
  const bad = positions.findIndex((value) => !Number.isFinite(value));
  if (bad >= 0) throw new Error(`triangle ${Math.floor(bad / 9) + 1} has a coordinate that is no finite number`);
  return {positions, axes: /SPACE=(LPS|RAS)/.exec(head)?.[1] ?? ""};
}

const too_many = (count) => new Error(`it has ${count} triangles, and ${MAX_TRIANGLES} are shown at most: make a coarser surface`);

async function corners_of_binary(view, count, pause) {
  if (84 + 50 * count > view.byteLength) throw new Error(`it says that it has ${count} triangles and ends too early: was it cut off while it was written?`);
  if (count > MAX_TRIANGLES) throw too_many(count);
  const corners = new Float32Array(9 * count);
  for (let i = 0; i < count; ++i) {
    for (let k = 0; k < 9; ++k) corners[9 * i + k] = view.getFloat32(84 + 50 * i + 12 + 4 * k, true);
    if (!(i & 0x3fff)) await pause();
  }
  return corners;
}

async function corners_of_text(text, pause) {
  const corners = [];
  for (const match of text.matchAll(/vertex\s{1,9}(\S{1,40})\s{1,9}(\S{1,40})\s{1,9}(\S{1,40})/g)) {
    if (corners.push(+match[1], +match[2], +match[3]) > 9 * MAX_TRIANGLES) throw too_many(`more than ${MAX_TRIANGLES}`);
    if (!(corners.length % 30000)) await pause();
  }
  if (corners.length % 9 || !/endsolid/.test(text.slice(-300))) throw new Error("it has no endsolid, or a triangle without three corners: was it cut off while it was written?");
  return Float32Array.from(corners);
}

// ---- Normals

// Of each place the sum of the normals of its triangles, which are as long as these are large.
async function smooth_normals(positions, pause) {
  const {place_of, count} = await places_of(positions, pause), sums = new Float32Array(3 * count);
  for (let i = 0; i < positions.length; i += 9) {
    const [ax, ay, az, bx, by, bz, cx, cy, cz] = positions.subarray(i, i + 9);
    const u = [bx - ax, by - ay, bz - az], v = [cx - ax, cy - ay, cz - az];
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (let k = 0; k < 3; ++k) for (let axis = 0; axis < 3; ++axis) sums[3 * place_of[i / 3 + k] + axis] += n[axis];
    if (!(i % 90000)) await pause();
  }
  const normals = new Float32Array(positions.length);
  for (let i = 0; i < place_of.length; ++i) {
    const at = 3 * place_of[i], l = Math.hypot(sums[at], sums[at + 1], sums[at + 2]) || 1;
    for (let axis = 0; axis < 3; ++axis) normals[3 * i + axis] = sums[at + axis] / l;
    if (!(i & 0xffff)) await pause();
  }
  return normals;
}

// Which place each corner is at, and how many places there are: a hash table with open addressing.
async function places_of(positions, pause) {
  const corners = positions.length / 3, mask = 2 ** Math.ceil(Math.log2(2 * corners + 1)) - 1;
  const table = new Int32Array(mask + 1).fill(-1), first = new Int32Array(corners), place_of = new Int32Array(corners);
  const mixed = (hash) => { const h = Math.imul(hash ^ (hash >>> 15), 0x2c1b3c6d); return h ^ (h >>> 13); };
  const at = (corner, axis) => Math.round(SAME_PLACE * positions[3 * corner + axis]);
  const is_same = (a, b) => at(a, 0) === at(b, 0) && at(a, 1) === at(b, 1) && at(a, 2) === at(b, 2);
  let count = 0;
  for (let i = 0; i < corners; ++i) {
    let slot = mixed(Math.imul(at(i, 0), 73856093) ^ Math.imul(at(i, 1), 19349663) ^ Math.imul(at(i, 2), 83492791)) & mask;
    while (table[slot] >= 0 && !is_same(first[table[slot]], i)) slot = (slot + 1) & mask;
    if (table[slot] < 0) { first[count] = i; table[slot] = count++; }
    place_of[i] = table[slot];
    if (!(i & 0x3fff)) await pause();
  }
  return {place_of, count};
}
