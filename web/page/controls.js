// What the visitor presses, types and drags, and what the page does then.

import { hashOf, pairsOf } from "./address.js";

const find = (id) => document.getElementById(id);

export function listen(page) {
  const on = (id, kind, action) => find(id).addEventListener(kind, action);
  on("move", "submit", (event) => {
    event.preventDefault();
    page.move(Number(find("target").value));
  });
  for (const button of document.querySelectorAll("[data-by]")) {
    button.addEventListener("click", () => {
      const by = Number(button.dataset.by);
      page.move(Number((Number(find("target").value) + by).toPrecision(12)));
    });
  }
  on("speed", "input", () => page.setSpeed(Number(find("speed").value)));
  page.setSpeed(Number(find("speed").value));
  on("pause", "click", () => page.pause(!page.paused));
  on("restart", "click", () => {
    page.hand = null;
    page.open();
    page.pause(false);
  });
  on("another", "click", () => {
    page.set("seed", String(1n + BigInt(page.pairs.get("seed") ?? 1)));
    page.pause(false);
  });
  on("reset", "click", () => {
    page.pairs = new Map();
    page.hand = null;
    page.open();
  });
  for (const button of document.querySelectorAll("[data-mode]")) {
    button.addEventListener("click", () => page.drive(button.dataset.mode, Number(find("amplitude").value)));
  }
  on("amplitude", "input", () => {
    const amplitude = Number(find("amplitude").value);
    find("amplitude-text").textContent = amplitude.toFixed(2);
    if (page.hand) page.drive(page.hand[0], amplitude);
  });
  for (const button of document.querySelectorAll("[data-rotor]")) {
    button.addEventListener("click", () => {
      const { hand } = page;
      page.set("plant.rotor", button.dataset.rotor);
      if (hand) page.drive(...hand);
    });
  }
  on("copy", "click", async () => {
    await navigator.clipboard?.writeText(find("command").textContent);
    find("copy").textContent = "Copied";
    setTimeout(() => { find("copy").textContent = "Copy"; }, 1500);
  });
  addEventListener("hashchange", () => {
    if (location.hash.slice(1) === hashOf(page.pairs)) return;
    page.pairsBefore = new Map(page.pairs);
    page.pairs = pairsOf(location.hash);
    page.open();
  });
  addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target.closest("input, button, select, summary, a")) return;
    event.preventDefault();
    page.pause(!page.paused);
  });
}

// A button for each filter.
export function addFilters(page, choices) {
  for (const name of choices) {
    const label = document.createElement("label");
    const radio = Object.assign(document.createElement("input"), { type: "radio", name: "filter", value: name });
    radio.addEventListener("change", () => page.set("estimator.filter", name));
    label.append(radio, name === "best" ? "the best for these instruments" : name.replaceAll("_", " "));
    find("filter").append(label);
  }
}
