// The computing, in a thread of its own: the page draws while the motor runs.
//
//   page ---- open, run, goOn, faults, hand ----> worker ---- opened, ran, begun, taken, refused ----> page

import load, { LoopView, faults, settings } from "./web.js";

// Ticks of the loop are 10 us.
const TICK_S = 1e-5;
// Rows in an answer at most, and ticks between two looks at the clock.
const ROWS_MAX = 128;
const TICKS_AT_ONCE = 100;
// Time in ms that a request may take, so that an answer comes for every picture.
const BUDGET_MS = 13;

let view = null;
// Part of a tick that the last request left.
let rest = 0;

const wasm = await load({ module_or_path: new URL("web_bg.wasm", import.meta.url) });
postMessage({ kind: "ready", ...JSON.parse(settings()), faults: JSON.parse(faults()) });

function open(scene) {
  const next = new LoopView(scene);
  view?.free();
  view = next;
  rest = 0;
  return { kind: "opened", motor: JSON.parse(view.true_motor()), scene };
}

// Runs the motor on by so many seconds, or as far as the time allows.
function run(seconds) {
  const wanted = seconds / TICK_S + rest;
  const ticks = Math.floor(wanted);
  const every = Math.max(1, Math.ceil(ticks / ROWS_MAX));
  const stepsBefore = view.steps();
  const begun = performance.now();
  let done = 0;
  while (done < ticks && performance.now() - begun < BUDGET_MS) {
    // Whole rows, so that they come at even times.
    const some = Math.min(ticks - done, Math.max(every, TICKS_AT_ONCE - (TICKS_AT_ONCE % every)));
    view.advance(some, every);
    done += some;
  }
  rest = done < ticks ? 0 : wanted - ticks;
  const computing = performance.now() - begun;
  const [rows, impacts] = [view.rows(), view.impacts()];
  const answer = {
    kind: "ran", rows, impacts, computing, seconds: done * TICK_S, late: done < ticks,
    steps: view.steps() - stepsBefore, memory: wasm.memory.buffer.byteLength, status: JSON.parse(view.status()),
  };
  postMessage(answer, [rows.buffer, impacts.buffer]);
}

// What comes before this answer is of the motion before.
const begun = () => postMessage({ kind: "begun" });
// The scene that runs from now on.
const taken = (pairs) => postMessage({ kind: "taken", pairs });

const requests = {
  open: ({ scene }) => postMessage(open(scene)),
  run: ({ seconds }) => run(seconds),
  goOn: ({ scene, pairs }) => {
    view.go_on(scene);
    begun();
    taken(pairs);
  },
  faults: ({ scene, pairs }) => {
    view.change_faults(scene);
    taken(pairs);
  },
  hand: ({ mode, amplitude }) => {
    view.drive_by_hand(mode, amplitude);
    begun();
  },
};

onmessage = ({ data }) => {
  try {
    requests[data.kind](data);
  } catch (error) {
    // A refusal is a text; anything else is a fault of this program.
    if (typeof error !== "string") throw error;
    postMessage({ kind: "refused", text: error, of: data.kind });
  }
};
