// Triangles and lines of what the room shows.
import {add, frames, length, point, scale, sub, unit} from "./math.js";

const SIDES = 12;
const TURNS = Array.from({length: SIDES}, (_, k) => [Math.cos((2 * Math.PI * k) / SIDES), Math.sin((2 * Math.PI * k) / SIDES)]);

// A mesh of triangles or lines that is filled anew with every sample.
export class Mesh {
  constructor(gl, attributes, mode) {
    this.gl = gl;
    this.mode = mode;
    this.count = 0;
    this.array = gl.createVertexArray();
    this.buffers = {};
    gl.bindVertexArray(this.array);
    for (const [name, size] of [["position", 3], ["normal", 3], ["colour", 4], ["uv", 2]]) {
      this.buffers[name] = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      gl.vertexAttribPointer(attributes[name], size, gl.FLOAT, false, 0, 0);
    }
    this.indices = gl.createBuffer();
    this.attributes = attributes;
  }

  // Flat lists of numbers; what is left out is zero.
  fill({position, normal, colour, uv, indices}) {
    const gl = this.gl;
    gl.bindVertexArray(this.array);
    for (const [name, data] of Object.entries({position, normal, colour, uv})) {
      if (!data) { gl.disableVertexAttribArray(this.attributes[name]); continue; }
      gl.enableVertexAttribArray(this.attributes[name]);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, data instanceof Float32Array ? data : new Float32Array(data), gl.DYNAMIC_DRAW);
    }
    if (indices) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(indices), gl.DYNAMIC_DRAW);
    }
    this.count = indices ? indices.length : position.length / 3;
    this.is_indexed = Boolean(indices);
  }

  draw() {
    if (!this.count) return;
    this.gl.bindVertexArray(this.array);
    if (this.is_indexed) this.gl.drawElements(this.mode, this.count, this.gl.UNSIGNED_INT, 0);
    else this.gl.drawArrays(this.mode, 0, this.count);
  }
}

export const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);

// A tube along points whose radius may differ with the direction, `radius(i, direction)`; `colour_at(i)`: r, g, b, a.
export function tube(points, radius, colour_at) {
  const n = points.length / 3, across = frames(points), mesh = empty();
  for (let i = 0; i < n; ++i) {
    const p = point(points, i), {u, v} = across[i], colour = colour_at(i);
    for (let k = 0; k < SIDES; ++k) {
      const [cosine, sine] = TURNS[k];
      const d = [u[0] * cosine + v[0] * sine, u[1] * cosine + v[1] * sine, u[2] * cosine + v[2] * sine], r = radius(i, d);
      mesh.position.push(p[0] + r * d[0], p[1] + r * d[1], p[2] + r * d[2]);
      mesh.normal.push(d[0], d[1], d[2]);
      mesh.colour.push(colour[0], colour[1], colour[2], colour[3]);
      if (i + 1 < n) {
        const a = SIDES * i + k, b = SIDES * i + ((k + 1) % SIDES);
        mesh.indices.push(a, b, a + SIDES, b, b + SIDES, a + SIDES);
      }
    }
  }
  cap(mesh, point(points, 0), 0, colour_at(0));
  cap(mesh, point(points, n - 1), SIDES * (n - 1), colour_at(n - 1));
  return mesh;
}

function cap(mesh, centre, first, colour) {
  const middle = mesh.position.length / 3;
  mesh.position.push(...centre);
  mesh.normal.push(...unit(sub(centre, mesh.position.slice(3 * first, 3 * first + 3))));
  mesh.colour.push(...colour);
  for (let k = 0; k < SIDES; ++k) mesh.indices.push(middle, first + k, first + ((k + 1) % SIDES));
}

export function append(mesh, other) {
  const first = mesh.position.length / 3;
  for (const name of ["position", "normal", "colour"]) for (const value of other[name]) mesh[name].push(value);
  for (const index of other.indices) mesh.indices.push(first + index);
}

export const empty = () => ({position: [], normal: [], colour: [], indices: []});

export function line(lines, a, b, colour) {
  lines.position.push(...a, ...b);
  lines.colour.push(...colour, ...colour);
}

export function bounds(points) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  points.forEach((value, i) => { low[i % 3] = Math.min(low[i % 3], value); high[i % 3] = Math.max(high[i % 3], value); });
  return {centre: scale(add(low, high), 0.5), extent: length(sub(high, low))};
}
