// What a visitor of the page does and sees, for its tests.
globalThis.visitor = (() => {
  const data = document.body.dataset;
  const find = (id) => document.getElementById(id);
  const pause = (ms) => new Promise((done) => { setTimeout(done, ms); });
  const count = (name) => Number(data[name] ?? 0);

  async function until(holds, what = String(holds), limitMs = 20000) {
    const begun = performance.now();
    while (!holds()) {
      if (performance.now() - begun > limitMs) {
        throw new Error(`it never comes: ${what}; ${find("refused").textContent}`);
      }
      await pause(4);
    }
  }

  const pictures = async (number) => {
    for (let picture = 0; picture < number; picture += 1) await new Promise(requestAnimationFrame);
  };
  const moves = () => until(() => count("opened") > 0 && Number(data.t) > 0, "first motion");

  function speed(power) {
    find("speed").value = power;
    find("speed").dispatchEvent(new Event("input"));
  }

  function target(degrees) {
    find("target").value = degrees;
    find("move").requestSubmit();
  }

  // What is said of the end of the move to a target. `forget` comes before what begins the move.
  const forget = () => { find("said").textContent = ""; };
  async function said(target) {
    await until(() => find("said").textContent.startsWith(`Target ${target}°: `), `the end of the move to ${target}`);
    return find("said").textContent;
  }

  // Does something that opens a run or is refused; the refusal, or nothing.
  async function asked(action) {
    const [opened, refused] = [count("opened"), count("refused")];
    action();
    await until(() => count("opened") > opened || count("refused") > refused, "an answer");
    if (count("refused") > refused) return find("refused").textContent;
    await until(() => Number(data.t) > 0, "motion");
    return "";
  }

  // Does something while an answer is on its way: right after the page has asked for more motion.
  function meanwhile(action) {
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function post(message, ...others) {
      postMessage.call(this, message, ...others);
      if (message.kind !== "run") return;
      Worker.prototype.postMessage = postMessage;
      action();
    };
  }

  async function everySlider(ofHub) {
    const [problems, part] = [[], ofHub ? "#group-hub" : "details:not(#group-hub)"];
    let tried = 0;
    speed(-3);
    for (const row of document.querySelectorAll(`${part} .setting`)) {
      const slider = row.querySelector("input[type=range]");
      if (!slider) continue;
      const { key } = row.dataset;
      for (const end of [slider.min, slider.max]) {
        tried += 1;
        try {
          const refusal = await asked(() => {
            slider.value = end;
            slider.dispatchEvent(new Event("input"));
          });
          // Bounds that depend on other keys are refused with the bounds of the present.
          const told = refusal.includes(key) || refusal.includes("is outside its bounds");
          if (refusal && !told) problems.push(`${key} at ${end}: ${refusal}`);
        } catch (error) {
          problems.push(`${key} at ${end}: ${error.message}`);
        }
      }
      const undo = row.querySelector(".undo");
      if (!undo.hidden) await asked(() => undo.click());
    }
    return { tried, problems };
  }

  async function everyFault() {
    const [made, problems] = [[], []];
    speed(-2);
    for (const button of document.querySelectorAll("[data-fault]:enabled")) {
      const name = button.dataset.fault;
      const refused = count("refused");
      button.click();
      const word = name.replace("mark:", "mark1:");
      if (!location.hash.includes(word)) problems.push(`${name} is not in the address: ${location.hash}`);
      const from = Number(data.t);
      await until(() => Number(data.t) > from + 2e-4, `motion with ${name}`);
      if (count("refused") > refused) problems.push(`${name}: ${find("refused").textContent}`);
      if (button.getAttribute("aria-pressed") === "true") {
        button.click();
        if (button.getAttribute("aria-pressed") === "true") problems.push(`${name} does not end`);
      }
      made.push(name);
    }
    const opened = count("opened");
    find("restart").click();
    await until(() => count("opened") > opened && Number(data.t) > 0, "the same from the start");
    return { made, problems };
  }

  async function healthOfALostCamera() {
    document.querySelector("[data-fault='camera:lost']").click();
    const health = find("fact-health");
    await until(() => health.textContent.startsWith("unusable"), "an estimate that is unusable");
    return health.textContent;
  }

  async function canvasesChange() {
    const before = ["top", "side", "angle"].map((id) => find(id).toDataURL());
    await pictures(30);
    return ["top", "side", "angle"].every((id, number) => find(id).toDataURL() !== before[number]);
  }

  // Memory of the computing after so many pictures, and rows in a history that was given more than it holds.
  async function memoryAfter(few, many) {
    const worker = new Worker("worker.js", { type: "module" });
    const answers = (number, requests) => new Promise((done) => {
      let left = number;
      worker.onmessage = ({ data: said }) => {
        left -= 1;
        if (left === 0) done(said);
      };
      requests();
    });
    await answers(1, () => {});
    await answers(1, () => worker.postMessage({ kind: "open", scene: "" }));
    const run = (number) => answers(number, () => {
      for (let picture = 0; picture < number; picture += 1) {
        worker.postMessage({ kind: "run", seconds: picture % 100 ? 2e-5 : 2e-3 });
      }
    });
    const before = (await run(few)).memory;
    const after = (await run(many - few)).memory;
    worker.terminate();
    const { History } = await import("./history.js");
    const history = new History(["t", "value"], 1000);
    for (let row = 0; row < 1e5; row += 1) history.push([row, row], [1]);
    return { before, after, rows: history.length };
  }

  const nameless = () => [...document.querySelectorAll("button, input, select, canvas, [role]")]
    .filter((element) => element.checkVisibility())
    .filter((element) => !(element.textContent.trim() || element.ariaLabel || element.labels?.length
      || element.getAttribute("aria-labelledby")))
    .map((element) => element.outerHTML).join(" ");

  return {
    until, pictures, moves, speed, target, forget, said, asked, meanwhile, everySlider, everyFault,
    healthOfALostCamera, canvasesChange, memoryAfter, nameless,
    loaded: () => performance.getEntriesByType("resource").map((entry) => entry.name)
      .filter((name) => !name.startsWith("data:")),
    cutTexts: () => [...document.querySelectorAll("canvas")].map((canvas) => canvas.dataset.clipped ?? "").join(""),
    shown: (keys) => keys.map((key) => `[data-key="${key}"] input[type=number]`)
      .map((input) => document.querySelector(input).value).join(" "),
  };
})();
0;
