// The page: asks the worker for the motion of the time that has passed, and draws it.

import { hashOf, linesOf, pairsOf } from "./address.js";
import { addFilters, listen } from "./controls.js";
import { readColours } from "./drawing.js";
import { Faults, endedAt, lasts, nameOf, wordsOf } from "./faults.js";
import { Plots } from "./plots.js";
import { Settings } from "./settings.js";
import { SideView, isSlow } from "./side_view.js";
import { TopView } from "./top_view.js";
import { Tour } from "./tour.js";
import { Words } from "./words.js";

// Longest time in s that one picture may bring, so that a page in the background does not run ahead.
const PICTURE_S = 0.05;
// A command takes text; angles are rounded as the fields show them.
const TARGET = "position.to_deg";
const ROTOR = "plant.rotor";
const FILTER = "estimator.filter";
const find = (id) => document.getElementById(id);

class Page {
  constructor() {
    readColours();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readColours);
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    this.pairs = pairsOf(location.hash);
    this.side = new SideView();
    this.top = new TopView((degrees, last) => this.dragged(degrees, last));
    this.plots = new Plots();
    this.words = new Words();
    this.waiting = false;
    this.asked = 0;
    this.worker = new Worker("worker.js", { type: "module" });
    this.worker.onmessage = ({ data }) => this[data.kind](data);
    this.worker.onerror = (event) => this.complain(`The computing has stopped: ${event.message}`);
    listen(this);
    this.tour = new Tour(this);
  }

  // From the worker.

  ready({ settings, row, impact, faults }) {
    this.columns = { row, impact };
    this.normal = new Map(settings.map(({ key, kind }) => [key, kind.default ?? (kind.number ?? kind.integer)[2]]));
    this.settings = new Settings(find("setting-list"), settings, (key, value) => this.set(key, value));
    this.faults = new Faults(find("fault-list"), faults, (fault) => this.fault(fault));
    addFilters(this, settings.find(({ key }) => key === FILTER).kind.choice);
    // Who asks for less motion begins with a picture that stands.
    this.pause(this.still.matches);
    this.open();
    requestAnimationFrame((now) => this.picture(now));
  }

  opened({ motor }) {
    this.motor = motor;
    this.t = 0;
    this.side.open(motor);
    this.top.open(motor);
    this.plots.clear();
    this.words.clear();
    this.refusedShown(null);
    this.isOpen = true;
    document.body.dataset.t = 0;
    this.show();
    // One picture of a motor that stands still.
    if (this.paused) this.ask(1e-3);
    const count = Number(document.body.dataset.opened ?? 0) + 1;
    document.body.dataset.opened = count;
  }

  refused({ text, of }) {
    this.refusedShown(text);
    if (of === "open" && this.motor) {
      // What was refused is taken back: the motor that runs stays.
      this.pairs = this.pairsBefore ?? new Map();
      this.pairsOpened = new Map(this.pairs);
      this.isOpen = true;
      this.show();
    } else if (of === "open") {
      this.pairs = new Map();
      this.open();
      this.refusedKept = text;
    }
    if (of === "goOn" || of === "faults") {
      this.pairs = new Map(this.pairsOpened);
      this.show();
    }
    document.body.dataset.refused = Number(document.body.dataset.refused ?? 0) + 1;
  }

  refusedShown(text) {
    const shown = text ?? this.refusedKept ?? "";
    this.refusedKept = null;
    find("refused").hidden = !shown;
    find("refused").textContent = shown.replace(/^error: /, "Refused: ");
  }

  ran({ rows, impacts, computing, seconds, steps, late, memory, status }) {
    this.waiting = false;
    const now = performance.now();
    const samples = this.named(rows, this.columns.row);
    const hits = this.named(impacts, this.columns.impact);
    if (samples.length) {
      this.t = samples[samples.length - 1].t;
      this.status = status;
      this.side.take(samples, hits, now);
      this.top.take(samples);
      this.plots.take(samples, status);
      this.words.outcome(status);
    }
    this.words.take({ samples, computing, seconds, steps, late });
    document.body.dataset.memory = memory;
    document.body.dataset.first ??= performance.now().toFixed(0);
    document.body.dataset.t = this.t ?? 0;
    this.changed = true;
  }

  // Another move, or driving by hand.
  begun() {
    this.plots.begin();
    this.words.begin();
  }

  // Another target, or other faults, of the motor that runs.
  taken({ pairs }) {
    if (this.isOpen) this.pairsOpened = pairs;
  }

  named(values, columns) {
    const rows = [];
    for (let from = 0; from < values.length; from += columns.length) {
      const row = {};
      columns.forEach((name, column) => { row[name] = values[from + column]; });
      rows.push(row);
    }
    return rows;
  }

  // To the worker.

  open() {
    this.isOpen = false;
    this.pairsOpened = new Map(this.pairs);
    this.worker.postMessage({ kind: "open", scene: linesOf(this.pairs) });
  }

  ask(seconds) {
    this.waiting = true;
    this.asked = seconds;
    this.worker.postMessage({ kind: "run", seconds });
  }

  // The time from which on something can be changed: a tick after what was asked for.
  next() {
    const ahead = (this.t ?? 0) + (this.waiting ? this.asked + 1e-5 : 0) + 1e-5;
    return Number((Math.ceil(ahead * 1e5 - 1e-6) / 1e5).toFixed(5));
  }

  // What the user does.

  set(key, value) {
    const before = new Map(this.pairs);
    const isNormal = String(this.normal.get(key)) === value && !key.startsWith("plant.motor.");
    if (value === null || isNormal) this.pairs.delete(key);
    else this.pairs.set(key, value);
    if (key === ROTOR && value !== "tilting") this.dropHub();
    this.pairsBefore = before;
    this.open();
  }

  // What only a rotor that tilts has.
  dropHub() {
    for (const [key, { row }] of this.settings.rows) {
      if (this.settings.hub.contains(row)) this.pairs.delete(key);
    }
    const words = wordsOf(this.pairs).filter((word) => !word.startsWith("hub:"));
    if (words.length) this.pairs.set("faults", words.join(","));
    else this.pairs.delete("faults");
  }

  move(degrees) {
    if (!Number.isFinite(degrees)) return;
    this.pairs.set(TARGET, String(degrees));
    if (degrees === this.normal.get(TARGET)) this.pairs.delete(TARGET);
    this.hand = null;
    this.worker.postMessage({ kind: "goOn", scene: linesOf(this.pairs), pairs: this.pairs });
    this.pause(false);
    this.show();
  }

  dragged(degrees, last) {
    find("target").value = degrees;
    const now = performance.now();
    if (!last && now - (this.draggedAt ?? 0) < 150) return;
    this.draggedAt = now;
    this.move(degrees);
  }

  fault({ name, word, instant }) {
    const words = wordsOf(this.pairs);
    const lasting = words.findIndex((other) => nameOf(other) === name && lasts(other));
    const at = this.next();
    if (instant) words.push(`${word}@${name === "stator:drift" ? `${at}..` : at}`);
    else if (lasting < 0) words.push(`${word}@${at}..`);
    else words[lasting] = endedAt(words[lasting], at);
    this.pairs.set("faults", words.join(","));
    this.worker.postMessage({ kind: "faults", scene: linesOf(this.pairs), pairs: this.pairs });
    this.show();
  }

  drive(mode, amplitude) {
    this.hand = [mode, amplitude];
    this.worker.postMessage({ kind: "hand", mode, amplitude });
    this.pause(false);
    this.show();
  }

  pause(paused) {
    this.paused = paused;
    find("pause").textContent = paused ? "Run" : "Pause";
  }

  // A scene of the tour: all is as it begins, but for what is said.
  present({ speed, move, hand, rotor, faults, look }) {
    this.pairsBefore = new Map(this.pairs);
    this.pairs = new Map();
    if (move !== undefined && move !== 90) this.pairs.set(TARGET, String(move));
    if (rotor) this.pairs.set(ROTOR, rotor);
    if (faults) this.pairs.set("faults", faults);
    this.hand = null;
    this.open();
    this.setSpeed(speed);
    this.plots.setFollow(true);
    if (hand) this.drive(...hand);
    this.pause(false);
    const behavior = this.still.matches ? "auto" : "smooth";
    document.documentElement.style.setProperty("--tour", `${find("tour").offsetHeight + 12}px`);
    find(look).scrollIntoView({ behavior, block: "start" });
  }

  setSpeed(power) {
    find("speed").value = power;
    this.speed = 10 ** power;
    const slower = 1 / this.speed;
    const words = slower < 1.05 ? "real time" : `1/${Number(slower.toPrecision(2))} of real time`;
    find("speed-text").textContent = words;
    find("speed").setAttribute("aria-valuetext", words);
  }

  show() {
    const hash = hashOf(this.pairs);
    history.replaceState(null, "", hash ? `#${hash}` : location.pathname + location.search);
    const target = Number(this.pairs.get(TARGET) ?? this.normal.get(TARGET));
    if (document.activeElement !== find("target")) find("target").value = target;
    this.top.setTarget(target);
    this.words.scene(this.pairs, this.pairs.get(FILTER) ?? this.normal.get(FILTER), this.hand);
    if (!this.motor) return;
    this.settings.show(this.pairs, this.motor);
    this.faults.show(wordsOf(this.pairs), this.motor);
  }

  complain(text) {
    find("refused").hidden = false;
    find("refused").textContent = text;
  }

  picture(now) {
    const passed = Math.min(PICTURE_S, (now - (this.before ?? now)) / 1e3);
    this.before = now;
    if (this.isOpen && !this.waiting && !this.paused && passed > 0) this.ask(passed * this.speed);
    // A slider of the window, or of colours, asks for a new picture as well.
    this.side.draw(now, isSlow(this.speed));
    this.top.draw();
    if (this.changed) this.plots.draw();
    this.words.figures(now, this.status, this.top.row, this.hand);
    this.words.costs(now);
    requestAnimationFrame((next) => this.picture(next));
  }
}

new Page();
