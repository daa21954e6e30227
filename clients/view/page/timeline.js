// The time line of a recording: what became of each instant, where the page is in it, and how a person goes elsewhere.
import {CLASSES} from "./strips.js";

const LETTERS = {V: {colour: CLASSES.VALID, height: 1}, Q: {colour: CLASSES.QUESTIONABLE, height: 0.6}, I: {colour: "#e5484d", height: 0.25},
                 N: {colour: "#e5484d", height: 0.25}};
const LEAST_TOP = 2;  // mm: a good recording does not fill the height with noise
const QUIET = "#8a979e", INK = "#cfd8dc";

const clock = (seconds) => `${Math.floor(seconds / 60)}:${(seconds % 60).toFixed(1).padStart(4, "0")}`;

// [key as on the keyboard, what it wishes, of the time line as it is]
const WISHES = {
  " ": (line) => ({play: !line.position.playing}), ",": () => ({step: -1}), ".": () => ({step: 1}),
  Home: (line) => ({seek: line.known.begin}), End: (line) => ({seek: line.known.end}),
  "[": () => ({faster: -1}), "]": () => ({faster: 1}),  // of the speed that is, which the page may not know yet
};
export const RECORDING_KEYS = [["space", "recording: go on, stand still"], [", .", "one instant back, on"], ["[ ]", "slower, faster"],
                               ["Home End", "to the beginning, to the end"]];

export class TimeLine {
  // `wish` sends one; `canvas` shows the line, `buttons` is where its buttons go.
  constructor(canvas, buttons, wish) {
    Object.assign(this, {canvas, buttons, wish, known: null, position: null, is_dirty: true});
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.known) return;
      canvas.setPointerCapture(event.pointerId);
      this.seek(event);
    });
    canvas.addEventListener("pointermove", (event) => { if (this.known && event.buttons) this.seek(event); });
  }

  take(message) {
    const is_first = !this.known;
    this.known = message;
    this.is_dirty = true;
    if (is_first) this.make_buttons();
  }
  take_position(message) {
    const was = this.position;
    this.position = message;
    this.is_dirty = true;
    if (this.known && (was?.playing !== message.playing || was?.speed !== message.speed)) this.make_buttons();
    if (this.known) this.say();
  }

  // True: the key was one of the time line's.
  press(key) {
    const wish = this.known && this.position && WISHES[key]?.(this);
    if (!wish) return false;
    this.wish(wish);
    return true;
  }

  make_buttons() {
    const {playing, speed} = this.position ?? {playing: true, speed: 1};
    const made = [["To the beginning", "Home"], ["Step back", ","], [playing ? "Stand still" : "Play", " "], ["Step on", "."],
                  ["Slower", "["], ["Faster", "]"]].map(([words, key]) => {
      const element = document.createElement("button");
      element.type = "button";
      element.textContent = words;
      element.dataset.key = key;
      element.addEventListener("click", () => this.press(key));
      return element;
    });
    const has_focus = this.buttons.contains(document.activeElement) && document.activeElement.dataset.key;
    this.output = Object.assign(document.createElement("output"), {id: "position"});
    this.speed_words = speed === 1 ? "" : `, ${speed < 1 ? `1/${1 / speed}` : speed} times as quick`;
    this.buttons.replaceChildren(...made, this.output);
    made.find((element) => element.dataset.key === has_focus)?.focus();  // a person steps with the space bar
    this.say();
  }

  say() {
    if (!this.position) return;
    const {begin, end, name} = this.known;
    const words = `${clock(this.position.at - begin)} of ${clock(end - begin)}, frame ${this.position.frame}${this.speed_words ?? ""}`;
    this.output.textContent = `${words}: ${name}`;
    this.canvas.setAttribute("aria-valuetext", words);
  }

  place(ratio) { return {left: 250 * ratio, right: this.canvas.width - 92 * ratio}; }

  seek(event) {
    const ratio = this.canvas.width / this.canvas.clientWidth, {left, right} = this.place(ratio);
    const share = Math.min(Math.max((event.offsetX * ratio - left) / (right - left), 0), 1);
    this.wish({seek: this.known.begin + share * (this.known.end - this.known.begin)});
  }

  draw(ratio) {
    if (!this.is_dirty) return;
    this.is_dirty = false;
    const context = this.canvas.getContext("2d", {alpha: false}), {width, height} = this.canvas, {left, right} = this.place(ratio);
    const {begin, end, ready, done, trouble, validity, rows} = this.known, band = 20 * ratio;
    const x_of = (seconds) => left + ((seconds - begin) / Math.max(end - begin, 1e-9)) * (right - left);
    const step = (right - left) / validity.length, at = (i) => left + i * step;
    context.fillStyle = "#000";
    context.fillRect(0, 0, width, height);
    context.font = `${12.5 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
    context.textBaseline = "middle";
    context.fillStyle = trouble ? CLASSES.QUESTIONABLE : QUIET;
    context.fillText(trouble ? "ends early, see below" : done ? "validity" : `validity, made ${Math.round((100 * (ready - begin)) / (end - begin || 1))} %`, 8 * ratio, band / 2);
    this.draw_validity(context, validity, {at, step, band, ratio});
    const row_height = (height - band) / Math.max(rows.length, 1), now = this.position ? this.piece(this.position.at) : -1;
    rows.forEach((row, i) => this.draw_row(context, row, {at, left, right, top: band + i * row_height, height: row_height, ratio, now}));
    context.fillStyle = "#20272c";
    if (!done) context.fillRect(x_of(ready), 0, right - x_of(ready), height);
    if (trouble) {
      context.fillStyle = CLASSES.QUESTIONABLE;
      context.fillText(trouble, Math.max(8 * ratio, right - context.measureText(trouble).width), height - 9 * ratio);
    }
    if (!this.position) return;
    context.fillStyle = "#fff";
    context.fillRect(x_of(this.position.at) - ratio, 0, 2 * ratio, height);
  }

  piece(seconds) {
    const {begin, end, validity} = this.known;
    return Math.min(Math.floor(((seconds - begin) / Math.max(end - begin, 1e-9)) * validity.length), validity.length - 1);
  }

  // A piece without an instant is as the one before it.
  draw_validity(context, validity, {at, step, band, ratio}) {
    let last = null;
    for (let i = 0; i < validity.length; ++i) {
      last = LETTERS[validity[i]] ?? last;
      if (!last) continue;
      context.fillStyle = last.colour;
      context.fillRect(at(i), 2 * ratio + (1 - last.height) * (band - 4 * ratio), step + ratio, last.height * (band - 4 * ratio));
    }
  }

  draw_row(context, {name, unit, values}, {at, left, right, top, height, ratio, now}) {
    const highest = Math.max(LEAST_TOP, ...values.filter((value) => value !== null)) * 1.1;
    const y = (value) => top + height - 3 * ratio - (value / highest) * (height - 6 * ratio);
    context.fillStyle = QUIET;
    context.fillText(`${name}`, 8 * ratio, top + height / 2);
    context.strokeStyle = "#20272c";
    context.lineWidth = ratio;
    context.beginPath();
    context.moveTo(left, top + height - ratio);
    context.lineTo(right, top + height - ratio);
    context.stroke();
    context.beginPath();
    let is_first = true;
    values.forEach((value, i) => {
      if (value === null) return;
      is_first ? context.moveTo(at(i), y(value)) : context.lineTo(at(i), y(value));
      is_first = false;
    });
    context.strokeStyle = INK;
    context.lineWidth = 1.2 * ratio;
    context.stroke();
    // That of the instant, or the last one before it.
    const here = values.slice(0, now + 1).findLast((value) => value !== null);
    context.fillStyle = "#fff";
    context.fillText(here === undefined ? "-" : `${here.toFixed(1)} ${unit}`, right + 8 * ratio, top + height / 2);
  }
}
