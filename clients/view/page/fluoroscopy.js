// The fluoroscopic image and, over it, the tube of the same exposure.
import {add, length, point, point_at, project, scale, sub, to_camera, variance} from "./math.js";

export const COLOURS = {valid: "#19e0cc", questionable: "#ffb000", em: "#d79bff", truth: "#ffffff", band: {valid: "25,224,204", questionable: "255,176,0"}};
const MIN_RADIUS = 6;  // of a tube that has its centreline drawn, px of the page
export const SIGMAS = 2;  // half width of the band and of the hull

// Where an image lies on a canvas: as large as it fits, in the middle.
export function fit(canvas, width, height) {
  const k = Math.min(canvas.width / width, canvas.height / height);
  return {k, x: (canvas.width - k * width) / 2, y: (canvas.height - k * height) / 2};
}

// The centre of the first pixel is (0, 0) of the image.
const to_canvas = (place, p) => [place.x + (p[0] + 0.5) * place.k, place.y + (p[1] + 0.5) * place.k];

// The projected centreline with what lies across it, tip first: p on the canvas, n the unit normal there, r half the tube's
// width and s one sigma along n, all in canvas pixels. Points behind the source are left out.
export function projected_tube(sample, camera, place) {
  const points = sample.points, cov = sample.cov, n = points.length / 3, line = [];
  for (let i = 0; i < n; ++i) {
    const p = point(points, i), image = project(camera, p);
    if (image) line.push({i, world: p, image, p: to_canvas(place, image), is_held: sample.held[i] !== 0});
  }
  for (let i = 0; i < line.length; ++i) {
    const a = line[Math.max(i - 1, 0)].p, b = line[Math.min(i + 1, line.length - 1)].p;
    const d = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
    const here = line[i], depth = to_camera(camera, here.world)[2];
    here.n = [-(b[1] - a[1]) / d, (b[0] - a[0]) / d];
    here.r = (sample.radius * camera.f[0] / depth) * place.k;
    here.s = sigma_across(camera, here, cov) * place.k;
  }
  return line;
}

// One sigma along the normal, px of the image: the normal carried back to the world by finite differences.
function sigma_across(camera, here, cov) {
  const gradient = [0, 1, 2].map((axis) => {
    const step = [0, 0, 0];
    step[axis] = 0.5;
    const a = project(camera, sub(here.world, step)), b = project(camera, add(here.world, step));
    return a && b ? (b[0] - a[0]) * here.n[0] + (b[1] - a[1]) * here.n[1] : 0;
  });
  return Math.sqrt(Math.max(variance(cov, 6 * here.i, gradient), 0));
}

function path(context, line) {
  context.beginPath();
  line.forEach(({p}, i) => (i ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
}

// To both sides at the distance `of` a place.
function ribbon(context, line, of) {
  context.beginPath();
  const side = (here, k) => [here.p[0] + k * of(here) * here.n[0], here.p[1] + k * of(here) * here.n[1]];
  line.forEach((here, i) => (i ? context.lineTo(...side(here, 1)) : context.moveTo(...side(here, 1))));
  for (let i = line.length - 1; i >= 0; --i) context.lineTo(...side(line[i], -1));
  context.closePath();
}

// Stretches that something holds, and those between them that nothing does; neighbours share a point.
export function runs(line) {
  const found = [];
  for (const here of line) {
    const last = found.at(-1);
    if (last?.is_held === here.is_held) last.line.push(here);
    else found.push({is_held: here.is_held, line: last ? [last.line.at(-1), here] : [here]});
  }
  return found;
}

// The tube's outline, open at its ends.
function sides(context, line) {
  context.beginPath();
  for (const k of [1, -1]) {
    line.forEach((here, i) => context[i ? "lineTo" : "moveTo"](here.p[0] + k * here.r * here.n[0], here.p[1] + k * here.r * here.n[1]));
  }
}

function draw_tube(context, line, look, state, ratio) {
  if (line.length < 2) return;
  if (look.band) {
    ribbon(context, line, (here) => here.r + SIGMAS * here.s);
    context.fillStyle = `rgba(${COLOURS.band[state]},.22)`;
    context.fill();
  }
  context.strokeStyle = COLOURS[state];
  for (const run of runs(line)) {
    context.setLineDash(!run.is_held ? [1.5 * ratio, 5 * ratio] : state === "questionable" ? [8 * ratio, 5 * ratio] : []);
    sides(context, run.line);
    context.lineWidth = 1.3 * ratio;
    context.stroke();
    if (line[0].r <= MIN_RADIUS * ratio) continue;  // it would hide the catheter
    path(context, run.line);
    context.lineWidth = ratio;
    context.stroke();
  }
  context.setLineDash([]);
  const tip = line[0].p;
  context.beginPath();
  context.arc(tip[0], tip[1], 3.5 * ratio, 0, 2 * Math.PI);
  context.fillStyle = COLOURS[state];
  if (line[0].is_held) context.fill();
  else context.stroke();
}

function draw_em(context, line, ratio) {
  if (line.length < 2) return;
  path(context, line);
  context.strokeStyle = COLOURS.em;
  context.lineWidth = 1.6 * ratio;
  context.setLineDash([3 * ratio, 5 * ratio]);
  context.stroke();
  context.setLineDash([]);
}

// `truth`: 3 numbers a point, tip first, as a simulated recording has it.
function draw_truth(context, truth, camera, place, ratio) {
  context.beginPath();
  let is_first = true;
  for (let i = 0; 3 * i < truth.length; ++i) {
    const image = project(camera, point(truth, i));
    if (image) context[is_first ? "moveTo" : "lineTo"](...to_canvas(place, image));
    is_first = is_first && !image;
  }
  context.strokeStyle = COLOURS.truth;
  context.lineWidth = 0.8 * ratio;
  context.stroke();
}

// The coils where they were measured, and a line to where the shape has them.
function draw_coils(context, sample, camera, place, ratio, is_shape) {
  (sample.em ?? []).forEach((coil, i) => {
    if (coil.status !== 1 || coil.p[0] === null) return;
    const about = sample.coils[i], image = project(camera, coil.p);
    if (!image) return;
    const [x, y] = to_canvas(place, image), is_used = about?.state === 1;
    const on_tube = about && is_shape ? project(camera, point_at(sample, about.s)) : null;
    context.strokeStyle = context.fillStyle = is_used ? "#fff" : COLOURS.questionable;
    context.lineWidth = 1.5 * ratio;
    if (on_tube) {
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(...to_canvas(place, on_tube));
      context.stroke();
    }
    context.beginPath();
    if (is_used) context.arc(x, y, 4.5 * ratio, 0, 2 * Math.PI);
    else for (const d of [1, -1]) { context.moveTo(x - 6 * ratio, y - 6 * d * ratio); context.lineTo(x + 6 * ratio, y + 6 * d * ratio); }
    context.stroke();
    context.font = `${12 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
    context.lineWidth = 3 * ratio;
    context.strokeStyle = "#000";
    context.strokeText(i + 1, x + 8 * ratio, y - 6 * ratio);
    context.fillText(i + 1, x + 8 * ratio, y - 6 * ratio);
  });
}

// `picture`: {bitmap, opacity} or null; `tubes`: [{sample, em, state, is_shown}] of this exposure. Returns what was drawn of
// the first tube: {place, line}, for whoever checks it.
export function draw_fluoroscopy(canvas, camera, picture, tubes, look, ratio) {
  const context = canvas.getContext("2d", {alpha: false});
  context.fillStyle = "#000";
  context.fillRect(0, 0, canvas.width, canvas.height);
  if (!camera) return null;
  const place = fit(canvas, camera.width, camera.height);
  context.strokeStyle = "#2a3238";
  context.lineWidth = ratio;
  context.strokeRect(place.x, place.y, place.k * camera.width, place.k * camera.height);
  if (picture && look.image) {
    context.globalAlpha = picture.opacity;
    context.drawImage(picture.bitmap, place.x, place.y, place.k * camera.width, place.k * camera.height);
    context.globalAlpha = 1;
  }
  context.save();
  context.beginPath();
  context.rect(place.x, place.y, place.k * camera.width, place.k * camera.height);
  context.clip();
  let drawn = null;
  for (const tube of tubes) {
    if (tube.sample?.truth && look.truth) draw_truth(context, tube.sample.truth, camera, place, ratio);
    if (tube.em && look.em) draw_em(context, projected_tube(tube.em, camera, place), ratio);
    if (tube.is_shown) {
      const line = projected_tube(tube.sample, camera, place);
      draw_tube(context, line, look, tube.state, ratio);
      drawn ??= {place, line: line.map(({image}) => image), sample: tube.sample};
    }
    if (look.coils && tube.sample) draw_coils(context, tube.sample, camera, place, ratio, tube.is_shown);
  }
  context.restore();
  return drawn ?? {place, line: []};
}

// The longest half axis of the covariance of a point: power iteration, enough for a figure.
export function largest_sigma(cov, i) {
  let v = [1, 1, 1];
  const C = (w) => [cov[i] * w[0] + cov[i + 1] * w[1] + cov[i + 2] * w[2], cov[i + 1] * w[0] + cov[i + 3] * w[1] + cov[i + 4] * w[2],
                    cov[i + 2] * w[0] + cov[i + 4] * w[1] + cov[i + 5] * w[2]];
  for (let k = 0; k < 6; ++k) { const w = C(v); v = scale(w, 1 / (length(w) || 1)); }
  return Math.sqrt(Math.max(variance(cov, i, v), 0));
}
