// The room in 3D: WebGL2, nothing else.
import {COLOURS, SIGMAS} from "./fluoroscopy.js";
import {append, bounds, empty, line, Mesh, rgb, tube} from "./mesh.js";
import {cross_mesh, POINT_COLOUR} from "./points.js";
import {add, cross, dot, from_camera, length, look_at, multiply, perspective, scale, sub, to_camera, unit, variance} from "./math.js";

// By what holds the tube there: nothing, a coil, an image alone, whose depth comes from elsewhere, both.
const BRIGHTNESS = [0.25, 1, 0.6, 1];

const FEW_POINTS = 12;  // so many have their names beside them always, more only near the pointer
const NEAR_PX = 28;

const DISTANCE = 1.75;  // of the eye, in lengths of the shape

const VERTEX = `#version 300 es
in vec3 position; in vec3 normal; in vec4 colour; in vec2 uv;
uniform mat4 view, projection;
out vec3 n, p; out vec4 c; out vec2 t;
void main() {
  vec4 q = view * vec4(position, 1.0);
  p = q.xyz; n = mat3(view) * normal; c = colour; t = uv;
  gl_Position = projection * q;
}`;

// kind 0: lit, 1: plain, 2: glass (seen where the surface turns away), 3: the fluoroscopic image, 4: the hull, a rim.
const FRAGMENT = `#version 300 es
precision mediump float;
in vec3 n, p; in vec4 c; in vec2 t;
uniform int kind; uniform sampler2D image; uniform float opacity;
out vec4 colour;
void main() {
  if (kind == 1) { colour = c; }
  else if (kind == 3) { colour = vec4(texture(image, t).rgb, opacity); }
  else {
    float facing = abs(dot(normalize(n), normalize(p)));
    if (kind == 0) colour = vec4(c.rgb * (0.35 + 0.65 * facing), c.a);
    else if (kind == 4) colour = vec4(mix(c.rgb, vec3(max(max(c.r, c.g), c.b)), 0.35), 0.2 + 0.6 * pow(1.0 - facing, 1.5));
    else colour = vec4(c.rgb, c.a * (0.25 + 0.75 * pow(1.0 - facing, 2.0)));
  }
  colour.rgb *= colour.a;
}`;

// Depth of the image plane: behind the shape, where a detector would be.
function detector_depth(camera, centre) { return to_camera(camera, centre)[2] + 160; }

function at_pixel(camera, u, v, depth) {
  return from_camera(camera, [((u - camera.c[0]) / camera.f[0]) * depth, ((v - camera.c[1]) / camera.f[1]) * depth, depth]);
}

function corners(camera, depth) {
  const w = camera.width - 0.5, h = camera.height - 0.5;
  return [[-0.5, -0.5], [w, -0.5], [w, h], [-0.5, h]].map(([u, v]) => at_pixel(camera, u, v, depth));
}

// Without a graphics card smooth edges cost most of the time.
function is_software() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const about = gl?.getExtension("WEBGL_debug_renderer_info");
  const is = /swiftshader|llvmpipe|software/i.test(about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "");
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return is;
}

export class Room {
  // Throws when the browser has no WebGL2.
  constructor(canvas, labels) {
    this.canvas = canvas;
    this.labels = labels.getContext("2d");
    const gl = this.gl = canvas.getContext("webgl2", {antialias: !is_software(), alpha: false});
    if (!gl) throw new Error("this browser has no WebGL2");
    this.program = this.make_program();
    this.uniforms = {};
    for (const name of ["view", "projection", "kind", "opacity"]) this.uniforms[name] = gl.getUniformLocation(this.program, name);
    const attributes = {};
    for (const name of ["position", "normal", "colour", "uv"]) attributes[name] = gl.getAttribLocation(this.program, name);
    for (const name of ["solid", "hull", "plane", "vessel", "points"]) this[name] = new Mesh(gl, attributes, gl.TRIANGLES);
    this.lines = new Mesh(gl, attributes, gl.LINES);
    this.texture = gl.createTexture();
    this.has_image = false;
    this.orbit = null;
    this.known_points = [];
    this.labelled = [];
    this.pointer = null;  // px of the canvas
  }

  make_program() {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || "shaders");
    return program;
  }

  set_image(bitmap) {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    this.has_image = true;
  }

  set_vessel({positions, normals}) {
    const colour = new Float32Array((positions.length / 3) * 4);
    for (let i = 0; i < colour.length; i += 4) [colour[i], colour[i + 1], colour[i + 2], colour[i + 3]] = [0.62, 0.72, 0.85, 0.3];
    this.vessel.fill({position: positions, normal: normals, colour});
  }

  // Registration points: [{name, p, touched: where it was touched, if that is known}].
  set_points(points) {
    this.known_points = points;
    this.points.fill(cross_mesh(points));
  }

  // Looks at the whole shape from `angle` degrees beside the source: 0 as the fluoroscope does, more shows depth.
  look_from(camera, points, angle = 60) {
    const {centre, extent} = bounds(points);
    const back = unit(sub(from_camera(camera, [0, 0, 0]), centre));
    const up = scale(unit(sub(from_camera(camera, [0, 1, 0]), from_camera(camera, [0, 0, 0]))), -1);
    this.orbit = {centre, back, up: unit(sub(up, scale(back, dot(up, back)))),
                  distance: Math.max(extent * DISTANCE, 120)};
    this.turn((angle * Math.PI) / 180, angle ? 0.25 : 0);
    this.is_moved = false;
  }

  // Until a person has chosen otherwise the whole shape stays in the picture.
  follow(points) {
    const {centre, extent} = bounds(points);
    this.orbit.centre = add(scale(this.orbit.centre, 0.95), scale(centre, 0.05));
    this.orbit.distance = 0.95 * this.orbit.distance + 0.05 * Math.max(extent * DISTANCE, 120);
  }

  // rad to the right and up, about the shape.
  turn(right, up) {
    const o = this.orbit;
    if (!o) return;
    const about = (v, axis, angle) =>
      add(add(scale(v, Math.cos(angle)), scale(cross(axis, v), Math.sin(angle))), scale(axis, dot(axis, v) * (1 - Math.cos(angle))));
    o.back = unit(about(o.back, o.up, right));
    const side = cross(o.up, o.back);
    o.back = unit(about(o.back, side, -up));
    o.up = unit(cross(o.back, side));
    this.is_moved = true;
  }
  zoom(factor) {
    if (!this.orbit) return;
    this.orbit.distance = Math.min(Math.max(this.orbit.distance * factor, 40), 4000);
    this.is_moved = true;
  }
  // Parts of the picture's height.
  move(right, up) {
    const o = this.orbit;
    if (!o) return;
    this.is_moved = true;
    o.centre = add(o.centre, add(scale(cross(o.up, o.back), -right * o.distance * 0.8), scale(o.up, -up * o.distance * 0.8)));
  }

  // `tubes`: [{sample, em, state, is_shown}]; `camera`: that whose plane shows the image, or null.
  draw(tubes, cameras, camera, look, ratio) {
    const shown = tubes.filter((each) => each.is_shown);
    const first = shown[0]?.sample;
    if (first) this.middle = bounds(first.points).centre;
    const centre = this.middle ?? [0, 0, 0];
    if (!this.orbit && camera && first) this.look_from(camera, first.points);
    else if (first && !this.is_moved) this.follow(first.points);
    this.marks = [];
    this.fill(shown, tubes, cameras, camera, centre, look);
    this.paint(look, camera);
    this.write(ratio, look);
  }

  fill(shown, tubes, cameras, camera, centre, look) {
    const solid = empty(), hull = empty(), lines = {position: [], colour: []};
    for (const {sample, state} of shown) {
      const colour = rgb(COLOURS[state]), colour_at = (i) => [...colour.map((value) => BRIGHTNESS[sample.held[i]] * value), 1];
      append(solid, tube(sample.points, () => sample.radius, colour_at));
      if (look.band) {
        append(hull, tube(sample.points, (i, d) => sample.radius + SIGMAS * Math.sqrt(Math.max(variance(sample.cov, 6 * i, d), 0)),
                          colour_at));
      }
    }
    for (const {sample, em, is_shown} of tubes) {
      if (em && look.em) this.add_line(solid, em.points, COLOURS.em);
      if (sample?.truth && look.truth) this.add_line(solid, sample.truth, COLOURS.truth);
      if (look.coils && sample) this.add_coils(solid, lines, sample, is_shown);
    }
    for (const each of cameras) this.add_camera(lines, each, centre, each === camera);
    this.solid.fill(solid);
    this.hull.fill(hull);
    this.lines.fill(lines);
    if (camera) this.fill_plane(camera, centre);
  }

  add_line(solid, points, colour) { append(solid, tube(points, () => 0.45, () => [...rgb(colour), 1])); }

  // A coil knows where it is and along what it lies: a short thick piece and its axis.
  add_coils(solid, lines, sample) {
    (sample.em ?? []).forEach((coil, i) => {
      if (coil.status !== 1 || coil.p[0] === null) return;
      const is_used = sample.coils[i]?.state === 1;
      const colour = [...rgb(is_used ? "#ffffff" : COLOURS.questionable), 1];
      const ends = [add(coil.p, scale(coil.t, 4)), sub(coil.p, scale(coil.t, 4))];
      append(solid, tube([...ends[0], ...ends[1]], () => 1.7, () => colour));
      line(lines, add(coil.p, scale(coil.t, 14)), sub(coil.p, scale(coil.t, 14)), colour);
      this.marks.push({p: coil.p, text: `${i + 1}`, colour: is_used ? "#fff" : COLOURS.questionable});
    });
  }

  add_camera(lines, camera, centre, is_chosen) {
    const source = from_camera(camera, [0, 0, 0]), ends = corners(camera, detector_depth(camera, centre));
    const colour = is_chosen ? [0.55, 0.62, 0.68, 1] : [0.25, 0.29, 0.33, 1];
    ends.forEach((end, i) => {
      line(lines, source, end, colour.map((c, k) => (k < 3 ? c * 0.6 : 1)));
      line(lines, end, ends[(i + 1) % 4], colour);
    });
    this.marks.push({p: source, text: `source ${camera.name}`, colour: "#8a979e"});
    this.marks.push({p: ends[3], text: `image ${camera.name}`, colour: "#8a979e"});
  }

  fill_plane(camera, centre) {
    const [a, b, c, d] = corners(camera, detector_depth(camera, centre));
    this.plane.fill({position: [...a, ...b, ...c, ...a, ...c, ...d], uv: [0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1]});
  }

  matrices() {
    const o = this.orbit ?? {centre: [0, 0, 0], back: [0, 0, 1], up: [0, 1, 0], distance: 420};
    return {view: look_at(add(o.centre, scale(o.back, o.distance)), o.centre, o.up),
            projection: perspective(0.7, this.canvas.width / this.canvas.height, 5, 8000)};
  }

  paint(look, camera) {
    const gl = this.gl, {view, projection} = this.matrices(), uniform = (name) => this.uniforms[name];
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0.02, 0.03, 0.04, 1);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(uniform("view"), false, view);
    gl.uniformMatrix4fv(uniform("projection"), false, projection);
    gl.uniform1f(uniform("opacity"), 0.75);
    const pass = (mesh, kind) => { gl.uniform1i(uniform("kind"), kind); mesh.draw(); };
    if (camera && look.image && this.has_image) pass(this.plane, 3);
    pass(this.lines, 1);
    pass(this.solid, 0);
    if (look.points) pass(this.points, 0);
    gl.depthMask(false);  // what is seen through
    pass(this.hull, 4);
    if (look.vessel) pass(this.vessel, 2);
    gl.depthMask(true);
  }

  // Place on the canvas, or null behind the eye.
  on_canvas(p, {view, projection}) {
    const m = multiply(projection, view), q = [0, 1, 2, 3].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);
    return q[3] > 0 ? [((q[0] / q[3] + 1) / 2) * this.canvas.width, ((1 - q[1] / q[3]) / 2) * this.canvas.height] : null;
  }

  write(ratio, look) {
    const context = this.labels, matrices = this.matrices();
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.font = `${12 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
    context.lineWidth = 3 * ratio;
    context.strokeStyle = "#000";
    const text = (words, x, y, colour) => {
      context.strokeText(words, x, y);
      context.fillStyle = colour;
      context.fillText(words, x, y);
    };
    for (const mark of this.marks) {
      const place = this.on_canvas(mark.p, matrices);
      if (place) text(mark.text, place[0] + 8 * ratio, place[1] - 7 * ratio, mark.colour);
    }
    this.labelled = look.points ? this.named_points(matrices, ratio) : [];
    for (const {words, place} of this.labelled) text(words, place[0] + 8 * ratio, place[1] + 14 * ratio, POINT_COLOUR);
    this.write_axes(context, matrices.view, ratio, text);
  }

  // Those whose names are written: all of a few, of many those near the pointer.
  named_points(matrices, ratio) {
    const named = [];
    for (const {name, p, touched} of this.known_points) {
      const place = this.on_canvas(p, matrices);
      const is_near = place && this.pointer && Math.hypot(place[0] - this.pointer[0], place[1] - this.pointer[1]) < NEAR_PX * ratio;
      if (!place || !(is_near || this.known_points.length <= FEW_POINTS)) continue;
      named.push({name, words: touched ? `${name}, ${length(sub(touched, p)).toFixed(1)} mm` : name, place});
    }
    return named;
  }

  // The world's directions and how long 10 mm are at the middle.
  write_axes(context, view, ratio, text) {
    const x0 = this.canvas.width - 46 * ratio, y0 = this.canvas.height - 46 * ratio;
    ["x", "y", "z"].forEach((name, axis) => {
      const x = x0 + view[4 * axis] * 30 * ratio, y = y0 - view[4 * axis + 1] * 30 * ratio;
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x, y);
      context.strokeStyle = ["#ff8f80", "#8fdc8f", "#86b6ff"][axis];
      context.lineWidth = 2 * ratio;
      context.stroke();
      context.lineWidth = 3 * ratio;
      context.strokeStyle = "#000";
      text(name, x + 3 * ratio, y + 4 * ratio, ["#ff8f80", "#8fdc8f", "#86b6ff"][axis]);
    });
    const distance = this.orbit?.distance ?? 420;
    const px = (10 / distance) * (this.canvas.height / (2 * Math.tan(0.35)));
    context.fillStyle = "#cfd8dc";
    context.fillRect(this.canvas.width - 100 * ratio - px, this.canvas.height - 18 * ratio, px, 3 * ratio);
    text("10 mm", this.canvas.width - 100 * ratio - px, this.canvas.height - 24 * ratio, "#cfd8dc");
  }
}

// Mouse, touch and wheel; `changed` is called when something moved.
export function steer(canvas, room, changed) {
  const touches = new Map();
  let spread = 0;
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, [event.clientX, event.clientY]);
    spread = 0;
  });
  const end = (event) => { touches.delete(event.pointerId); spread = 0; };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", () => { room.pointer = null; changed(); });
  canvas.addEventListener("pointermove", (event) => {
    room.pointer = [event.offsetX, event.offsetY].map((px) => (px * canvas.width) / canvas.clientWidth);
    const before = touches.get(event.pointerId);
    if (!before) return room.known_points.length ? changed() : undefined;
    const dx = event.clientX - before[0], dy = event.clientY - before[1], height = canvas.clientHeight;
    touches.set(event.pointerId, [event.clientX, event.clientY]);
    if (touches.size === 2) {
      const [a, b] = [...touches.values()], now = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (spread) room.zoom(spread / now);
      spread = now;
      room.move(dx / height / 2, -dy / height / 2);
    } else if (event.buttons === 2 || event.shiftKey) {
      room.move(dx / height, -dy / height);
    } else {
      room.turn((-dx / height) * 3, (dy / height) * 3);
    }
    changed();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    room.zoom(Math.exp(event.deltaY * 0.001));
    changed();
  }, {passive: false});
}
