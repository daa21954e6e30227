// The last minute as strips: validity, latency, residuals of the coils, uncertainty.

const SPAN_MS = 60000;
const MAX_SAMPLES = 2000;
export const CLASSES = {VALID: "#19b5a5", QUESTIONABLE: "#ffb000"};

const ROWS = [
  {name: "latency, exposure to publishing", unit: "ms", of: (row) => row.latency, least_top: 20, digits: 0},
  {name: "largest residual of a coil", unit: "mm", of: (row) => row.residual, least_top: 2, digits: 1},
  {name: "largest sigma", unit: "mm", of: (row) => row.sigma, least_top: 2, digits: 1},
];

export class Strips {
  constructor(canvas) {
    this.canvas = canvas;
    this.rows = new Map();  // by instrument
  }

  // {at, validity, latency, residual, sigma}; latency and residual may be null.
  add(instrument, row) {
    const rows = this.rows.get(instrument) ?? [];
    this.rows.set(instrument, rows);
    rows.push(row);
    if (rows.length > MAX_SAMPLES) rows.splice(0, rows.length - MAX_SAMPLES);
  }

  draw(instrument, now, ratio) {
    const context = this.canvas.getContext("2d", {alpha: false}), {width, height} = this.canvas;
    const rows = (this.rows.get(instrument) ?? []).filter((row) => now - row.at < SPAN_MS);
    const left = 250 * ratio, right = width - 92 * ratio, band = 20 * ratio;
    const x = (at) => right - ((now - at) / SPAN_MS) * (right - left);
    context.fillStyle = "#000";
    context.fillRect(0, 0, width, height);
    context.font = `${12.5 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
    context.textBaseline = "middle";
    this.draw_validity(context, rows, x, band, ratio, now);
    const row_height = (height - band) / ROWS.length;
    ROWS.forEach((row, i) => this.draw_row(context, row, rows, {x, left, right, top: band + i * row_height, height: row_height, ratio}));
  }

  // Where nothing came there is no colour but hatching: a gap is seen as one.
  draw_validity(context, rows, x, band, ratio, now) {
    context.fillStyle = "#8a979e";
    context.fillText("validity, last 60 s", 8 * ratio, band / 2);
    context.fillStyle = "#5a1518";
    const first = rows[0]?.at ?? now;
    context.fillRect(x(first), 2 * ratio, x(now) - x(first), band - 4 * ratio);
    rows.forEach((row, i) => {
      const until = Math.min(rows[i + 1]?.at ?? now, row.at + 250);
      const height = row.validity === "VALID" ? 1 : row.validity === "QUESTIONABLE" ? 0.6 : 0.25;
      context.fillStyle = CLASSES[row.validity] ?? "#e5484d";
      context.fillRect(x(row.at), 2 * ratio + (1 - height) * (band - 4 * ratio), x(until) - x(row.at) + ratio, height * (band - 4 * ratio));
    });
  }

  draw_row(context, row, rows, {x, left, right, top, height, ratio}) {
    const values = rows.map(row.of);
    const most = Math.max(row.least_top, ...values.filter((value) => value !== null)) * 1.1;
    const y = (value) => top + height - 3 * ratio - (value / most) * (height - 6 * ratio);
    context.fillStyle = "#8a979e";
    context.fillText(row.name, 8 * ratio, top + height / 2);
    context.strokeStyle = "#20272c";
    context.lineWidth = ratio;
    context.beginPath();
    context.moveTo(left, top + height - ratio);
    context.lineTo(right, top + height - ratio);
    context.stroke();
    context.beginPath();
    let before = null;
    rows.forEach(({at}, i) => {
      if (values[i] === null) return;
      if (before === null || at - before > 1000) context.moveTo(x(at), y(values[i]));
      else context.lineTo(x(at), y(values[i]));
      before = at;
    });
    context.strokeStyle = "#cfd8dc";
    context.lineWidth = 1.2 * ratio;
    context.stroke();
    const newest = values.findLast((value) => value !== null);
    context.fillStyle = "#fff";
    context.fillText(newest === undefined ? "-" : `${newest.toFixed(row.digits)} ${row.unit}`, right + 8 * ratio, top + height / 2);
  }
}
