// What the page says in words and figures: the state of the loop, what became of a move, what computing costs.

import { commandOf } from "./address.js";
import { short } from "./drawing.js";

// Time in ms between two sets of figures, of the loop and of the cost.
const FIGURES_MS = 250;
const COST_MS = 1000;
// Simulated time in s over which impacts are counted, and that has to be computed to tell how fast computing is.
const COUNTED_S = 2e-3;
const MEASURED_S = 0.01;

const find = (id) => document.getElementById(id);
const put = (id, text) => { find(id).textContent = text; };

const NO_COST = { computing: 0, seconds: 0, steps: 0, pictures: 0 };

export class Words {
  constructor() {
    this.cost = { ...NO_COST, since: performance.now() };
    this.figuresAt = 0;
    this.clear();
  }

  // Another motor.
  clear() {
    this.impacts = { count: 0, seconds: 0, rate: NaN };
    this.begin();
  }

  // Another move.
  begin() {
    this.ended = false;
  }

  take({ samples, computing, seconds, steps, late }) {
    this.impacts.count += samples.reduce((sum, row) => sum + row.impacts, 0);
    this.impacts.seconds += seconds;
    this.cost.computing += computing;
    this.cost.seconds += seconds;
    this.cost.steps += steps;
    this.late = late;
  }

  // What became of a move, once.
  outcome(status) {
    if (!status?.outcome || this.ended) return;
    this.ended = true;
    const { outcome, verdict } = status;
    const error = `${outcome.final_error_mdeg >= 0 ? "+" : ""}${outcome.final_error_mdeg.toFixed(3)}`;
    const time = (outcome.settle_time_s ?? outcome.duration_s).toFixed(4);
    const reason = outcome.reason ? ` ${outcome.reason} ${outcome.hint ?? ""}` : "";
    put("said", `Target ${outcome.target_deg}°: ${verdict} after ${time} s, error ${error} mdeg.${reason}`);
    document.body.dataset.moved = Number(document.body.dataset.moved ?? 0) + 1;
  }

  // What is chosen: the command of the scene, the filter, the rotor, the drive by hand.
  scene(pairs, filter, hand) {
    put("command", commandOf(pairs));
    for (const radio of document.querySelectorAll("[name=filter]")) radio.checked = radio.value === filter;
    const rotor = pairs.get("plant.rotor") ?? "height_only";
    for (const button of document.querySelectorAll("[data-rotor]")) {
      button.setAttribute("aria-pressed", button.dataset.rotor === rotor);
    }
    for (const button of document.querySelectorAll("[data-mode]")) {
      button.setAttribute("aria-pressed", hand?.[0] === button.dataset.mode);
    }
    put("scene-note", hand ? "The command moves to the target; driving by hand is of this page."
      : "The command begins at rest at 0 degrees, as this page does from the start.");
  }

  figures(now, status, row, hand) {
    if (now - this.figuresAt < FIGURES_MS || !status || !row) return;
    this.figuresAt = now;
    put("fact-phase", hand ? "driven by hand" : status.phase.replace("(", ", ").replace(")", "").toLowerCase());
    put("fact-drive", status.mode === "off" ? "off" : `mode ${status.mode}, ${status.amplitude.toFixed(2)}`);
    put("fact-truth", `${row.angle.toFixed(4)}°`);
    put("fact-estimate", Number.isFinite(row.sd)
      ? `${(row.angle + row.error / 1e3).toFixed(4)}° ± ${((2 * row.sd) / 1e3).toFixed(4)}°` : "none yet");
    put("fact-health", status.health);
    find("fact-health").className = status.health.split(":")[0];
    put("why", status.why.join(" ") || "The filter trusts its estimate.");
    const { impacts } = this;
    if (impacts.seconds > COUNTED_S) {
      Object.assign(impacts, { rate: impacts.count / impacts.seconds, count: 0, seconds: 0 });
    }
    put("fact-impacts", Number.isNaN(impacts.rate) ? "being counted" : `${short(impacts.rate)}a second`);
    const mode = hand && (hand[0] === "off" ? "off" : `mode ${hand[0].toUpperCase()}`);
    // A region that is read aloud changes only when there is something to say.
    const said = hand ? `Driven by hand: ${mode}.` : `On the way to ${status.target_deg}°.`;
    if ((hand || !this.ended) && find("said").textContent !== said) put("said", said);
  }

  costs(now) {
    const { cost } = this;
    cost.pictures += 1;
    if (now - cost.since < COST_MS) return;
    const passed = (now - cost.since) / 1e3;
    const computing = cost.computing / 1e3;
    document.body.dataset.pictures = (cost.pictures / passed).toFixed(1);
    // A few steps a picture tell little of how fast steps are.
    if (cost.seconds > MEASURED_S) this.able = { steps: cost.steps / computing, factor: cost.seconds / computing };
    const share = Math.min(100, (100 * computing) / passed);
    const able = this.able
      ? `One core computes ${short(this.able.steps)}steps of the motor a second, ${
        this.able.factor.toFixed(1)} times real time. ` : "";
    const late = this.late ? "That is not enough for this motor at this speed." : "";
    put("cost", `${able}This page uses ${share.toFixed(share < 10 ? 1 : 0)} % of one. ${late}`);
    document.body.dataset.factor = this.able?.factor ?? "";
    Object.assign(cost, NO_COST, { since: now });
  }
}
