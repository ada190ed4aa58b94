// The rotor from above: it turns, the target waits, and a lens shows one mark as the camera sees it.

import { Picture, colour } from "./drawing.js";

const OUTER_MM = 4.35;
const HOLE_MM = 1;
// The field of the lens to either side in micrometres, and how many frames it shows.
const LENS_UM = 8;
const FRAMES = 120;

const radians = (degrees) => (degrees * Math.PI) / 180;

export class TopView {
  constructor(onTarget) {
    this.picture = new Picture("top", (width) => Math.min(width, 460));
    this.handle = document.getElementById("handle");
    this.onTarget = onTarget;
    this.target = 90;
    this.frames = [];
    this.listen();
  }

  open(motor) {
    this.motor = motor;
    this.frames = [];
    this.teeth = [0, 1, 2, 3].map((number) => radians(motor.tooth_angle_deg + 90 * number));
    this.row = null;
  }

  place() {
    const { width, height } = this.picture;
    const radius = Math.min(width, height) / 2 - 34;
    return { middle: [width / 2, height / 2], perMm: radius / OUTER_MM, radius };
  }

  setTarget(degrees) {
    this.target = degrees;
    this.handle.setAttribute("aria-valuenow", degrees);
    this.handle.setAttribute("aria-valuetext", `${degrees} degrees`);
  }

  listen() {
    const { handle } = this;
    const angleAt = (event) => {
      const box = this.picture.canvas.getBoundingClientRect();
      const { middle: [x, y] } = this.place();
      return (Math.atan2(event.clientX - box.left - x, -(event.clientY - box.top - y)) * 180) / Math.PI;
    };
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      this.held = angleAt(event);
      event.preventDefault();
      handle.focus();
    });
    handle.addEventListener("pointermove", (event) => {
      if (this.held === undefined) return;
      const now = angleAt(event);
      // The short way round, so that several turns can be dragged.
      const by = ((((now - this.held) % 360) + 540) % 360) - 180;
      this.held = now;
      this.dragged = (this.dragged ?? this.target) + by;
      this.setTarget(Math.round(10 * this.dragged) / 10);
      this.onTarget(this.target, false);
    });
    const end = () => {
      if (this.held !== undefined && this.dragged !== undefined) this.onTarget(this.target, true);
      this.held = this.dragged = undefined;
    };
    handle.addEventListener("pointerup", end);
    handle.addEventListener("pointercancel", end);
    const steps = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 90, PageDown: -90 };
    handle.addEventListener("keydown", (event) => {
      const step = event.key === "Home" ? -this.target : steps[event.key];
      if (!step) return;
      event.preventDefault();
      this.setTarget(Math.round(1e4 * (this.target + step * (event.shiftKey ? 0.1 : 1))) / 1e4);
      this.onTarget(this.target, true);
    });
  }

  take(rows) {
    if (!rows.length) return;
    this.row = rows[rows.length - 1];
    this.frames.push(...rows.filter((row) => Number.isFinite(row.innovation)));
    this.frames.splice(0, this.frames.length - FRAMES);
  }

  draw() {
    const context = this.picture.begin();
    const { middle: [cx, cy], perMm, radius } = this.place();
    // x of the motor points up, y to the left: counter-clockwise stays counter-clockwise, and 0 degrees is up.
    const at = (mm, angle) => [cx - mm * perMm * Math.sin(angle), cy - mm * perMm * Math.cos(angle)];
    this.drawDial(context, cx, cy, radius);
    const { row } = this;
    if (!row || !this.motor) return;
    const turned = -radians(row.angle);
    const sideways = 8 / (1e6 * (this.motor["plant.motor.hub.clearance_m"] ?? 20e-6));
    const [dx, dy] = [-row.shift_y * sideways, -row.shift_x * sideways];

    context.fillStyle = colour("rotor");
    context.strokeStyle = colour("truth");
    context.beginPath();
    context.arc(cx + dx, cy + dy, radius, 0, 2 * Math.PI);
    context.arc(cx + dx, cy + dy, HOLE_MM * perMm + 6, 0, 2 * Math.PI, true);
    context.fill("evenodd");
    context.stroke();
    context.strokeStyle = colour("faint");
    context.setLineDash([3, 3]);
    const toothMm = 1e3 * this.motor["plant.motor.tooth_radius_m"];
    for (const angle of this.teeth) {
      const [x, y] = at(toothMm, angle);
      context.strokeRect(x - 7, y - 7, 14, 14);
    }
    context.setLineDash([]);
    context.fillStyle = colour("metal");
    context.beginPath();
    context.arc(cx, cy, HOLE_MM * perMm, 0, 2 * Math.PI);
    context.fill();
    for (let notch = 0; notch < 24; notch += 1) {
      const angle = turned + (notch * Math.PI) / 12;
      const [from, to] = [at(OUTER_MM, angle), at(OUTER_MM - (notch % 6 ? 0.18 : 0.4), angle)];
      context.strokeStyle = colour(notch === 0 ? "bad" : "truth");
      context.lineWidth = notch === 0 ? 4 : 1.2;
      context.beginPath();
      context.moveTo(from[0] + dx, from[1] + dy);
      context.lineTo(to[0] + dx, to[1] + dy);
      context.stroke();
    }
    context.lineWidth = 1;
    this.drawEstimate(context, at, row);
    this.drawMarks(context, at, turned, dx, dy);
    this.drawLens(context, at, turned);
    this.picture.text(`${row.angle.toFixed(3)}°`, cx, cy, { align: "center", size: 15, ink: "paper" });
  }

  drawDial(context, cx, cy, radius) {
    for (let degrees = 0; degrees < 360; degrees += 30) {
      const angle = radians(degrees);
      const [sine, cosine] = [Math.sin(angle), -Math.cos(angle)];
      context.strokeStyle = colour("faint");
      context.beginPath();
      context.moveTo(cx + (radius + 3) * sine, cy + (radius + 3) * cosine);
      context.lineTo(cx + (radius + 8) * sine, cy + (radius + 8) * cosine);
      context.stroke();
      if (degrees % 90 === 0) {
        this.picture.text(`${degrees}°`, cx + (radius + 20) * sine, cy + (radius + 18) * cosine,
          { align: "center", ink: "faint", size: 11 });
      }
    }
    const angle = radians(this.target);
    const [x, y] = [cx + (radius + 14) * Math.sin(angle), cy - (radius + 14) * Math.cos(angle)];
    context.strokeStyle = colour("target");
    context.setLineDash([5, 4]);
    context.beginPath();
    context.moveTo(cx, cy);
    context.lineTo(x, y);
    context.stroke();
    context.setLineDash([]);
    this.handle.style.transform = `translate(${x - 22}px, ${y - 22}px) rotate(${this.target % 360}deg)`;
  }

  drawEstimate(context, at, row) {
    if (!Number.isFinite(row.error)) return;
    const angle = -radians(row.angle + row.error / 1e3);
    context.strokeStyle = colour("estimate");
    context.lineWidth = 2.5;
    context.beginPath();
    context.moveTo(...at(1.5, angle));
    context.lineTo(...at(OUTER_MM + 0.25, angle));
    context.stroke();
    context.lineWidth = 1;
  }

  drawMarks(context, at, turned, dx, dy) {
    const count = this.motor.camera_marks;
    const mm = Math.min(OUTER_MM, 1e3 * this.motor.camera_radius_m);
    for (let mark = 0; mark < count; mark += 1) {
      const [x, y] = at(mm, turned + (2 * Math.PI * mark) / count);
      context.fillStyle = colour("ink");
      context.beginPath();
      context.arc(x + dx, y + dy, 4, 0, 2 * Math.PI);
      context.fill();
    }
  }

  // The place of mark 1 in micrometres in the last frames, against where the filter expects it, on the camera's pixels.
  drawLens(context, at, turned) {
    const { width, height } = this.picture;
    const size = Math.min(58, width / 7.5);
    const [x, y] = [width - size - 4, height - size - 18];
    const perUm = size / LENS_UM;
    const radiusUm = 1e6 * this.motor.camera_radius_m;
    const [markX, markY] = at(Math.min(OUTER_MM, 1e3 * this.motor.camera_radius_m), turned);
    context.strokeStyle = colour("faint");
    context.beginPath();
    context.moveTo(markX, markY);
    context.lineTo(x, y);
    context.stroke();
    context.save();
    context.beginPath();
    context.arc(x, y, size, 0, 2 * Math.PI);
    context.fillStyle = colour("paper");
    context.fill();
    context.clip();
    context.strokeStyle = colour("line");
    const pixelUm = Math.max(1, 1e6 * this.motor.camera_resolution_m);
    for (let um = -Math.ceil(LENS_UM / pixelUm) * pixelUm; um <= LENS_UM; um += pixelUm) {
      context.beginPath();
      context.moveTo(x + um * perUm, y - size);
      context.lineTo(x + um * perUm, y + size);
      context.moveTo(x - size, y + um * perUm);
      context.lineTo(x + size, y + um * perUm);
      context.stroke();
    }
    this.frames.forEach((frame, number) => {
      const along = radians(frame.innovation / 1e3) * radiusUm;
      const across = Number.isFinite(frame.marked_x)
        ? (frame.marked_x - frame.shift_x) * Math.cos(turned) + (frame.marked_y - frame.shift_y) * Math.sin(turned) : 0;
      context.globalAlpha = 0.2 + (0.8 * (number + 1)) / this.frames.length;
      context.fillStyle = colour(frame.used ? "ink" : "bad");
      context.beginPath();
      const inside = (um) => Math.max(-LENS_UM, Math.min(LENS_UM, um)) * perUm;
      context.arc(x + inside(along), y - inside(across), number + 1 === this.frames.length ? 4 : 2, 0, 2 * Math.PI);
      context.fill();
    });
    context.restore();
    context.strokeStyle = colour("faint");
    context.beginPath();
    context.arc(x, y, size, 0, 2 * Math.PI);
    context.stroke();
    context.strokeStyle = colour("estimate");
    context.beginPath();
    context.moveTo(x - 6, y);
    context.lineTo(x + 6, y);
    context.moveTo(x, y - 6);
    context.lineTo(x, y + 6);
    context.stroke();
    this.picture.text(`mark 1, ${2 * LENS_UM} µm wide`, width - 4, y + size + 10,
      { align: "right", ink: "faint", size: 11 });
  }
}
