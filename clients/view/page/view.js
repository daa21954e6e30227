// The page: what came, what is shown of it, and when it is too old to be shown.
import {COLOURS, draw_fluoroscopy, largest_sigma, SIGMAS} from "./fluoroscopy.js";
import {make_legend} from "./legend.js";
import {as_seen, point, view_of_image} from "./math.js";
import {Room, steer} from "./room3d.js";
import {companion_of, is_companion, ORIGINS, SILENCE_MS, state_of, worst} from "./state.js";
import {Stream} from "./stream.js";
import {Strips} from "./strips.js";
import {Surroundings} from "./surroundings.js";
import {RECORDING_KEYS, TimeLine} from "./timeline.js";
import {Watchdog} from "./watchdog.js";

const LOOK_MS = 25;          // how often the page asks itself whether what it shows is too old
const KEPT = 45;             // samples of an instrument: those of an image's exposure are found among them
const SAME_INSTANT_MS = 17;  // half of a slot
const LIVE_IMAGE_MS = 500;
const STRIPS_MS = 150;

const $ = (id) => document.getElementById(id);
const ratio = () => window.devicePixelRatio || 1;

const newest = new Map();   // instrument: sample
const history = new Map();  // instrument: samples, newest last
const images = new Map();   // camera: {head, bitmap}
let modes = new Map();      // instrument: mode of the estimator
let known = {instruments: [], cameras: [], stages: {}, demo: [], images: [], vessel: null, points: []};
let chosen = {instrument: null, camera: null};
let is_connected = false, is_dirty = true, strips_at = 0, room = null, surroundings = null, drawn = null;
let shown = {word: "", why: "", class: "none", is_silent: true};
const look = {image: true, band: true, coils: true, em: true, vessel: true, points: true, truth: true};
const counts = {estimates: 0, paints: 0, images: 0, states: [], ages: []};  // ages: publishing to paint, ms, on one host
const strips = new Strips($("strips"));
const time_line = new TimeLine($("strips"), $("demo"), (wish) => stream.wish(wish));  // of a recording; else it knows nothing

const stream = new Stream({
  room: take_room,
  estimate: take_estimate,
  image: take_image,
  timeline: (message) => { time_line.take(message); judge(); },
  position: (message) => time_line.take_position(message),
  connection: (is_open) => { is_connected = is_open; judge(); },
});

// ---- What comes

function take_room(message) {
  const of_buttons = () => JSON.stringify([known.instruments, known.cameras, known.demo, known.vessel, known.points.length]);
  const was = of_buttons();
  known = message;
  modes = new Map(message.instruments.map(({id, mode}) => [id, mode]));
  surroundings?.take(message);
  if (of_buttons() !== was) make_buttons();
  is_dirty = true;
}

// A camera as it stood for the image that is shown, which says so itself; without images, for the newest that the shape used.
const view_of = (sample, name) => sample?.views.find((view) => known.instruments.find(({id}) => id === sample.instrument)?.cameras[view.camera] === name);
function seen_by(camera, sample) {
  const shown_image = images.get(camera.name)?.bitmap_at;
  return as_seen(camera, shown_image ? shown_image.view && view_of_image(shown_image.view) : view_of(sample, camera.name));
}

function take_estimate(sample) {
  if (stream.age(sample.received) > SILENCE_MS) return stream.seen(sample.n);  // it lay somewhere: no shape any more
  const before = newest.get(sample.instrument);
  if (!before) setTimeout(make_buttons);
  newest.set(sample.instrument, sample);
  const kept = history.get(sample.instrument) ?? [];
  history.set(sample.instrument, kept);
  kept.push(sample);
  if (kept.length > KEPT) kept.shift();
  ++counts.estimates;
  strips.add(sample.instrument, row_of(sample));
  unseen.push(sample);
  is_dirty = true;
  judge();
}

function row_of(sample) {
  const residuals = sample.coils.filter(({state, mm}) => state === 1 && mm !== null).map(({mm}) => mm);
  let sigma = 0;
  for (let i = 0; i < sample.cov.length; i += 48) sigma = Math.max(sigma, largest_sigma(sample.cov, i));
  return {at: performance.now(), validity: sample.validity, latency: sample.latency, sigma: sample.cov.length ? sigma : null,
          residual: residuals.length ? Math.max(...residuals) : null};
}

async function take_image(head, jpeg) {
  try {
    const before = images.get(head.camera);
    const bitmap = head.on ? await createImageBitmap(new Blob([jpeg], {type: "image/jpeg"})) : before?.bitmap ?? null;
    if (head.on && before?.bitmap) before.bitmap.close();
    images.set(head.camera, {head, bitmap, bitmap_at: head.on ? head : before?.bitmap_at, is_new: head.on});
    ++counts.images;
    is_dirty = true;
  } finally {
    stream.seen(head.n);
  }
}

// ---- What is chosen

const main_instruments = () => [...newest.keys()].filter((id) => !is_companion(id, modes)).sort();
const camera_named = (name) => known.cameras.find((camera) => camera.name === name);
const instrument = () => (newest.has(chosen.instrument) ? chosen.instrument : main_instruments()[0]);
const camera = () => camera_named(chosen.camera) ?? known.cameras[0] ?? null;
const label_of = (id) => known.instruments.find((each) => each.id === id)?.id ?? id;

function button(words, action, is_pressed) {
  const element = document.createElement("button");
  element.type = "button";
  element.textContent = words;
  if (is_pressed !== undefined) element.setAttribute("aria-pressed", is_pressed);
  element.addEventListener("click", () => { action(); make_buttons(); is_dirty = true; });
  return element;
}

const SWITCHES = [["image", "Image", "i"], ["band", `${SIGMAS} sigma`, "u"], ["coils", "Coils", "c"], ["em", "Coils alone", "e"],
                  ["vessel", "Vessel", "v"], ["points", "Points", "p"], ["truth", "Truth", "t"]];

function make_buttons() {
  const instruments = main_instruments();
  $("instruments").replaceChildren(...instruments.map((id) => {
    const element = button(label_of(id), () => { chosen.instrument = id; }, id === instrument());
    element.dataset.id = id;
    element.className = state_of_instrument(id).class;
    return element;
  }));
  $("cameras").replaceChildren(...(known.cameras.length > 1 ? known.cameras : []).map(({name}) =>
    button(`View ${name}`, () => { chosen.camera = name; room && (room.has_image = false); }, name === camera().name)));
  $("views").replaceChildren(button("As the fluoroscope", () => look_from(0)), button("From the side", () => look_from(90)),
                             button("Oblique", () => look_from(60)));
  $("switches").replaceChildren(...SWITCHES.filter(([name]) => is_there(name)).map(([name, words]) =>
    button(words, () => { look[name] = !look[name]; }, look[name])), button("Dim", dim, document.body.classList.contains("dim")),
    button("Help", () => $("help").showModal()));
  if (!time_line.known) $("demo").replaceChildren(...known.demo.map(({name, label}) => button(label, () => stream.press(name))));
  const is_seen = (name) => look[name] && is_there(name);
  make_legend($("legend"), {band: look.band, coils: look.coils, em: is_seen("em"), truth: is_seen("truth"), points: is_seen("points"),
                            touched: is_seen("points") && known.points.some(({touched}) => touched)});
}

const has_em = () => instrument() !== undefined && companion_of(instrument(), modes) !== null;
const has_truth = () => Boolean(newest.get(instrument())?.truth);
const is_there = (name) => ({vessel: Boolean(known.vessel), points: known.points.length > 0, em: has_em(), truth: has_truth()})[name] ?? true;
const dim = () => document.body.classList.toggle("dim");

function look_from(angle) {
  const sample = newest.get(instrument());
  if (room && camera() && sample?.points.length) room.look_from(seen_by(camera(), sample), sample.points, angle);
}

// ---- May it be believed?

const watchdog = new Watchdog(document.querySelectorAll(".cover"), SILENCE_MS);

const age_of = (id) => (newest.has(id) ? stream.age(newest.get(id).received) : Infinity);
const state_of_instrument = (id) => state_of(newest.get(id) ?? null, age_of(id), is_connected, Boolean(time_line.known));

function judge() {
  const ids = main_instruments();
  const all = ids.length ? ids.map((id) => ({id, state: state_of_instrument(id)})) : [{id: null, state: state_of_instrument(null)}];
  const chief = worst(all), own = state_of_instrument(instrument());
  const state = {
    class: chief.state.class, word: chief.state.word, is_silent: own.is_silent,
    why: all.filter(({state: {reasons}}) => reasons.length)
      .map((each) => (ids.length > 1 && each.id ? `${each.id}: ` : "") + each.state.reasons.join("; ")).join(" | "),
  };
  watchdog.feed();
  const is_other = state.class !== shown.class || state.is_silent !== shown.is_silent;
  const has_other_words = state.word !== shown.word || state.why !== shown.why;
  if (!is_other && !has_other_words) return;
  if (is_other || !state.is_silent) note(state);
  show(state, all);
  if (is_other) draw();  // at once: the next frame may be long in coming
}

function note(state) {
  counts.states.push({at: performance.now(), wall: Date.now(), class: state.class, word: state.word, why: state.why});
  if (counts.states.length > 500) counts.states.shift();
}

function show(state, all) {
  document.body.className = [state.class, state.is_silent ? "silent" : "", document.body.classList.contains("dim") ? "dim" : ""].join(" ");
  $("word").textContent = state.word;
  $("why").textContent = state.why || "nothing contradicts this shape";
  document.title = `${state.word} - tubed`;
  for (const each of all) {
    const element = [...$("instruments").children].find(({dataset}) => dataset.id === each.id);
    if (element) element.className = each.state.class;
  }
  shown = state;
}

// ---- Drawing

const unseen = [];

function size(canvas) {
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio())), height = Math.max(1, Math.round(canvas.clientHeight * ratio()));
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
}

// All instruments that are not only companions, the chosen one first; `pick` finds the sample.
function tubes(pick) {
  const ids = main_instruments(), own = instrument();
  return ids.sort((a, b) => (b === own) - (a === own)).map((id) => {
    const state = state_of_instrument(id), other = companion_of(id, modes);
    const em = other && state_of_instrument(other).is_shown ? pick(other) : null;
    const sample = state.is_silent ? null : pick(id);
    return {sample, em: em?.points.length ? em : null, state: state.class, is_shown: state.is_shown && Boolean(sample?.points.length)};
  });
}

// The sample of an image's exposure if it is among the last, else the newest.
function at_exposure(exposed_at) {
  return (id) => {
    const near = (history.get(id) ?? []).filter((sample) => Math.abs(sample.valid_at - exposed_at) < SAME_INSTANT_MS && sample.points.length);
    return near.length ? near.reduce((a, b) => (Math.abs(a.valid_at - exposed_at) < Math.abs(b.valid_at - exposed_at) ? a : b)) : newest.get(id);
  };
}

function draw() {
  is_dirty = false;
  const view = camera(), image = view ? images.get(view.name) : null;
  const image_age = image?.bitmap ? stream.age(image.bitmap_at.received) : Infinity;
  const is_live = image_age < LIVE_IMAGE_MS && image.head.on;
  size($("fluoroscopy"));
  const shown_tubes = tubes(is_live ? at_exposure(image.head.exposed_at) : (id) => newest.get(id));
  const seen = view && seen_by(view, shown_tubes[0]?.sample);
  const picture = image?.bitmap ? {bitmap: image.bitmap, opacity: is_live ? 1 : 0.5} : null;
  drawn = draw_fluoroscopy($("fluoroscopy"), seen, picture, shown_tubes, look, ratio());
  caption(view, image, image_age, is_live);
  if (room && is_time_for_room()) draw_room(view, image);
  watermark(image);
  for (const sample of unseen.splice(0)) {
    stream.seen(sample.n);
    counts.ages.push(performance.timeOrigin + performance.now() - sample.published_at);
  }
  if (counts.ages.length > 1000) counts.ages.splice(0, counts.ages.length - 1000);
  ++counts.paints;
}

// Without a graphics card the room takes longer than everything else: then it gets each second or third frame, and the
// fluoroscopy all of them.
let skipped = 0, frame_ms = 16, frame_at = 0;
function is_time_for_room() {
  if (skipped < (frame_ms < 45 ? 0 : frame_ms < 90 ? 1 : 2)) { ++skipped; return false; }
  skipped = 0;
  return true;
}

function draw_room(view, image) {
  size($("room"));
  size($("labels"));
  if (image?.bitmap && (image.is_new || !room.has_image)) { room.set_image(image.bitmap); image.is_new = false; }
  const sample = newest.get(instrument());
  const cameras = known.cameras.map((each) => seen_by(each, sample));
  room.draw(tubes((id) => newest.get(id)), cameras, view && cameras[known.cameras.indexOf(view)], look, ratio());
  const is_shown = state_of_instrument(instrument()).is_shown;
  const tip = is_shown ? point(sample.points, 0).map((value) => value.toFixed(1)).join(", ") : "unknown";
  const sigma = is_shown ? `, ± ${(SIGMAS * largest_sigma(sample.cov, 0)).toFixed(1)} mm` : "";
  const unheld = is_shown ? sample.held.filter((by) => by === 0).length / sample.held.length : 0;
  const words = unheld > 0 ? `; nothing holds ${Math.max(1, Math.round(100 * unheld))} %` : "";
  $("room-caption").textContent = `tip at ${tip}${is_shown ? " mm" : ""}${sigma}${words}${look.points ? surroundings.words() : ""}`;
}

function caption(view, image, age, is_live) {
  const element = $("image-caption"), name = view ? `view ${view.name}: ` : "";
  const is_wanted = view && known.images.includes(view.name);
  element.classList.toggle("warn", Boolean(is_wanted && image && !is_live));
  const old = age === Infinity ? "" : `, this is the last image, ${(age / 1000).toFixed(1)} s old`;
  element.textContent = !view ? "no camera is known yet"
    : !is_wanted ? `${name}images are not shown here (tubed-view --images)`
    : !image ? `${name}no image has come`
    : is_live ? `${name}${time_line.known ? `frame ${image.head.frame}` : "live"}, grey ${Math.max(0, image.head.black)} .. ${image.head.white}` : image.head.on ? `${name}images do not come${old}` : `${name}fluoroscopy is off${old}`;
}

function watermark(image) {
  const reasons = newest.get(instrument())?.reasons ?? [];
  const words = new Set(Object.entries(ORIGINS).filter(([reason]) => reasons.includes(reason)).map(([, word]) => word));
  if (image?.head.origin === 2) words.add("DEMO");
  if (image?.head.origin === 3) words.add("REPLAY");
  for (const element of document.querySelectorAll(".watermark")) {
    const text = [...words].join(" ");
    if (element.textContent !== text) element.textContent = text;
  }
}

function frame(at) {
  frame_ms += 0.1 * (Math.min(at - frame_at, 300) - frame_ms);
  frame_at = at;
  if (is_dirty) draw();
  if (time_line.known) { size($("strips")); time_line.draw(ratio()); }
  const now = performance.now();
  if (now - strips_at > STRIPS_MS) {
    strips_at = now;
    size($("strips"));
    if (!time_line.known) strips.draw(instrument(), now, ratio());
    is_dirty = is_dirty || shown.is_silent;  // ages in words grow
  }
  requestAnimationFrame(frame);
}

// ---- Keys

const KEYS = [
  ["1 .. 8", "instrument"], ["n", "next view of the fluoroscope"], ["i u c e v p t", "image, sigma, coils, coils alone, vessel, points, truth on and off"],
  ["arrows", "turn the room"], ["+ -", "nearer, further"], ["0 9 8", "as the fluoroscope, from the side, oblique"], ["d", "dim"],
  ["f", "whole screen"], ...RECORDING_KEYS, ["?", "this help"]];

function press(key) {
  const angle = {0: 0, 9: 90, 8: 60}[key], turn = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[key];
  const toggled = SWITCHES.find(([, , letter]) => letter === key);
  if (turn) room?.turn(...turn);
  else if (key === "+" || key === "-") room?.zoom(key === "+" ? 0.87 : 1.15);
  else if (toggled) look[toggled[0]] = !look[toggled[0]];
  else if (time_line.press(key)) return true;
  else if (key === "n") chosen.camera = known.cameras[(known.cameras.indexOf(camera()) + 1) % known.cameras.length]?.name;
  else if (key === "d") dim();
  else if (key === "f") document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen();
  else if (key === "?") $("help").showModal();
  else if (angle !== undefined && !(key === "8" && main_instruments().length >= 8)) look_from(angle);
  else if (key >= "1" && key <= "8") chosen.instrument = main_instruments()[+key - 1] ?? chosen.instrument;
  else return false;
  return true;
}

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || $("help").open || !press(event.key)) return;
  event.preventDefault();
  make_buttons();
  is_dirty = true;
});
addEventListener("resize", () => { is_dirty = time_line.is_dirty = true; });
document.addEventListener("visibilitychange", () => { judge(); draw(); });

$("keys").replaceChildren(...KEYS.map(([keys, words]) => {
  const row = document.createElement("tr"), left = row.insertCell(), right = row.insertCell();
  left.append(...keys.split(" ").flatMap((key) => (key === ".." ? [" to "] : [Object.assign(document.createElement("kbd"), {textContent: key}), " "])));
  right.textContent = words;
  return row;
}));

try {
  room = new Room($("room"), $("labels"));
  surroundings = new Surroundings(room, $("room-trouble"), () => { is_dirty = true; });
  steer($("room"), room, () => { is_dirty = true; });
} catch (error) {
  $("room-caption").textContent = `No 3D: ${error.message}`;
  $("room-caption").classList.add("warn");
}
make_buttons();
setInterval(judge, LOOK_MS);
requestAnimationFrame(frame);

// What the page shows, for tests and for whoever opens the console. `now()` draws first, so that it fits the pictures.
window.tubedView = {
  counts,
  vessel_corners: () => surroundings?.triangles() ?? [],
  now() {
    draw();
    const view = camera();
    return {class: shown.class, word: shown.word, why: shown.why, is_silent: shown.is_silent, drawn, camera: view && seen_by(view, newest.get(instrument())), at: performance.now(),
            sample: newest.get(instrument()) ?? null, position: time_line.position, timeline: time_line.known, image: view ? images.get(view.name)?.head ?? null : null, age: age_of(instrument()),
            room: room && {orbit: room.orbit, canvas: [room.canvas.width, room.canvas.height], labels: room.labelled, ...surroundings.now()}};
  },
};
