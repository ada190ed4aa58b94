"use strict";
// Values under the pointer, and zoom by dragging. The page is whole without it.
for (const [number, chart] of document.querySelectorAll(".chart").entries()) {
  const SIDE = 10000;
  const plot = chart.querySelector(".plot");
  const svg = plot.querySelector("svg");
  const axis = (text) => {
    const [start, end, logarithmic] = text.split(" ").map(Number);
    return { start, end, value: (part) => {
      const place = start + part * (end - start);
      return logarithmic ? 10 ** place : place;
    }, logarithmic };
  };
  const x = axis(chart.dataset.x), y = axis(chart.dataset.y);
  const [xTicks, yTicks] = [chart.querySelector(".x-ticks"), chart.querySelector(".y-ticks")];
  const drawn = [xTicks, yTicks].map((ticks) => ticks.innerHTML);
  const names = [xTicks, yTicks].map((ticks) =>
    ticks.classList.contains("named") ? [...ticks.children].map((name) => name.textContent) : null);
  let view = { left: 0, right: 1, top: 0, bottom: 1 };

  // Corners of a path: pairs of numbers after M, each of them a distance after l.
  const corners = (path) => {
    const found = [];
    let [px, py] = [0, 0];
    for (const [, command, rest] of path.matchAll(/([Mlh])([^A-Za-z]*)/g)) {
      const numbers = (rest.match(/-?\d+/g) || []).map(Number);
      if (command === "h") continue;
      for (let i = 0; i + 1 < numbers.length; i += 2) {
        [px, py] = command === "M" ? [numbers[i], numbers[i + 1]] : [px + numbers[i], py + numbers[i + 1]];
        found.push([px / SIDE, py / SIDE]);
      }
    }
    return found;
  };
  const paths = [...svg.querySelectorAll(".line[d], .dots[d]")];
  const unlabelled = paths.some((path) => path.dataset.label) ? null : chart.querySelector(".y-label").textContent;
  const series = [];
  for (const path of paths) {
    const label = path.dataset.label || unlabelled;
    if (label && !series.some((other) => other.label === label)) series.push({ label, path });
  }

  const text = (value) => String(Number(value.toPrecision(5))).replace("-", "\u2212");
  const shown = (axisOf, categories, part) => {
    const value = axisOf.value(part);
    return categories ? categories[Math.round(value) - 1] ?? "" : text(value);
  };
  const readout = chart.appendChild(document.createElement("output"));
  readout.className = "readout";
  readout.textContent = number ? "" : "Point at a picture to see its values; drag over a part to enlarge it.";
  const cursor = plot.appendChild(document.createElement("div"));
  cursor.className = "cursor";
  cursor.hidden = true;

  const place = (event) => {
    const box = svg.getBoundingClientRect();
    const clamp = (part) => Math.min(1, Math.max(0, part));
    const h = clamp((event.clientX - box.left) / box.width), v = clamp((event.clientY - box.top) / box.height);
    return { h, v, x: view.left + h * (view.right - view.left), y: view.top + v * (view.bottom - view.top) };
  };
  const show = (at) => {
    const said = [];
    for (const one of series) {
      one.corners ??= corners(one.path.getAttribute("d"));
      let best = null;
      for (const corner of one.corners) {
        if (!best || Math.abs(corner[0] - at.x) < Math.abs(best[0] - at.x)) best = corner;
      }
      if (best && Math.abs(best[0] - at.x) < 0.05 * (view.right - view.left)) {
        said.push(`${one.label} ${shown(y, names[1], 1 - best[1])}`);
      }
    }
    readout.textContent = `${shown(x, names[0], at.x)}: ${said.join(", ") || "nothing"}`;
    cursor.hidden = false;
    cursor.style.left = `${100 * at.h}%`;
  };

  const ticks = (axisOf, from, to, count) => {
    const [low, high] = [from, to].map((part) => axisOf.start + part * (axisOf.end - axisOf.start));
    const rough = (high - low) / count, decade = 10 ** Math.floor(Math.log10(rough));
    const step = decade * [1, 2, 5, 10].find((digit) => digit * decade >= 0.999 * rough);
    const found = [];
    for (let tick = Math.ceil(low / step); tick * step <= high; tick += 1) {
      const place = tick * step;
      found.push({ part: (place - low) / (high - low), words: text(axisOf.logarithmic ? 10 ** place : place) });
    }
    return found;
  };
  const write = (element, found, side) => {
    element.replaceChildren(...found.map(({ part, words }) => {
      const span = document.createElement("span");
      span.textContent = words;
      span.style[side] = `${100 * part}%`;
      return span;
    }));
  };
  const whole = document.createElement("button");
  whole.className = "whole";
  whole.textContent = "Whole picture";
  whole.hidden = true;
  chart.after(whole);
  const zoom = (to) => {
    view = to;
    const zoomed = to.right - to.left < 1 || to.bottom - to.top < 1;
    svg.setAttribute("viewBox",
      [to.left * SIDE, to.top * SIDE, (to.right - to.left) * SIDE, (to.bottom - to.top) * SIDE].join(" "));
    whole.hidden = !zoomed;
    for (const grid of svg.querySelectorAll(".grid")) grid.style.display = zoomed ? "none" : "";
    for (const name of plot.querySelectorAll(".name")) name.hidden = zoomed;
    if (zoomed) {
      write(xTicks, ticks(x, to.left, to.right, 6), "left");
      write(yTicks, ticks(y, 1 - to.bottom, 1 - to.top, 4).map((tick) => ({ ...tick, part: 1 - tick.part })), "top");
    } else {
      [xTicks.innerHTML, yTicks.innerHTML] = drawn;
    }
  };
  whole.addEventListener("click", () => zoom({ left: 0, right: 1, top: 0, bottom: 1 }));

  let from = null, frame = null;
  plot.addEventListener("pointermove", (event) => {
    const at = place(event);
    show(at);
    if (!from) return;
    frame ??= plot.appendChild(Object.assign(document.createElement("div"), { className: "frame" }));
    Object.assign(frame.style, {
      left: `${100 * Math.min(from.h, at.h)}%`, width: `${100 * Math.abs(at.h - from.h)}%`,
      top: `${100 * Math.min(from.v, at.v)}%`, height: `${100 * Math.abs(at.v - from.v)}%`,
    });
  });
  plot.addEventListener("pointerleave", () => { cursor.hidden = true; });
  plot.addEventListener("pointerdown", (event) => {
    show(place(event));
    if (event.pointerType === "touch" || event.button || names[0] || names[1]) return;
    event.preventDefault();
    plot.setPointerCapture(event.pointerId);
    from = place(event);
  });
  const end = (event) => {
    const at = place(event), begun = from;
    frame?.remove();
    from = frame = null;
    if (!begun || event.type === "pointercancel") return;
    if (Math.abs(at.h - begun.h) < 0.02 || Math.abs(at.v - begun.v) < 0.02) return;
    zoom({ left: Math.min(begun.x, at.x), right: Math.max(begun.x, at.x),
      top: Math.min(begun.y, at.y), bottom: Math.max(begun.y, at.y) });
  };
  plot.addEventListener("pointerup", end);
  plot.addEventListener("pointercancel", end);
}
