// What stands in the room beside the tube: the vessel and registration points. What is wrong with them is told, and stops nothing.
import {read_vessel} from "./vessel.js";

const SMALL_MM = 5;  // no vessel, but one in metres

export class Surroundings {
  // `trouble`: the element that says what is wrong; `changed` is called when there is something new to draw.
  constructor(room, trouble, changed) {
    Object.assign(this, {room, trouble, changed, vessel: null, points: [], axes: "", loaded: "", told: "", shown: null});
  }

  // A message of what there is.
  take({vessel, points, axes}) {
    const known = JSON.stringify(points);
    if (known !== this.told) {
      this.told = known;
      this.points = points;
      this.room.set_points(points);
    }
    if (axes !== this.axes) {
      this.axes = axes;
      if (this.vessel) this.show();
    }
    const wanted = JSON.stringify(vessel);
    if (vessel && wanted !== this.loaded) {
      this.loaded = wanted;
      this.load(vessel, wanted);
    }
  }

  async load(vessel, wanted) {
    this.say("");
    try {
      const answer = await fetch(`/vessel.${vessel.kind}`).catch(() => {
        this.loaded = "";  // it is asked for again with the next connection
        throw new Error("the viewer does not answer");
      });
      if (!answer.ok) throw new Error(`the viewer answers with ${answer.status}`);
      const read = await read_vessel(await answer.arrayBuffer(), vessel.kind);
      if (this.loaded !== wanted) return;  // another one came meanwhile
      this.vessel = read;
      this.show();
      const {low, high} = this.shown, extent = Math.max(...high.map((value, axis) => value - low[axis]));
      if (extent < SMALL_MM) this.say(`vessel ${vessel.name}: it is ${extent.toPrecision(2)} mm large; are its numbers metres? Expected are mm`);
    } catch (error) {
      if (!this.loaded || this.loaded === wanted) this.say(`vessel ${vessel.name}: ${error.message}`);
    }
  }

  // Between LPS and RAS x and y change their sign, where file and room both say which they have.
  show() {
    const {positions, normals, axes} = this.vessel;
    const is_turned = Boolean(axes && this.axes && axes !== this.axes);
    const along = (values) => (is_turned ? values.map((value, i) => (i % 3 < 2 ? -value : value)) : values);
    const turned = along(positions);
    this.shown = {positions: turned, is_turned, ...bounds_of(turned)};
    this.room.set_vessel({positions: this.shown.positions, normals: along(normals)});
    this.changed();
  }

  say(words) {
    this.trouble.textContent = words;
    this.changed();
  }

  words() { return this.points.length ? `; ${this.points.length} point${this.points.length > 1 ? "s" : ""}` : ""; }

  // For tests and for whoever opens the console.
  triangles() { return this.shown ? [...this.shown.positions] : []; }
  now() {
    const vessel = this.vessel && {triangles: this.shown.positions.length / 9, is_turned: this.shown.is_turned, low: this.shown.low, high: this.shown.high};
    return {vessel, trouble: this.trouble.textContent, points: this.points};
  }
}

function bounds_of(positions) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; ++i) {
    const axis = i % 3;
    if (positions[i] < low[axis]) low[axis] = positions[i];
    if (positions[i] > high[axis]) high[axis] = positions[i];
  }
  return {low, high};
}
