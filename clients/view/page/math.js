// Vectors, 4 x 4 matrices (column by column, as WebGL has them), the pinhole camera, and frames along a curve.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, k) => [a[0] * k, a[1] * k, a[2] * k];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const unit = (a) => scale(a, 1 / (length(a) || 1));

export function multiply(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r)
      for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

export function perspective(fov_rad, aspect, near, far) {
  const f = 1 / Math.tan(fov_rad / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0,
                           (2 * far * near) / (near - far), 0]);
}

export function look_at(eye, target, up) {
  const z = unit(sub(eye, target)), x = unit(cross(up, z)), y = cross(z, x);
  return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0,
                           -dot(x, eye), -dot(y, eye), -dot(z, eye), 1]);
}

// Of a camera of the room: T_camera_world row by row, f and c in px, distortion k1 k2 p1 p2 k3.
export const to_camera = (camera, p) => {
  const T = camera.T_camera_world;
  return [0, 4, 8].map((r) => T[r] * p[0] + T[r + 1] * p[1] + T[r + 2] * p[2] + T[r + 3]);
};

// Back from the camera's frame to the world's: the rotation is orthonormal.
export function from_camera(camera, p) {
  const T = camera.T_camera_world, q = [p[0] - T[3], p[1] - T[7], p[2] - T[11]];
  return [0, 1, 2].map((c) => T[c] * q[0] + T[4 + c] * q[1] + T[8 + c] * q[2]);
}

// The pose of an image's view (q: w x y z, t in mm) as T_camera_world; null where it is none.
export function view_of_image({f, c, q, t}) {
  const n = Math.hypot(...q), [w, x, y, z] = q.map((value) => value / n);
  const T = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), t[0],
             2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), t[1],
             2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), t[2], 0, 0, 0, 1];
  return [...T, ...f, ...c].every(Number.isFinite) ? {f, c, T_camera_world: T} : null;
}

// `camera` of the room as it stood for an image: `view` of an estimate or of the image, or nothing.
export const as_seen = (camera, view) => (view ? {...camera, f: view.f, c: view.c, T_camera_world: view.T_camera_world} : camera);

// px, the centre of the first pixel is (0, 0); null behind the source.
export function project(camera, p) {
  const [X, Y, Z] = to_camera(camera, p);
  if (!(Z > 0)) return null;
  const x = X / Z, y = Y / Z, r2 = x * x + y * y, [k1, k2, p1, p2, k3] = camera.distortion;
  const radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return [camera.f[0] * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + camera.c[0],
          camera.f[1] * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + camera.c[1]];
}

// v^T C v of a covariance xx xy xz yy yz zz that begins at `i`.
export const variance = (C, i, v) =>
  C[i] * v[0] * v[0] + C[i + 3] * v[1] * v[1] + C[i + 5] * v[2] * v[2] +
  2 * (C[i + 1] * v[0] * v[1] + C[i + 2] * v[0] * v[2] + C[i + 4] * v[1] * v[2]);

export const point = (points, i) => [points[3 * i], points[3 * i + 1], points[3 * i + 2]];

// The point at arc length s of a sample, points uniform from 0 to its length.
export function point_at(sample, s) {
  const last = sample.points.length / 3 - 1;
  const u = Math.min(Math.max((s / sample.length) * last, 0), last), i = Math.min(Math.floor(u), last - 1);
  return add(scale(point(sample.points, i), i + 1 - u), scale(point(sample.points, i + 1), u - i));
}

// At each point two unit vectors across the curve that turn as little as they can (parallel transport).
export function frames(points) {
  const n = points.length / 3, result = [];
  let normal = null;
  for (let i = 0; i < n; ++i) {
    const t = unit(sub(point(points, Math.min(i + 1, n - 1)), point(points, Math.max(i - 1, 0))));
    if (!normal) normal = Math.abs(t[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
    normal = unit(sub(normal, scale(t, dot(normal, t))));
    result.push({t, u: normal, v: cross(t, normal)});
  }
  return result;
}
