// The run over time: angle, distance from the target, drive and health.

import { Picture, colour, label, ticks } from "./drawing.js";
import { History } from "./history.js";

const COLUMNS = ["t", "angle", "error", "sd", "drive", "health", "target"];
const [T, ANGLE, ERROR, SD, DRIVE, HEALTH, TARGET] = COLUMNS.keys();
// Rows in memory, and rows taken of one answer at most.
const CAPACITY = 12000;
const ROWS_TAKEN = 16;
// Least time on the axis, in s, and where the curves begin on the canvas.
const LEAST_S = 2e-3;
const LEFT = 52;
const ZOOMS_MDEG = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1e3, 2e3, 5e3, 1e4, 5e4, 2e5];

export class Plots {
  constructor() {
    const shape = (width) => Math.max(130, Math.min(190, width * 0.45));
    this.pictures = ["angle", "error", "drive"].map((id) => new Picture(id, shape));
    this.history = new History(COLUMNS, CAPACITY);
    this.zoom = 10;
    this.follow = true;
    document.getElementById("zoom-in").addEventListener("click", () => this.step(-1));
    document.getElementById("zoom-out").addEventListener("click", () => this.step(1));
    this.auto = document.getElementById("zoom-auto");
    this.auto.addEventListener("click", () => this.setFollow(!this.follow));
    this.pictures[1].canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.step(Math.sign(event.deltaY));
    }, { passive: false });
    this.clear();
  }

  step(by) {
    this.setFollow(false);
    this.zoom = Math.max(0, Math.min(ZOOMS_MDEG.length - 1, this.zoom + by));
  }

  setFollow(follow) {
    this.follow = follow;
    this.auto.setAttribute("aria-pressed", follow);
  }

  clear() {
    this.history.clear();
    this.begun = 0;
  }

  // A new move begins: the axis begins with it.
  begin() {
    this.begun = this.last?.t ?? 0;
  }

  take(rows, status) {
    if (!rows.length) return;
    this.last = rows[rows.length - 1];
    this.status = status;
    const every = Math.ceil(rows.length / ROWS_TAKEN);
    for (let from = 0; from < rows.length; from += every) {
      const some = rows.slice(from, from + every);
      const last = some[some.length - 1];
      const drive = some.reduce((most, row) => (Math.abs(row.drive) > Math.abs(most) ? row.drive : most), 0);
      const health = some.reduce((most, row) => Math.max(most, row.health), 0);
      this.history.push([last.t, last.angle, last.error, last.sd, drive, health, status.target_deg], [DRIVE, HEALTH]);
    }
    const off = Math.abs(1e3 * (this.last.angle - status.target_deg));
    if (this.follow && Number.isFinite(off)) {
      const wanted = ZOOMS_MDEG.findIndex((mdeg) => mdeg > 1.3 * off + 1);
      this.zoom = wanted < 0 ? ZOOMS_MDEG.length - 1 : wanted;
    }
  }

  draw() {
    if (!this.last) return;
    const until = this.last.t;
    const span = Math.max(LEAST_S, (until - this.begun) * 1.02);
    const axis = { from: Math.max(0, until - span), until: Math.max(until, LEAST_S) };
    this.first = Math.max(0, this.history.since(axis.from) - 1);
    this.drawAngle(axis);
    this.drawError(axis);
    this.drawDrive(axis);
  }

  // The frame of a plot; gives the functions from values to places.
  frame(picture, axis, [low, high], unit) {
    const context = picture.begin();
    const [left, right, top, bottom] = [LEFT, picture.width - 10, 10, picture.height - 20];
    const x = (t) => left + ((t - axis.from) / (axis.until - axis.from)) * (right - left);
    const y = (value) => bottom - ((value - low) / (high - low)) * (bottom - top);
    const values = ticks(low, high, 4);
    context.strokeStyle = colour("line");
    for (const value of values) {
      context.beginPath();
      context.moveTo(left, y(value));
      context.lineTo(right, y(value));
      context.stroke();
      picture.text(label(value, values[1] - values[0]), left - 5, y(value), { align: "right", ink: "faint", size: 11 });
    }
    const times = ticks(axis.from, axis.until, Math.max(2, picture.width / 110));
    const milli = axis.until < 0.1;
    for (const t of times) {
      context.beginPath();
      context.moveTo(x(t), top);
      context.lineTo(x(t), bottom);
      context.stroke();
      if (x(t) > right - 30 || x(t) < left + 12) continue;
      const step = (times[1] ?? 1) - times[0] || 1;
      picture.text(milli ? label(1e3 * t, 1e3 * step) : label(t, step), x(t), bottom + 9,
        { align: "center", ink: "faint", size: 11 });
    }
    picture.text(milli ? "ms" : "s", right, bottom + 9, { align: "right", ink: "faint", size: 11 });
    picture.text(unit, 4, bottom + 9, { ink: "faint", size: 11 });
    context.save();
    context.beginPath();
    context.rect(left, top, right - left, bottom - top);
    context.clip();
    return { context, x, y, left, right, top, bottom };
  }

  line(context, x, y, ink, value, wide = 2) {
    const { values, length } = this.history;
    context.strokeStyle = colour(ink);
    context.lineWidth = wide;
    context.beginPath();
    let begun = false;
    for (let row = this.first; row < length; row += 1) {
      const shown = value(row, values);
      if (!Number.isFinite(shown)) {
        begun = false;
        continue;
      }
      context[begun ? "lineTo" : "moveTo"](x(values[T][row]), y(shown));
      begun = true;
    }
    context.stroke();
    context.lineWidth = 1;
  }

  // Two standard deviations about the estimate.
  spread(context, x, y, value) {
    const { values, length } = this.history;
    context.fillStyle = colour("estimate");
    context.globalAlpha = 0.2;
    context.beginPath();
    for (const [sign, rows] of [[1, 1], [-1, -1]]) {
      const [from, to] = rows > 0 ? [this.first, length] : [length - 1, this.first - 1];
      for (let row = from; row !== to; row += rows) {
        const [centre, sd] = value(row, values);
        if (Number.isFinite(centre)) context.lineTo(x(values[T][row]), y(centre + 2 * sign * sd));
      }
    }
    context.fill();
    context.globalAlpha = 1;
  }

  drawAngle(axis) {
    const { values, length } = this.history;
    let [low, high] = [Infinity, -Infinity];
    for (let row = this.first; row < length; row += 1) {
      for (const column of [ANGLE, TARGET]) {
        low = Math.min(low, values[column][row]);
        high = Math.max(high, values[column][row]);
      }
    }
    const room = Math.max(1e-3, 0.06 * (high - low));
    const { context, x, y } = this.frame(this.pictures[0], axis, [low - room, high + room], "deg");
    context.setLineDash([5, 4]);
    this.line(context, x, y, "target", (row, of) => of[TARGET][row], 1.5);
    context.setLineDash([]);
    this.spread(context, x, y, (row, of) => [of[ANGLE][row] + of[ERROR][row] / 1e3, of[SD][row] / 1e3]);
    this.line(context, x, y, "truth", (row, of) => of[ANGLE][row], 3);
    this.line(context, x, y, "estimate", (row, of) => of[ANGLE][row] + of[ERROR][row] / 1e3, 1.2);
    context.restore();
  }

  drawError(axis) {
    const widest = ZOOMS_MDEG[this.zoom];
    const degrees = widest >= 1000;
    const per = degrees ? 1e-3 : 1;
    const { context, x, y, left, right } =
      this.frame(this.pictures[1], axis, [-widest * per, widest * per], degrees ? "deg" : "mdeg");
    const tolerance = 1e3 * this.status.tolerance_deg * per;
    context.fillStyle = colour("target");
    context.globalAlpha = 0.18;
    context.fillRect(left, y(tolerance), right - left, y(-tolerance) - y(tolerance));
    context.globalAlpha = 1;
    const off = (row, of) => 1e3 * (of[ANGLE][row] - of[TARGET][row]) * per;
    this.spread(context, x, y, (row, of) => [off(row, of) + of[ERROR][row] * per, of[SD][row] * per]);
    this.line(context, x, y, "truth", off, 2.5);
    this.line(context, x, y, "estimate", (row, of) => off(row, of) + of[ERROR][row] * per, 1.2);
    context.restore();
  }

  drawDrive(axis) {
    const { values, length } = this.history;
    const { context, x, y, bottom } = this.frame(this.pictures[2], axis, [-1.6, 1.25], "");
    for (let row = this.first; row < length; row += 1) {
      const [from, to] = [x(values[T][Math.max(row - 1, this.first)]), x(values[T][row])];
      const drive = values[DRIVE][row];
      if (drive) {
        context.fillStyle = colour(drive > 0 ? "b" : "c");
        const [top, low] = [y(Math.max(drive, 0)), y(Math.min(drive, 0))];
        context.fillRect(from, top, Math.max(1, to - from + 0.7), low - top);
      }
      const health = values[HEALTH][row];
      context.fillStyle = colour(["good", "estimate", "bad", "line"][health] ?? "line");
      context.fillRect(from, bottom - 9 - 3 * Math.min(health, 2), Math.max(1, to - from), 8 + 3 * Math.min(health, 2));
    }
    context.restore();
    this.pictures[2].text("B", 10, y(0.7), { ink: "b", size: 13 });
    this.pictures[2].text("C", 10, y(-0.7), { ink: "c", size: 13 });
    this.pictures[2].text("health", 4, y(-1.45), { ink: "faint", size: 11 });
  }
}
