// Faults by their words: each has a button that begins it now, and ends it when pressed again.

const THINGS = {
  camera: "Camera", mark: "Mark 1", ldv: "Vibrometer", drive: "Drive", stator: "Stator", rotor: "Rotor", hub: "Hub",
};
// What a button sets where the word takes a value and has no default of use.
const VALUES = {
  "camera:intermittent": 0.9, "camera:outliers": 0.5, "camera:delayed": 1e-3, "ldv:intermittent": 0.5,
  "ldv:outliers": 0.01, "ldv:offset": 0.01, "drive:weak": 0.6, "stator:drift": 0.5, "rotor:jolt": 5, "hub:rub": 0.8,
};

export class Faults {
  // `onFault(word, begins)` is told the word without its time, and whether it begins or ends.
  constructor(list, words, onFault) {
    this.buttons = [];
    for (const [thing, title] of Object.entries(THINGS)) {
      const set = document.createElement("fieldset");
      set.append(Object.assign(document.createElement("legend"), { textContent: title }));
      for (const word of words.filter((word) => word.thing === thing)) set.append(...this.button(word, onFault));
      list.append(set);
    }
  }

  button(word, onFault) {
    const { thing, what, value, meaning, instant } = word;
    const button = Object.assign(document.createElement("button"), { type: "button", title: meaning });
    button.textContent = what.replaceAll("_", " ");
    button.setAttribute("aria-pressed", "false");
    button.dataset.fault = `${thing}:${what}`;
    const parts = [button];
    let input = null;
    if (value?.kind) {
      const [min, max, normal] = value.kind.number;
      const set = VALUES[`${thing}:${what}`] ?? normal;
      input = Object.assign(document.createElement("input"), { type: "number", step: "any", min, max, value: set });
      input.setAttribute("aria-label", `${what}: ${meaning}`);
      const unit = Object.assign(document.createElement("span"), { className: "unit", textContent: value.unit });
      parts.push(input, unit);
    } else if (value?.mode) {
      input = document.createElement("select");
      input.setAttribute("aria-label", "mode that is dead");
      for (const [mode, name] of [["", "both"], ["b", "mode B"], ["c", "mode C"]]) input.append(new Option(name, mode));
      parts.push(input);
    }
    button.addEventListener("click", () => {
      const name = `${thing === "mark" ? "mark1" : thing}:${what}`;
      const given = input?.value ?? "";
      onFault({ name, word: given === "" ? name : `${name}:${given}`, instant });
    });
    this.buttons.push({ button, word });
    const holder = Object.assign(document.createElement("span"), { className: "fault" });
    holder.append(...parts);
    return [holder];
  }

  // Shows which faults last, of the words of the scene, and which of them this motor cannot have.
  show(words, motor) {
    for (const { button, word: { thing, what, instant, needs_a_hub: needsHub } } of this.buttons) {
      const name = `${thing === "mark" ? "mark1" : thing}:${what}`;
      button.setAttribute("aria-pressed", !instant && words.some((word) => lasts(word) && nameOf(word) === name));
      const absent = (needsHub && !motor.tilting) || (thing === "mark" && motor.camera_marks < 2);
      button.disabled = absent;
    }
  }
}

export const wordsOf = (pairs) => (pairs.get("faults") ?? "").split(/[\s,]+/).filter(Boolean);

export const nameOf = (word) => word.split("@")[0].split(":").slice(0, 2).join(":");

// The word of a fault that ends at `at`, or a tick after it begins.
export function endedAt(word, at) {
  const [fault, from = "0"] = word.replace(/\.\.$/, "").split("@");
  return `${fault}@${from}..${Math.max(at, Number((Number(from) + 1e-5).toFixed(5)))}`;
}

// Whether a word has no end: `thing:what@0.1..`, or no time at all.
export const lasts = (word) => /\.\.$/.test(word) || !word.includes("@");
