// Every setting as a slider with a number beside it, with its bounds, its unit and where its value comes from.

const GROUPS = [
  ["table_1", "The motor: Table 1 of the paper"],
  ["hub", "The hub, and what a rotor that tilts has beside"],
  ["camera", "The camera"],
  ["vibrometer", "The vibrometer"],
  ["move", "The move"],
  ["plant", "How the motor is computed"],
];
// Places of a slider.
const STEPS = 1000;
// From this ratio of bounds on a slider goes by factors.
const WIDE = 30;

// A slider stands in the middle at the default, is fine near it, and reaches both bounds.
export function scaleOf([min, max, normal]) {
  const inside = normal > min && normal < max;
  const half = (centre, end) => {
    // Numbers of one sign go by factors, others by squares.
    if (centre > 0 && end > 0 && Math.max(end / centre, centre / end) > WIDE) {
      const factor = end / centre;
      return [(u) => centre * factor ** (u * u), (v) => Math.sqrt(Math.log(v / centre) / Math.log(factor))];
    }
    const power = Math.abs(end - centre) > WIDE * Math.abs(centre) && centre !== 0 ? 6 : 2;
    return [(u) => centre + (end - centre) * u ** power, (v) => ((v - centre) / (end - centre)) ** (1 / power)];
  };
  const whole = half(normal >= max ? max : min, normal >= max ? min : max);
  const [low, high] = inside ? [half(normal, min), half(normal, max)] : [whole, whole];
  const round = (value) => Math.max(min, Math.min(max, Number(value.toPrecision(4))));
  if (!inside) {
    const turned = normal >= max;
    return {
      value: (place) => round(whole[0](turned ? 1 - place / STEPS : place / STEPS)),
      place: (value) => Math.round(STEPS * (turned ? 1 - whole[1](value) : whole[1](value))),
    };
  }
  return {
    value: (place) => {
      const u = (2 * place) / STEPS - 1;
      return round(u < 0 ? low[0](-u) : high[0](u));
    },
    place: (value) => Math.round((STEPS / 2) * (value < normal ? 1 - low[1](value) : 1 + high[1](value))),
  };
}

// Five digits, which fit their field.
function text(value) {
  const rounded = Number(Number(value).toPrecision(5));
  if (!Number.isFinite(rounded)) return "";
  const small = rounded !== 0 && Math.abs(rounded) < 1e-3;
  return small ? rounded.toExponential() : String(rounded);
}

function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

export class Settings {
  // `onSet(key, text)` is told what is set, with null for a key that is set no more.
  constructor(list, settings, onSet) {
    this.onSet = onSet;
    this.rows = new Map();
    for (const [group, title] of GROUPS) {
      const of = settings.filter((setting) => setting.group === group);
      const part = element("details", { id: `group-${group}` });
      part.append(element("summary", {}, `${title} (${of.length})`));
      if (group === "hub") {
        this.hubNote = element("p", { className: "small" }, "Of a rotor that tilts only.");
        part.append(this.hubNote);
      }
      for (const setting of of) part.append(this.row(setting));
      if (group === "hub") this.hub = part;
      list.append(part);
    }
  }

  row(setting) {
    const { key, unit, bounds, origin, tolerance, meaning, kind } = setting;
    const name = key.replace(/^plant\.motor\./, "");
    const id = `set-${key.replaceAll(".", "-")}`;
    const about = [unit ? `${bounds} ${unit}` : bounds];
    if (origin) about.push(origin);
    if (tolerance) about.push(`drawn ${tolerance}`);
    const head = element("div", { className: "setting-name" },
      element("label", { htmlFor: id }, name),
      element("small", { id: `${id}-about` }, `${meaning}. ${about.join(", ")}.`));
    const row = element("div", { className: "setting" }, head);
    row.dataset.key = key;
    const undo = element("button", { type: "button", className: "undo", hidden: true }, "undo");
    undo.setAttribute("aria-label", `undo ${name}`);
    undo.addEventListener("click", () => this.onSet(key, null));
    const state = { row, undo, setting };
    if (kind.number || kind.integer) this.number(state, id, unit);
    else this.choice(state, id);
    row.append(undo);
    this.rows.set(key, state);
    return row;
  }

  number(state, id, unit) {
    const { setting: { key, kind, meaning }, row } = state;
    const bounds = (kind.number ?? kind.integer).map(Number);
    const whole = Boolean(kind.integer);
    const input = element("input", { id, type: "number", step: whole ? "1" : "any" });
    input.setAttribute("aria-describedby", `${id}-about`);
    const put = (value) => {
      if (input.value.trim() === "" && value === undefined) return this.onSet(key, null);
      return this.onSet(key, value ?? input.value.trim());
    };
    input.addEventListener("change", () => put());
    // A whole number beyond all sliders, as a seed, has its field alone.
    if (bounds[1] <= 1e7) {
      const scale = scaleOf(bounds);
      const slider = element("input", { type: "range", min: 0, max: STEPS, step: 1 });
      slider.setAttribute("aria-label", meaning);
      slider.addEventListener("input", () => {
        const value = scale.value(Number(slider.value));
        put(String(whole ? Math.round(value) : value));
      });
      Object.assign(state, { slider, scale });
      row.append(slider);
    }
    row.append(element("span", { className: "field" }, input, ` ${unit}`));
    state.show = (value) => {
      input.value = text(value);
      if (state.slider) state.slider.value = state.scale.place(Number(value));
    };
    state.normal = bounds[2];
  }

  choice(state, id) {
    const { setting: { key, kind }, row } = state;
    const select = element("select", { id });
    select.setAttribute("aria-describedby", `${id}-about`);
    for (const word of kind.choice) select.append(element("option", { value: word }, word.replaceAll("_", " ")));
    select.addEventListener("change", () => this.onSet(key, select.value));
    row.append(select);
    state.show = (value) => { select.value = value; };
    state.normal = kind.default;
  }

  // Shows what the scene sets, and of everything else what the true motor has, or the default.
  show(pairs, motor) {
    for (const [key, state] of this.rows) {
      const isSet = pairs.has(key);
      state.row.classList.toggle("changed", isSet);
      state.undo.hidden = !isSet;
      // What is being typed stays.
      if (document.activeElement !== state.row.querySelector("input[type=number]")) {
        state.show(isSet ? pairs.get(key) : motor[key] ?? state.normal);
      }
    }
    for (const control of this.hub.querySelectorAll("input, select")) control.disabled = !motor.tilting;
    this.hubNote.hidden = motor.tilting;
  }
}
