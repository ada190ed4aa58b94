// A guided tour of eight steps: each sets the page so that there is something to see, and says what it is.

const STEPS = [
  {
    title: "A motor thrown round by its stator",
    text: "The ring of 8 mm below the rotor vibrates at 6.3 kHz. Nothing holds the rotor: four teeth throw it up, and "
      + "at each impact friction turns it a little. Here mode B drives it clockwise, some 30 times slower than it is.",
    show: (page) => page.present({ speed: -1.5, hand: ["b", 1], look: "above" }),
  },
  {
    title: "Five hundred times slower",
    text: "Now single impacts can be seen. Opposite teeth go up together, their neighbours down. Each red flash is an "
      + "impact with its impulse. The curves below are the heights of the teeth and of the rotor.",
    show: (page) => page.present({ speed: -2.7, hand: ["b", 1], look: "beside" }),
  },
  {
    title: "The other way round",
    text: "At 7.46 kHz the stator bends in another shape, mode C. Its teeth move forth while they are up, the other "
      + "way round: the rotor turns counter-clockwise, in small hops.",
    show: (page) => page.present({ speed: -2.6, hand: ["c", 1], look: "beside" }),
  },
  {
    title: "What the camera sees",
    text: "A camera of 10,000 frames a second follows two marks on the rotor. The lens shows one of them on the "
      + "camera's pixels of 2 µm: each dot is a frame, off by noise and rounding. So no single frame tells the angle.",
    show: (page) => page.present({ speed: -2, move: 90, look: "above" }),
  },
  {
    title: "A filter makes an estimate of it",
    text: "A Kalman filter weighs frames, impacts and its own model of the motor. The orange line is its estimate, the "
      + "band two standard deviations. Compare it with the truth, which only the simulation knows.",
    show: (page) => page.present({ speed: -1.3, move: 90, look: "loop" }),
  },
  {
    title: "The last milli-degrees",
    text: "The controller drives at full amplitude, stops before the target, and then gives single bursts, each as "
      + "short as the distance asks for. The middle plot follows down to the tolerance of a milli-degree.",
    show: (page) => page.present({ speed: -0.9, move: 37, look: "loop" }),
  },
  {
    title: "Something goes wrong",
    text: "During this move the camera goes blind for 20 ms. The filter says what it knows: the band grows, the health "
      + "changes and says why. When frames come again, the estimate finds back to the truth. Try other faults below.",
    show: (page) => page.present({ speed: -1.6, move: 90, faults: "camera:lost@0.05..0.07", look: "loop" }),
  },
  {
    title: "A rotor that tilts, and your own motor",
    text: "A real rotor tilts, rattles on its pin, and turns more slowly in mode B. Below are Table 1 and the hub as "
      + "sliders. What you change is in the address of this page, and in a command for a terminal.",
    show: (page) => page.present({ speed: -2.7, hand: ["b", 1], rotor: "tilting", look: "beside" }),
  },
];

export class Tour {
  constructor(page) {
    this.page = page;
    this.part = document.getElementById("tour");
    const on = (id, action) => document.getElementById(id).addEventListener("click", action);
    on("tour-start", () => this.go(0));
    on("tour-back", () => this.go(this.step - 1));
    on("tour-next", () => (this.step + 1 < STEPS.length ? this.go(this.step + 1) : this.end()));
    on("tour-end", () => this.end());
  }

  go(step) {
    this.step = Math.max(0, step);
    const { title, text, show } = STEPS[this.step];
    this.part.hidden = false;
    document.getElementById("tour-count").textContent = `Step ${this.step + 1} of ${STEPS.length}`;
    document.getElementById("tour-title").textContent = title;
    document.getElementById("tour-text").textContent = text;
    document.getElementById("tour-back").disabled = this.step === 0;
    document.getElementById("tour-next").textContent = this.step + 1 < STEPS.length ? "Next" : "Done";
    show(this.page);
    document.getElementById("tour-title").focus({ preventScroll: true });
  }

  end() {
    this.part.hidden = true;
    document.getElementById("tour-start").focus();
  }
}
