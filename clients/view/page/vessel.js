// STL, binary or ASCII, as corners with smooth normals.

const MAX_TRIANGLES = 400000;

function corners_of_binary(view) {
  const count = Math.min(view.getUint32(80, true), Math.floor((view.byteLength - 84) / 50), MAX_TRIANGLES);
  const corners = new Float32Array(9 * count);
  for (let i = 0; i < count; ++i)
    for (let k = 0; k < 9; ++k) corners[9 * i + k] = view.getFloat32(84 + 50 * i + 12 + 4 * k, true);
  return corners;
}

function corners_of_text(text) {
  const corners = [];
  for (const match of text.matchAll(/vertex\s+(\S+)\s+(\S+)\s+(\S+)/g)) {
    if (corners.length >= 9 * MAX_TRIANGLES) break;
    corners.push(+match[1], +match[2], +match[3]);
  }
  return Float32Array.from(corners);
}

// {positions, normals}: 9 numbers a triangle each. A file that begins with "solid" may be binary all the same.
export function read_stl(buffer) {
  const view = new DataView(buffer);
  const is_binary = buffer.byteLength >= 84 && 84 + 50 * view.getUint32(80, true) === buffer.byteLength;
  const positions = is_binary ? corners_of_binary(view) : corners_of_text(new TextDecoder().decode(buffer));
  return {positions, normals: smooth_normals(positions)};
}

function smooth_normals(positions) {
  const sums = new Map(), keys = [];
  for (let i = 0; i + 8 < positions.length; i += 9) {
    const [ax, ay, az, bx, by, bz, cx, cy, cz] = positions.subarray(i, i + 9);
    const u = [bx - ax, by - ay, bz - az], v = [cx - ax, cy - ay, cz - az];
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (let k = 0; k < 9; k += 3) {
      const key = `${positions[i + k].toFixed(3)},${positions[i + k + 1].toFixed(3)},${positions[i + k + 2].toFixed(3)}`;
      keys.push(key);
      const sum = sums.get(key) ?? [0, 0, 0];
      sums.set(key, [sum[0] + n[0], sum[1] + n[1], sum[2] + n[2]]);
    }
  }
  const normals = new Float32Array(positions.length);
  keys.forEach((key, i) => {
    const n = sums.get(key), l = Math.hypot(...n) || 1;
    normals.set([n[0] / l, n[1] / l, n[2] / l], 3 * i);
  });
  return normals;
}
