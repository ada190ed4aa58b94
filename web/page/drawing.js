// Canvases in the page's colours, sharp on every screen, and texts that stay inside.

const colours = {};

// Reads the colours of the style sheet, for light and dark.
export function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["paper", "ink", "faint", "line", "truth", "estimate", "target", "b", "c", "metal", "rotor", "bad",
    "good", "band"]) {
    colours[name] = style.getPropertyValue(`--${name}`).trim();
  }
}

export const colour = (name) => colours[name];

// A canvas as wide as its place: `draw` gets it cleared, in CSS pixels.
export class Picture {
  constructor(id, shape) {
    this.canvas = document.getElementById(id);
    this.context = this.canvas.getContext("2d");
    this.shape = shape;
    this.fit();
    new ResizeObserver(() => this.fit()).observe(this.canvas.parentElement);
  }

  fit() {
    const width = Math.max(1, Math.floor(this.canvas.parentElement.clientWidth));
    const height = Math.round(this.shape(width));
    const scale = window.devicePixelRatio || 1;
    if (this.width === width && this.height === height && this.scale === scale) return;
    Object.assign(this, { width, height, scale });
    Object.assign(this.canvas, { width: Math.round(width * scale), height: Math.round(height * scale) });
    Object.assign(this.canvas.style, { width: `${width}px`, height: `${height}px` });
  }

  begin() {
    const { context, width, height, scale } = this;
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = "12px system-ui, sans-serif";
    context.lineWidth = 1;
    context.globalAlpha = 1;
    context.setLineDash([]);
    return context;
  }

  // A text at a place, moved as far as it needs to stay on the canvas.
  text(words, x, y, { ink = "ink", align = "left", size = 12 } = {}) {
    const { context, width, height } = this;
    context.font = `${size}px system-ui, sans-serif`;
    const wide = context.measureText(words).width;
    const from = x - wide * { left: 0, center: 0.5, right: 1 }[align];
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillStyle = colour(ink);
    const placed = Math.max(2, Math.min(width - wide - 2, from));
    context.fillText(words, placed, Math.max(size / 2, Math.min(height - size / 2, y)));
    if (wide > width - 4) this.canvas.dataset.clipped = words;
  }
}

// Values at which an axis has lines: about `count` round ones between two values.
export function ticks(low, high, count) {
  const rough = (high - low) / Math.max(1, count);
  if (!(rough > 0) || !Number.isFinite(rough)) return [];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((candidate) => candidate >= rough);
  const first = Math.ceil(low / step - 1e-9);
  const values = [];
  for (let number = first; number * step <= high + 1e-9 * step; number += 1) values.push(number * step);
  return values;
}

// A number with so many digits as its step on an axis needs.
export const label = (value, step) => value.toFixed(Math.max(0, Math.min(6, Math.ceil(-Math.log10(step) - 1e-9))));

// A value with three digits, with SI letters where they help.
export function short(value) {
  if (!Number.isFinite(value)) return "-";
  const size = Math.abs(value);
  for (const [letter, unit] of [["G", 1e9], ["M", 1e6], ["k", 1e3]]) {
    if (size >= unit) return `${Number((value / unit).toPrecision(3))} ${letter}`;
  }
  return `${Number(value.toPrecision(3))} `;
}
