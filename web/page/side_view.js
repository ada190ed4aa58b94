// The motor from the side: the stator bends, its teeth hit the rotor. Heights are drawn much larger than widths. And
// the heights of teeth and rotor over the last milliseconds, with a stem for each impact.

import { Picture, colour, label, short, ticks } from "./drawing.js";

// Half of the width shown, in mm, and what of the motor is drawn to scale in it.
const HALF_MM = 5.6;
const ROTOR_MM = 4.35;
const PIN_MM = 1;
// Time of the trace in s, and from which speed on it is held for a while, so that it can be read.
const TRACE_S = 1.5e-3;
const HOLD_SPEED = 1 / 250;
const HOLD_MS = 600;
// How long an impact is shown.
const FLASH_MS = 450;
const POINTS = 48;

export class SideView {
  constructor() {
    this.picture = new Picture("side", (width) => Math.max(190, Math.min(300, width * 0.42)));
    this.trace = new Picture("trace", (width) => Math.max(120, Math.min(170, width * 0.24)));
    this.flashes = [];
    this.rows = [];
    this.impacts = [];
    this.reach = 4;
    this.shown = null;
    this.shownAt = 0;
  }

  clear() {
    Object.assign(this, { flashes: [], rows: [], impacts: [], shown: null, band: null });
  }

  open(motor) {
    this.clear();
    this.motor = motor;
    this.toothMm = 1e3 * motor["plant.motor.tooth_radius_m"];
    const first = (motor.tooth_angle_deg * Math.PI) / 180;
    this.teeth = [0, 1, 2, 3].map((number) => first + (number * Math.PI) / 2);
  }

  // Rows, objects by the names of their columns, and impacts of one answer.
  take(rows, impacts, now) {
    if (!rows.length) return;
    this.row = rows[rows.length - 1];
    const of = (name) => rows.map((row) => row[name]);
    const names = ["height", "tooth_0", "tooth_1", "tooth_2", "tooth_3"];
    this.band = rows.length > 5
      ? Object.fromEntries(names.map((name) => [name, [Math.min(...of(name)), Math.max(...of(name))]])) : null;
    const rim = ({ height, slope_x: x, slope_y: y }) => Math.abs(height) + ROTOR_MM * Math.hypot(x, y);
    const largest = Math.max(...names.flatMap((name) => of(name).map(Math.abs)), ...rows.map(rim));
    if (Number.isFinite(largest)) {
      this.reach = Math.max(largest, this.reach + (Math.max(3, largest) - this.reach) * 0.02);
    }
    this.rows.push(...rows);
    this.impacts.push(...impacts);
    const from = this.row.t - 2 * TRACE_S;
    this.rows.splice(0, this.rows.findIndex((row) => row.t >= from));
    this.impacts = this.impacts.filter((impact) => impact.t >= from);
    for (const impact of impacts.slice(-4)) {
      this.flashes = this.flashes.filter((flash) => flash.tooth !== impact.tooth);
      this.flashes.push({ ...impact, at: now });
    }
  }

  // Height of the ring in micrometres at an angle: that of the teeth, and smooth between them.
  ring([a, b, c, d], angle) {
    const from = angle - this.teeth[0];
    return (a + b + c + d) / 4 + ((a - b + c - d) / 4) * Math.cos(2 * from)
      + ((a - c) / 2) * Math.cos(from) + ((b - d) / 2) * Math.sin(from);
  }

  draw(now, slow) {
    if (!this.row) return;
    const context = this.picture.begin();
    const { width, height } = this.picture;
    const { row } = this;
    const middle = width / 2;
    const perMm = width / (2 * HALF_MM);
    const perUm = (0.3 * height) / this.reach;
    const rest = 0.66 * height;
    const x = (mm) => middle + mm * perMm;
    const y = (um) => rest - um * perUm;
    const tops = [0, 1, 2, 3].map((number) => row[`tooth_${number}`]);

    this.drawScale(perUm, perMm, rest);
    for (const front of [false, true]) this.drawRing(context, tops, x, y, front);
    this.drawTeeth(context, tops, x, y, perUm);
    this.drawRotor(context, x, y, perUm);
    this.drawFlashes(context, tops, x, y, now, slow);
    const turns = Math.abs(row.rate) < 0.01 ? "at rest"
      : `turns ${row.rate > 0 ? "clockwise" : "counter-clockwise"}, ${Math.abs(row.rate).toFixed(1)} rad/s`;
    this.picture.text(`rotor ${turns}`, width - 8, height - 16, { align: "right" });
    this.drawTrace(now, slow);
  }

  drawScale(perUm, perMm, rest) {
    const { picture } = this;
    const context = picture.context;
    const round = ticks(0, this.reach, 2)[1] ?? 1;
    context.strokeStyle = colour("faint");
    context.beginPath();
    context.moveTo(10, rest);
    context.lineTo(10, rest - round * perUm);
    context.moveTo(10, picture.height - 16);
    context.lineTo(10 + perMm, picture.height - 16);
    context.stroke();
    picture.text(`${round} µm`, 16, rest - (round * perUm) / 2, { ink: "faint", size: 11 });
    picture.text("1 mm", 16 + perMm, picture.height - 16, { ink: "faint", size: 11 });
  }

  drawRing(context, tops, x, y, front) {
    const half = front ? Math.PI : 0;
    context.beginPath();
    for (let point = 0; point <= POINTS; point += 1) {
      const angle = half + (point / POINTS) * Math.PI;
      const place = [x(this.toothMm * Math.cos(angle)), y(this.ring(tops, angle)) + 24 + (front ? 5 : -5)];
      if (point) context.lineTo(...place);
      else context.moveTo(...place);
    }
    context.lineWidth = front ? 9 : 6;
    context.lineCap = "round";
    context.strokeStyle = colour(front ? "metal" : "line");
    context.stroke();
    context.lineWidth = 1;
    context.lineCap = "butt";
  }

  drawTeeth(context, tops, x, y, perUm) {
    const order = this.teeth.map((angle, number) => ({ angle, number, front: Math.sin(angle) < 0 }));
    for (const { angle, number, front } of order.sort((a, b) => a.front - b.front)) {
      const left = x(this.toothMm * Math.cos(angle)) - 8;
      const top = y(tops[number]);
      const band = this.band?.[`tooth_${number}`];
      if (band) {
        context.fillStyle = colour("band");
        context.fillRect(left, y(band[1]), 16, Math.max(1, (band[1] - band[0]) * perUm));
      }
      context.fillStyle = colour(front ? "metal" : "line");
      context.strokeStyle = colour("faint");
      context.beginPath();
      context.rect(left, top, 16, 24 + (front ? 3 : -7));
      context.fill();
      context.stroke();
    }
  }

  drawRotor(context, x, y, perUm) {
    const { row } = this;
    const thick = 20;
    // The lateral shift is drawn larger than the rotor, as the heights are.
    const sideways = Math.min(0.4, 8 / (1e6 * (this.motor["plant.motor.hub.clearance_m"] ?? 20e-6)));
    const shift = row.shift_x * sideways;
    const rim = (angle) => {
      const [mmX, mmY] = [ROTOR_MM * Math.cos(angle), ROTOR_MM * Math.sin(angle)];
      return [x(mmX) + shift, y(row.height + row.slope_x * mmX + row.slope_y * mmY)];
    };
    const face = (from, to, up, start) => {
      for (let point = 0; point <= POINTS; point += 1) {
        const [px, py] = rim(from + ((to - from) * point) / POINTS);
        if (point || !start) context.lineTo(px, py - up);
        else context.moveTo(px, py - up);
      }
    };
    if (this.band) {
      const [low, high] = this.band.height;
      context.fillStyle = colour("band");
      context.fillRect(x(-ROTOR_MM), y(high), x(ROTOR_MM) - x(-ROTOR_MM), Math.max(1, (high - low) * perUm));
    }
    context.fillStyle = colour("rotor");
    context.strokeStyle = colour("truth");
    context.globalAlpha = 0.88;
    context.beginPath();
    face(Math.PI, 2 * Math.PI, 0, true);
    face(0, Math.PI, thick, false);
    context.closePath();
    context.fill();
    context.globalAlpha = 1;
    context.stroke();
    context.beginPath();
    face(Math.PI, 2 * Math.PI, thick, true);
    context.stroke();
    // Notches on the rim show that it turns.
    for (let notch = 0; notch < 24; notch += 1) {
      const angle = -(row.angle * Math.PI) / 180 + (notch * Math.PI) / 12;
      if (Math.sin(angle) > 0) continue;
      const [px, py] = rim(angle);
      context.strokeStyle = colour(notch === 0 ? "bad" : "truth");
      context.lineWidth = notch === 0 ? 4 : 1.2;
      context.beginPath();
      context.moveTo(px, py - 2);
      context.lineTo(px, py - thick + 2);
      context.stroke();
    }
    context.lineWidth = 1;
    // The pin, before the hole with its clearance.
    const [left, right] = [x(-PIN_MM), x(PIN_MM)];
    const level = y(row.height) - thick / 2;
    context.strokeStyle = colour("truth");
    context.setLineDash([3, 3]);
    for (const edge of [left - 8 + shift, right + 8 + shift]) {
      context.beginPath();
      context.moveTo(edge, level - thick / 2);
      context.lineTo(edge, level + thick / 2);
      context.stroke();
    }
    context.setLineDash([]);
    context.fillStyle = colour("metal");
    context.globalAlpha = 0.35;
    context.fillRect(left, level - 34, right - left, this.picture.height - level + 14);
    context.globalAlpha = 1;
    this.picture.text("pin", (left + right) / 2, level - 26, { align: "center", size: 11 });
  }

  drawFlashes(context, tops, x, y, now, slow) {
    this.flashes = this.flashes.filter((flash) => now - flash.at < FLASH_MS);
    for (const { tooth, impulse, at } of this.flashes) {
      const fade = 1 - (now - at) / FLASH_MS;
      const [px, py] = [x(this.toothMm * Math.cos(this.teeth[tooth])), y(tops[tooth])];
      context.globalAlpha = fade;
      context.fillStyle = colour("bad");
      context.beginPath();
      context.arc(px, py, Math.min(16, 3 + 4 * Math.sqrt(impulse)), 0, 2 * Math.PI);
      context.fill();
      context.globalAlpha = 1;
      if (slow) this.picture.text(`${short(impulse)}µN s`, px, py + 44, { align: "center", ink: "bad", size: 12 });
    }
  }

  drawTrace(now, slow) {
    const { trace } = this;
    const fast = !slow;
    if (!this.shown || !fast || now - this.shownAt > HOLD_MS) {
      this.shown = { rows: [...this.rows], impacts: [...this.impacts], until: this.row.t };
      this.shownAt = now;
    }
    const context = trace.begin();
    const { width, height } = trace;
    const { rows, impacts, until } = this.shown;
    const from = until - TRACE_S;
    const [left, right, top, bottom] = [44, width - 8, 20, height - 18];
    const x = (t) => left + ((t - from) / TRACE_S) * (right - left);
    const [low, span] = [-0.45 * this.reach, 1.1 * this.reach];
    const y = (um) => bottom - ((um - low) / (span - low)) * (bottom - top);
    context.strokeStyle = colour("line");
    const values = ticks(low, span, 3);
    for (const value of values) {
      context.beginPath();
      context.moveTo(left, y(value));
      context.lineTo(right, y(value));
      context.stroke();
      trace.text(label(value, values[1] - values[0]), left - 5, y(value), { align: "right", ink: "faint", size: 11 });
    }
    context.save();
    context.beginPath();
    context.rect(left, top - 6, right - left, bottom - top + 6);
    context.clip();
    for (const { t, tooth, impulse } of impacts) {
      context.strokeStyle = colour("bad");
      context.globalAlpha = 0.55;
      context.lineWidth = tooth % 2 ? 1 : 2;
      context.beginPath();
      context.moveTo(x(t), bottom);
      context.lineTo(x(t), bottom - Math.min(bottom - top, 6 + 10 * Math.sqrt(impulse)));
      context.stroke();
    }
    context.globalAlpha = 1;
    for (const [name, ink, wide] of [["tooth_0", "b", 1.2], ["tooth_1", "c", 1.2], ["height", "truth", 2]]) {
      context.strokeStyle = colour(ink);
      context.lineWidth = wide;
      context.beginPath();
      rows.forEach((row, number) => context[number ? "lineTo" : "moveTo"](x(row.t), y(row[name])));
      context.stroke();
    }
    context.restore();
    context.lineWidth = 1;
    const held = fast ? ", held to be read" : "";
    trace.text(`Heights in µm over ${short(1e3 * TRACE_S)}ms${held}`, left, 8, { size: 11, ink: "faint" });
    const names = [["rotor", "truth"], ["teeth", "b"], ["teeth between", "c"], ["impacts", "bad"]];
    let place = left;
    for (const [name, ink] of names) {
      context.fillStyle = colour(ink);
      context.fillRect(place, height - 9, 12, 3);
      trace.text(name, place + 16, height - 8, { size: 11 });
      place += 26 + context.measureText(name).width;
    }
  }
}

export const isSlow = (speed) => speed <= HOLD_SPEED;
