const { comparison, drawings } = data;
const made = comparison.entries.map((entry, index) => ({ entry, drawing: drawings[index] })).filter((one) => one.entry.panorama);
const refused = comparison.entries.filter((entry) => entry.refusal);
// What no panorama could be measured by is not worth a row.
const figures = comparison.figures.filter(({ key }) => made.some(({ entry }) => key in entry.figures));
const fileName = (path) => path.split(/[/\\]/).pop();

/** Where a panorama lies about the middle of the reference photograph, in that photograph's pixels. */
function boxOf({ width, height, scale, anchor }) {
  return { left: -anchor[0] / scale, top: -anchor[1] / scale, width: width / scale, height: height / scale };
}

/** Which boxes are about as large as the smallest: some methods stretch the borders without end. */
function alike(boxes) {
  const areas = boxes.map((box) => box.width * box.height);
  return boxes.filter((_, index) => areas[index] <= 2.5 * Math.min(...areas));
}

/** What holds all boxes that are alike. */
function commonFrame(boxes) {
  const usual = alike(boxes);
  const least = (value) => Math.min(...usual.map(value));
  const most = (value) => Math.max(...usual.map(value));
  const [left, top] = [least((box) => box.left), least((box) => box.top)];
  return { left, top, width: most((box) => box.left + box.width) - left, height: most((box) => box.top + box.height) - top };
}

const boxes = made.map(({ entry }) => boxOf(entry.panorama));
const frame = commonFrame(boxes);
const aspect = Math.max(0.9, Math.min(3.6, frame.width / frame.height));
const gaze = new Gaze();
// Beside one that is much larger, the others would be seen small: then each fills its window.
let inRegister = alike(boxes).length === boxes.length;
const frameOf = (index) => (inRegister ? frame : boxes[index]);

/** A panorama with its lines and grids. */
function plane({ entry, drawing }) {
  const { file, width, height } = entry.panorama;
  const svg = makeSvg("svg", { viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: "none", "aria-hidden": "true" });
  const grids = makeSvg("g", { class: "grids" });
  drawing.grids.forEach(({ path }, index) => {
    grids.append(makeSvg("path", { d: path, style: `stroke: hsl(${Math.round(index * 137.5) % 360} 95% 62%)` }));
  });
  const lines = makeSvg("g", { class: "lines" });
  lines.append(makeSvg("path", { d: drawing.other, class: "other" }), makeSvg("path", { d: drawing.vertical, class: "vertical" }));
  svg.append(grids, lines);
  return make("div", { class: "plane" }, make("img", { src: file, alt: `Panorama by ${entry.name}`, draggable: "false" }), svg);
}

const shown = (figure, value) => (value === undefined ? "–" : value.toFixed(figure.decimals) + (figure.unit ? `\u202f${figure.unit}` : ""));
const isBest = (entry, figure) => entry.best.includes(figure.key);
const arrow = { lower: "↓", higher: "↑", neither: "" };

function figureList(entry) {
  const list = make("dl");
  for (const figure of figures.filter((one) => one.main)) {
    const value = shown(figure, entry.figures[figure.key]);
    const best = isBest(entry, figure);
    list.append(make("div", { class: best ? "best" : null, title: figure.meaning },
      make("dt", null, figure.name), make("dd", null, best ? `${value} ★` : value)));
  }
  return list;
}

function details(entry) {
  const list = make("ul");
  for (const override of entry.overrides) list.append(make("li", null, make("code", null, override)));
  for (const one of entry.diagnostics) {
    list.append(make("li", null, `${one.severity}: ${one.subject}: ${one.message}`, one.hint ? ` ${one.hint}` : ""));
  }
  if (entry.pixels_skipped) list.append(make("li", null, `overlaps not compared: ${entry.pixels_skipped}`));
  const seconds = Object.entries(entry.seconds).sort((one, two) => two[1] - one[1]);
  list.append(make("li", null, `seconds: ${seconds.map(([stage, value]) => `${stage} ${value.toFixed(2)}`).join(", ")}`));
  return make("details", null, make("summary", { class: "dim" }, "Options, findings, seconds"), list);
}

function card(one, index) {
  const { entry } = one;
  const { file, project, width, height, used } = entry.panorama;
  const view = new View(gaze, aspect, `Panorama by ${entry.name}: arrow keys move, plus and minus zoom`);
  view.add(plane(one), boxes[index], frameOf(index));
  return make("article", { class: "card" },
    make("header", null,
      make("h3", null, entry.name), make("p", { class: "meaning dim" }, entry.meaning)),
    view.element,
    make("footer", null, figureList(entry),
      make("div", { class: "row no-print" },
        make("button", { type: "button", onclick: () => flicker.open(index) }, "Flicker with this"),
        make("a", { href: file }, `${width} × ${height} px`),
        make("a", { href: project }, "project"),
        make("span", { class: "dim" }, `${used} photographs`)),
      details(entry)));
}

function table() {
  const head = make("tr", null, make("th", { scope: "col" }, ""), ...made.map(({ entry }) => make("th", { scope: "col" }, entry.name)));
  const rows = figures.map((figure) => make("tr", null,
    make("th", { scope: "row" }, `${figure.name}${figure.unit ? `, ${figure.unit}` : ""} ${arrow[figure.better]}`, make("small", null, figure.meaning)),
    ...made.map(({ entry }) => {
      const value = entry.figures[figure.key];
      const text = value === undefined ? "–" : value.toFixed(figure.decimals);
      return isBest(entry, figure) ? make("td", { class: "best" }, `★ ${text}`) : make("td", null, text);
    })));
  byId("figures").append(make("thead", null, head), make("tbody", null, ...rows));
}

function about() {
  const used = comparison.photographs.filter((one) => !one.reason).length;
  const parts = [
    `${used} of ${comparison.photographs.length} photographs`,
    `${made.length} ${made.length === 1 ? "panorama" : "panoramas"}`,
    refused.length ? `${refused.length} without a panorama` : null,
    `reference ${fileName(comparison.reference)}`,
    comparison.truth ? `measured against ${fileName(comparison.truth)}` : null,
    `${comparison.seconds.toFixed(1)} s`,
  ];
  byId("about").textContent = parts.filter(Boolean).join(" · ");
  document.title = `Panoramas compared: ${made.map(({ entry }) => entry.name).join(", ")}`;
  byId("to-ranking").hidden = !comparison.ranking;
  const list = byId("refused").querySelector("dl");
  for (const { name, meaning, refusal } of refused) {
    const subject = refusal.subject ? `${refusal.subject}: ` : "";
    list.append(make("dt", null, name), make("dd", { class: "dim" }, meaning),
      make("dd", null, `${refusal.not_applicable ? "not applicable" : "failed"}: ${subject}${refusal.reason}`), refusal.hint ? make("dd", { class: "dim" }, refusal.hint) : "");
  }
  byId("refused").hidden = refused.length === 0;
  byId("inputs").append(make("h2", null, "Photographs"), make("ul", null, ...comparison.photographs.map((one) =>
    make("li", null, one.path, one.reason ? `: left out: ${one.reason}` : ` (${one.width} × ${one.height} px)`))));
}

/** Two panoramas in turn at the same place. */
const flicker = {
  dialog: byId("flicker"), first: byId("first"), second: byId("second"), rate: byId("rate"),
  view: new View(gaze, aspect, "Two panoramas in turn: arrow keys move, plus and minus zoom", true),
  timer: null, seesSecond: false,
  setUp() {
    byId("flicker-view").append(this.view.element);
    byId("flicker-view").style.setProperty("--aspect", aspect);
    for (const select of [this.first, this.second]) {
      made.forEach(({ entry }, index) => select.append(make("option", { value: index }, entry.name)));
      select.addEventListener("change", () => this.lay());
    }
    this.second.value = String(Math.min(1, made.length - 1));
    this.rate.value = matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : 2;
    this.rate.addEventListener("input", () => { this.tellRate(); if (this.timer) this.start(); });
    byId("run").addEventListener("click", () => this.toggle());
    byId("switch").addEventListener("click", () => { this.stop(); this.swap(); });
    byId("close").addEventListener("click", () => this.dialog.close());
    this.dialog.addEventListener("close", () => this.stop());
    this.tellRate();
  },
  /** Opens with a panorama as B; A stays, unless it is the same. */
  open(index) {
    if (index !== undefined) {
      if (Number(this.first.value) === index) this.first.value = String(index === 0 ? Math.min(1, made.length - 1) : 0);
      this.second.value = String(index);
    }
    this.lay();
    this.dialog.showModal();
    this.view.element.focus();
  },
  /** Both lie in register, whatever the page shows. */
  lay() {
    const chosen = [this.first, this.second].map((select) => Number(select.value));
    const both = commonFrame(chosen.map((index) => boxes[index]));
    this.view.clear();
    for (const index of chosen) this.view.add(plane(made[index]), boxes[index], both);
    this.tell();
  },
  swap() {
    this.seesSecond = !this.seesSecond;
    this.tell();
  },
  tell() {
    this.view.planes.forEach(({ element }, position) => element.classList.toggle("away", (position === 1) !== this.seesSecond));
    const one = made[Number((this.seesSecond ? this.second : this.first).value)];
    byId("seen").replaceChildren(make("span", { class: this.seesSecond ? "letter b" : "letter" }, this.seesSecond ? "B" : "A"), one.entry.name);
  },
  tellRate() { byId("rate-value").textContent = Number(this.rate.value).toFixed(1); },
  start() {
    clearInterval(this.timer);
    this.timer = setInterval(() => this.swap(), 1000 / Number(this.rate.value));
    this.tellRun();
  },
  stop() {
    clearInterval(this.timer);
    this.timer = null;
    this.tellRun();
  },
  toggle() { if (this.timer) this.stop(); else this.start(); },
  tellRun() {
    byId("run").setAttribute("aria-pressed", String(Boolean(this.timer)));
    byId("run").replaceChildren(this.timer ? "Stop " : "Start ", make("kbd", null, "Space"));
  },
  faster(step) {
    this.rate.value = String(Number(this.rate.value) + step);
    this.rate.dispatchEvent(new Event("input"));
  },
};

/** A button that shows or hides something on all panoramas. */
function toggle(id, style) {
  const button = byId(id);
  button.addEventListener("click", () => {
    const on = document.body.classList.toggle(style);
    button.setAttribute("aria-pressed", String(on));
    byId("legend").hidden = !document.body.classList.contains("with-lines");
  });
}

function setRegister(wanted) {
  inRegister = wanted;
  byId("register").setAttribute("aria-pressed", String(inRegister));
  cardViews.forEach((view, index) => view.reframe(0, frameOf(index)));
}

function listen() {
  toggle("lines", "with-lines");
  toggle("grid", "with-grid");
  toggle("plumb", "with-plumb");
  byId("closer").addEventListener("click", () => gaze.zoomBy(1.25));
  byId("farther").addEventListener("click", () => gaze.zoomBy(0.8));
  byId("whole").addEventListener("click", () => gaze.reset());
  byId("register").addEventListener("click", () => setRegister(!inRegister));
  byId("open-flicker").addEventListener("click", () => flicker.open());
  byId("open-flicker").disabled = made.length < 2;
  byId("columns").addEventListener("change", (event) => {
    const style = byId("panoramas").style;
    style.setProperty("--columns", event.target.value || "auto-fill");
    style.setProperty("--least", event.target.value ? "0px" : "36rem");
  });
  gaze.views.push({ show: () => { byId("zoom").textContent = `${gaze.zoom.toFixed(2)} ×`; } });
  gaze.show();
  document.addEventListener("keydown", (event) => {
    if (isTyping(event)) return;
    const open = flicker.dialog.open;
    const act = {
      l: () => byId("lines").click(), g: () => byId("grid").click(), p: () => byId("plumb").click(), r: () => byId("register").click(),
      "+": () => gaze.zoomBy(1.25), "=": () => gaze.zoomBy(1.25), "-": () => gaze.zoomBy(0.8), "0": () => gaze.reset(),
      ...(open
        ? { " ": () => flicker.toggle(), x: () => byId("switch").click(), "[": () => flicker.faster(-0.5), "]": () => flicker.faster(0.5) }
        : { f: () => byId("open-flicker").click() }),
    }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    // A button that has the focus answers to the space bar itself.
    if (!act || (event.key === " " && event.target.matches("button"))) return;
    event.preventDefault();
    act();
  });
}

byId("panoramas").append(...made.map(card));
const cardViews = gaze.views.filter((view) => view instanceof View && view !== flicker.view);
table();
about();
flicker.setUp();
listen();
setRegister(inRegister);
themeButton(byId("theme"));
