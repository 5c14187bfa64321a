// src/api.ts
var Refused = class extends Error {
  constructor(trouble2) {
    super(trouble2.message);
    this.trouble = trouble2;
  }
};
async function ask(path, init = {}) {
  let response;
  try {
    response = await fetch(path, init);
  } catch {
    throw new Refused({ message: "the program does not answer", hint: "Look whether it still runs in the terminal." });
  }
  if (!response.ok) {
    const trouble2 = await response.json().catch(() => ({ message: response.statusText, hint: "Reload the page." }));
    throw new Refused(trouble2);
  }
  return response;
}
async function told(path, init = {}) {
  return await (await ask(path, init)).json();
}
function post(path, body = {}) {
  return ask(path, { method: "POST", body: JSON.stringify(body) });
}
function wish(options, left_out = {}) {
  return post("/api/wishes", { options, left_out });
}

// src/dom.ts
function byId(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`no element ${id}`);
  return element;
}
function el(tag, properties = {}, ...content) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false) element.setAttribute(name, String(value));
  }
  for (const one of content) if (one) element.append(one);
  return element;
}
function firstSentence(text) {
  const stop = text.indexOf(". ");
  return stop < 0 ? text : text.slice(0, stop + 1);
}
function size(bytes) {
  const units = [[1e9, "GB"], [1e6, "MB"], [1e3, "kB"]];
  const unit = units.find(([one]) => bytes >= one);
  return unit ? `${(bytes / unit[0]).toFixed(1)} ${unit[1]}` : `${bytes} bytes`;
}

// src/choices.ts
var WORDS = {
  "projection.kind": "View",
  "projection.yaw": "Turn",
  "projection.pitch": "Tilt up",
  "projection.roll": "Roll",
  "projection.fov": "Field of view",
  "canvas.crop": "Crop",
  "canvas.fill": "Fill gaps",
  "canvas.scale": "Size",
  "exposure.enabled": "Even out exposure",
  "render.blend": "Blending",
  "stitch.method": "Method",
  "stitch.align": "Alignment by",
  "output.background": "Background",
  "output.jpeg_quality": "JPEG quality",
  "output.depth": "Bits",
  "output.alpha": "Transparency",
  "output.metadata": "What the file tells",
  "output.tiff_compression": "TIFF compression"
};
var GROUPS = [
  ["arrange", "View", true],
  ["compose", "Light and file", false],
  ["align", "Shape", false],
  ["match", "Matching", false],
  ["measure", "Reading", false]
];
var Choices = class {
  constructor(possible2, heard2) {
    this.heard = heard2;
    const form = byId("choices");
    form.addEventListener("submit", (event) => event.preventDefault());
    const known = new Set(GROUPS.map(([phase]) => phase));
    for (const [phase, title, open] of GROUPS) {
      const own = possible2.options.filter((option) => option.phase === phase || phase === "compose" && !known.has(option.phase));
      if (own.length === 0) continue;
      form.append(el("details", open ? { open: true } : {}, el("summary", {}, title), ...own.map((option) => this.field(option))));
    }
    form.append(el("p", { class: "small" }, "Shape, matching and reading take effect when you stitch again."));
  }
  fields = [];
  /** Shows the values that are wished for. */
  show(wishes) {
    for (const field of this.fields) field.show(wishes[field.option.name] ?? field.option.default);
  }
  /** The value of an option as it is shown. */
  static value(possible2, wishes, name) {
    const option = possible2.options.find((one) => one.name === name);
    return Number(wishes[name] ?? option?.default ?? 0);
  }
  field(option) {
    const id = `option-${option.name.replace(".", "-")}`;
    const words = WORDS[option.name] ?? option.name;
    const help = el("p", { class: "small", id: `${id}-help` }, firstSentence(option.meaning));
    const range = /^(-?[\d.]+) to (-?[\d.]+)$/.exec(option.allowed);
    if (option.default === "true" || option.default === "false") return this.toggle(option, id, words, help);
    if (option.choices.length > 0 && !option.choices.some((choice) => choice.name.startsWith("#"))) {
      return this.select(option, id, words, help);
    }
    if (range && option.unit === "degrees") return this.slider(option, id, words, help, Number(range[1]), Number(range[2]));
    return this.text(option, id, words, help, range !== null);
  }
  chosen(option, value) {
    this.heard.chosen({ [option.name]: value });
  }
  toggle(option, id, words, help) {
    const input = el("input", { id, type: "checkbox", "aria-describedby": help.id, onchange: () => this.chosen(option, String(input.checked)) });
    this.fields.push({ option, show: (value) => {
      input.checked = value === "true";
    } });
    return el("div", { class: "field" }, el("label", { class: "check" }, input, words), help);
  }
  select(option, id, words, help) {
    const select = el("select", { id, "aria-describedby": help.id, onchange: () => this.chosen(option, select.value) });
    for (const choice of option.choices) select.append(el("option", { value: choice.name }, choice.name));
    this.fields.push({
      option,
      show: (value) => {
        select.value = value;
        const choice = option.choices.find((one) => one.name === value);
        help.textContent = firstSentence(choice?.meaning ?? option.meaning);
      }
    });
    return el("div", { class: "field" }, el("label", { for: id }, words), select, help);
  }
  slider(option, id, words, help, min, max) {
    const shown = el("input", { id: `${id}-number`, type: "number", min, max, step: "any", "aria-label": `${words} in degrees` });
    const slider = el("input", { id, type: "range", min, max, step: 0.5, "aria-describedby": help.id });
    slider.addEventListener("input", () => {
      shown.value = slider.value;
      this.heard.trying({ [option.name]: slider.value });
    });
    slider.addEventListener("change", () => this.chosen(option, slider.value));
    shown.addEventListener("change", () => this.chosen(option, shown.value || option.default));
    this.fields.push({ option, show: (value) => {
      slider.value = value;
      shown.value = String(Math.round(Number(value) * 100) / 100);
    } });
    return el("div", { class: "field" }, el("label", { for: id }, words), el("div", { class: "row" }, slider, shown, el("span", { class: "unit" }, "°")), help);
  }
  text(option, id, words, help, isNumber) {
    const input = el("input", { id, type: isNumber ? "number" : "text", step: "any", "aria-describedby": help.id });
    input.addEventListener("change", () => this.chosen(option, input.value.trim() || option.default));
    const choices2 = option.choices.filter((choice) => !choice.name.startsWith("#"));
    const list = choices2.length > 0 ? el("datalist", { id: `${id}-list` }, ...choices2.map((choice) => el("option", { value: choice.name }))) : null;
    if (list) input.setAttribute("list", list.id);
    this.fields.push({ option, show: (value) => {
      input.value = value;
    } });
    return el("div", { class: "field" }, el("label", { for: id }, words), input, list, help);
  }
};

// src/layers.ts
var SVG = "http://www.w3.org/2000/svg";
var Layers = class {
  constructor(possible2, trouble2) {
    this.trouble = trouble2;
    for (const { name, title } of possible2.layers) {
      const detail = el("div", { class: "layer-detail", role: "status" });
      const input = el("input", { type: "checkbox", name: "layer", value: name, onchange: () => this.choose(name, input.checked) });
      this.details.set(name, detail);
      this.panel.append(el("label", { class: "check" }, input, title), detail);
    }
    this.button.addEventListener("click", () => this.open(this.panel.hidden));
    this.panel.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      this.open(false);
      this.button.focus();
    });
  }
  button = byId("layers-button");
  panel = byId("layers-panel");
  chosen = /* @__PURE__ */ new Set();
  details = /* @__PURE__ */ new Map();
  under = null;
  shown = "";
  /** Draws what is chosen over this from now on. */
  over(under) {
    const same = under?.number === this.under?.number && under?.kind === this.under?.kind && under?.element === this.under?.element;
    this.button.disabled = under === null;
    if (under === null) this.open(false);
    if (same) return;
    this.under?.element.replaceChildren();
    this.under = under;
    this.shown = "";
    void this.draw();
  }
  open(isOpen) {
    this.panel.hidden = !isOpen;
    this.button.setAttribute("aria-expanded", String(isOpen));
  }
  choose(name, isChosen) {
    if (isChosen) this.chosen.add(name);
    else this.chosen.delete(name);
    void this.draw();
  }
  /** Fetches and shows the drawings; what was chosen otherwise, or lies over something else by then, is not shown. */
  async draw() {
    const { under } = this;
    const wanted = JSON.stringify([under?.kind, under?.number, [...this.chosen]]);
    if (wanted === this.shown) return;
    this.shown = wanted;
    const names = [...this.details.keys()].filter((name) => this.chosen.has(name));
    try {
      const asked = under === null ? [] : names.map((name) => told(`/api/${under.kind}/${under.number}/layers/${name}`));
      const layers2 = await Promise.all(asked);
      if (wanted !== this.shown) return;
      under?.element.replaceChildren(...layers2.flatMap((layer) => drawing(layer, under.kind)));
      for (const [name, detail] of this.details) {
        const layer = layers2[names.indexOf(name)];
        detail.replaceChildren(...layer ? described(layer) : []);
      }
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      if (wanted === this.shown) this.trouble(error);
    }
  }
};
function drawing(layer, kind) {
  if (layer.drawing === null) return [];
  const svg = document.importNode(new DOMParser().parseFromString(layer.drawing, "image/svg+xml").documentElement, true);
  if (kind === "preview") svg.setAttribute("preserveAspectRatio", "xMidYMid meet");
  return [svg];
}
function described(layer) {
  if (layer.drawing === null) return [el("p", { class: "small" }, "There is nothing of that to see here.")];
  const entries = layer.legend.map((one) => el("li", {}, swatch(one.color, one.dashes), one.words));
  const elsewhere = "Measured in the view that was stitched, drawn where this view shows it.";
  const note = layer.is_measured_elsewhere ? [el("p", { class: "small" }, elsewhere)] : [];
  return [...entries.length > 0 ? [el("ul", { class: "legend small" }, ...entries)] : [], ...note];
}
function swatch(color, dashes) {
  const svg = document.createElementNS(SVG, "svg");
  const line = document.createElementNS(SVG, "path");
  for (const [name, value] of [["viewBox", "0 0 38 12"], ["aria-hidden", "true"]]) svg.setAttribute(name, value);
  for (const [name, value] of [["d", "M1 6h36"], ["stroke", color], ["stroke-width", "6"], ["stroke-dasharray", dashes]]) {
    if (value !== "") line.setAttribute(name, value);
  }
  svg.append(line);
  return svg;
}

// src/paint.ts
var COLORS = { ignore: [214, 48, 49], keep: [39, 160, 90] };
var KEY_STEP = 0.02;
var Painting = class {
  constructor(trouble2) {
    this.trouble = trouble2;
    for (const brush of ["ignore", "keep", "erase"]) byId(`paint-${brush}`).addEventListener("click", () => this.take(brush));
    byId("paint-clear").addEventListener("click", () => {
      this.changed = true;
      this.context().clearRect(0, 0, this.canvas.width, this.canvas.height);
    });
    byId("paint-done").addEventListener("click", () => void this.done());
    this.byPointer();
    this.canvas.addEventListener("keydown", (event) => this.byKey(event));
  }
  dialog = byId("painting");
  canvas = byId("paint-canvas");
  picture = byId("paint-picture");
  brush = "ignore";
  photograph = null;
  full = { width: 0, height: 0 };
  at = { x: 0.5, y: 0.5 };
  changed = false;
  async open(photograph) {
    this.photograph = photograph;
    this.changed = false;
    byId("painting-title").textContent = photograph.name;
    const response = await ask(`/api/photographs/${photograph.number}/picture`);
    this.full = { width: Number(response.headers.get("x-width")), height: Number(response.headers.get("x-height")) };
    this.picture.src = URL.createObjectURL(await response.blob());
    await this.picture.decode();
    this.canvas.width = this.picture.naturalWidth;
    this.canvas.height = this.picture.naturalHeight;
    if (photograph.used_mask) await this.load(`use`, "ignore");
    if (photograph.kept_mask) await this.load(`keep`, "keep");
    this.dialog.showModal();
    this.canvas.focus();
  }
  context() {
    const context = this.canvas.getContext("2d", { willReadFrequently: true });
    if (!context) throw new Error("no canvas");
    return context;
  }
  /** Shows a mask that was painted before: black is ignored in one, white is kept in the other. */
  async load(kind, brush) {
    const blob = await (await ask(`/api/photographs/${this.photograph?.number}/mask/${kind}`)).blob();
    const { width, height } = this.canvas;
    const mask = await createImageBitmap(blob, { resizeWidth: width, resizeHeight: height });
    const scratch = new OffscreenCanvas(width, height).getContext("2d");
    if (!scratch) return;
    scratch.drawImage(mask, 0, 0);
    const data = scratch.getImageData(0, 0, width, height).data;
    const context = this.context();
    const painted = context.getImageData(0, 0, width, height);
    for (let at = 0; at < data.length; at += 4) {
      const white = (data[at] ?? 0) > 127;
      if (white === (brush === "keep")) painted.data.set([...COLORS[brush], 255], at);
    }
    context.putImageData(painted, 0, 0);
  }
  take(brush) {
    this.brush = brush;
    for (const one of ["ignore", "keep", "erase"]) byId(`paint-${one}`).setAttribute("aria-pressed", String(one === brush));
  }
  /** A stroke between two places, in shares of the picture. */
  stroke(from, to) {
    const { width, height } = this.canvas;
    const context = this.context();
    context.globalCompositeOperation = this.brush === "erase" ? "destination-out" : "source-over";
    context.strokeStyle = this.brush === "erase" ? "#000" : `rgb(${COLORS[this.brush].join(" ")})`;
    context.lineWidth = Number(byId("paint-size").value) / 100 * width;
    context.lineCap = "round";
    context.beginPath();
    context.moveTo(from.x * width, from.y * height);
    context.lineTo(to.x * width + 0.01, to.y * height);
    context.stroke();
    this.changed = true;
  }
  byPointer() {
    const { canvas } = this;
    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return { x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height };
    };
    let last = null;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      last = place(event);
      this.stroke(last, last);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      const next = place(event);
      this.stroke(last, next);
      last = next;
    });
    const end = () => {
      last = null;
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
  }
  byKey(event) {
    const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const move = by[event.key];
    if (!move && event.key !== " ") return;
    event.preventDefault();
    const from = this.at;
    const inside = (value) => Math.max(0, Math.min(1, value));
    if (move) this.at = { x: inside(from.x + move[0] * KEY_STEP), y: inside(from.y + move[1] * KEY_STEP) };
    if (event.key === " " || event.shiftKey) this.stroke(from, this.at);
    this.canvas.style.setProperty("--brush-x", `${this.at.x * 100}%`);
    this.canvas.style.setProperty("--brush-y", `${this.at.y * 100}%`);
  }
  async done() {
    const { photograph } = this;
    try {
      if (photograph && this.changed) {
        await this.send(photograph.number, "use", "ignore");
        await this.send(photograph.number, "keep", "keep");
      }
      this.dialog.close();
    } catch (error) {
      if (error instanceof Refused) this.trouble(error);
      else throw error;
    }
  }
  /** Sends what was painted with a brush, in the photograph's own size; nothing if nothing was. */
  async send(number, kind, brush) {
    const { width, height } = this.canvas;
    const painted = this.context().getImageData(0, 0, width, height);
    let any = false;
    for (let at = 0; at < painted.data.length; at += 4) {
      const own = (painted.data[at + 3] ?? 0) > 127 && (painted.data[at] ?? 0) > 127 === (brush === "ignore");
      any ||= own;
      const level = own === (brush === "keep") ? 255 : 0;
      painted.data.set([level, level, level, 255], at);
    }
    const before = brush === "ignore" ? this.photograph?.used_mask : this.photograph?.kept_mask;
    if (!any && !before) return;
    await ask(`/api/photographs/${number}/mask/${kind}`, { method: "PUT", body: any ? await this.inFull(painted) : null });
  }
  async inFull(painted) {
    const small = new OffscreenCanvas(painted.width, painted.height);
    small.getContext("2d")?.putImageData(painted, 0, 0);
    const full = new OffscreenCanvas(this.full.width, this.full.height);
    const context = full.getContext("2d");
    if (context) context.imageSmoothingEnabled = false;
    context?.drawImage(small, 0, 0, this.full.width, this.full.height);
    return full.convertToBlob({ type: "image/png" });
  }
};

// src/save.ts
var Saving = class {
  constructor(possible2, trouble2) {
    this.trouble = trouble2;
    const formats = possible2.extensions.split(/, | or /);
    byId("save-format").append(...formats.map((extension) => el("option", { value: extension }, extension)));
    const beside = possible2.side_outputs.map((one) => el("label", {}, el("input", { type: "checkbox", name: "beside", value: one.flag }), ` ${firstSentence(one.meaning)}`));
    byId("save-beside").append(...beside);
    byId("save-format").addEventListener("change", () => this.places());
    byId("save-go").addEventListener("click", () => void this.save());
  }
  dialog = byId("saving");
  asked = false;
  open(now2) {
    byId("save-where").hidden = now2.folder === null;
    byId("save-told").textContent = "";
    this.asked = false;
    this.show(now2);
    this.places();
    this.dialog.showModal();
  }
  show(now2) {
    const files = now2.exports.flatMap((one) => one.files.map((file, index) => {
      const said2 = `${file.name}, ${size(file.bytes)}`;
      const address = `/api/exports/${one.number}/${index}`;
      return el("li", {}, one.to_fetch ? el("a", { href: address, download: file.name }, said2) : `${said2}, in the folder`);
    }));
    const list = byId("save-files");
    const key = JSON.stringify(now2.exports.map((one) => one.number));
    if (list.dataset["key"] !== key) {
      list.dataset["key"] = key;
      list.replaceChildren(...files);
    }
    const busy = now2.work?.task === "export";
    byId("save-go").disabled = busy;
    if (busy) byId("save-told").textContent = "Writing …";
    else if (now2.trouble) byId("save-told").textContent = `${now2.trouble.message}. ${now2.trouble.hint}`;
    else if (this.asked) byId("save-told").textContent = "Done.";
  }
  /** A folder of tiles cannot be downloaded as one file: without a folder to put it into, there is none. */
  places() {
    const noFolder = byId("save-where").hidden;
    const tiles = byId("save-format").querySelector("option[value='.dzi']");
    if (tiles) tiles.disabled = noFolder;
    const fetch2 = this.dialog.querySelector("input[value=fetch]");
    const folder = this.dialog.querySelector("input[value=folder]");
    const isFolder = byId("save-format").value === ".dzi";
    if (fetch2) fetch2.disabled = isFolder;
    if (folder && isFolder) folder.checked = true;
    else if (fetch2 && noFolder) fetch2.checked = true;
  }
  async save() {
    const name = byId("save-name");
    if (!name.reportValidity()) return;
    const beside = [...this.dialog.querySelectorAll("input[name=beside]:checked")].map((one) => one.value);
    const into_folder = this.dialog.querySelector("input[value=folder]")?.checked ?? false;
    try {
      this.asked = true;
      await post("/api/exports", { name: name.value + byId("save-format").value, beside, into_folder });
    } catch (error) {
      this.asked = false;
      if (!(error instanceof Refused)) throw error;
      byId("save-told").textContent = `${error.trouble.message}. ${error.trouble.hint}`;
      this.trouble(error);
    }
  }
};
var Opening = class {
  constructor(possible2, trouble2) {
    this.trouble = trouble2;
    for (const id of ["choose", "choose-more"]) {
      const input = byId(id);
      input.accept = ["image/*", ...possible2.photographs].join(",");
      input.addEventListener("change", () => void this.take([...input.files ?? []]).then(() => {
        input.value = "";
      }));
    }
    const project = byId("choose-project");
    project.addEventListener("change", () => void this.take([...project.files ?? []]).then(() => {
      project.value = "";
    }));
    this.byDropping();
  }
  dialog = byId("opening");
  open(now2) {
    const inside = now2.folder?.inside ? `${now2.folder.inside}/` : "";
    const folders = (now2.folder?.folders ?? []).map((name) => this.choice(name, () => post("/api/folder", { folder: inside + name })));
    const back = now2.folder ? [this.choice("The folder of the beginning", () => post("/api/folder", { folder: "" }))] : [];
    const projects = (now2.folder?.projects ?? []).map((name) => this.choice(name, () => post("/api/project", { name })));
    const list = (title, items) => items.length > 0 ? [el("h3", {}, title), el("ul", { class: "picks" }, ...items)] : [];
    byId("opening-lists").replaceChildren(...list("Folders", [...back, ...folders]), ...list("Projects in this folder", projects));
    this.dialog.showModal();
  }
  /** Takes photographs, and a project after them. One that is refused does not keep the others out; the first such is told. */
  async take(files) {
    this.dialog.close();
    const isProject = (file) => file.name.toLowerCase().endsWith(".json");
    let first = null;
    for (const file of [...files.filter((one) => !isProject(one)), ...files.filter(isProject)]) {
      const address = isProject(file) ? "/api/project" : `/api/photographs?name=${encodeURIComponent(file.name)}`;
      try {
        await ask(address, { method: "PUT", body: file });
      } catch (error) {
        if (!(error instanceof Refused)) throw error;
        const { message, hint } = error.trouble;
        first ??= new Refused({ message: `${file.name}: ${message}`, hint });
      }
    }
    if (first) this.trouble(first);
  }
  choice(name, open) {
    const chosen = () => {
      this.dialog.close();
      open().catch((error) => {
        if (error instanceof Refused) this.trouble(error);
      });
    };
    return el("li", {}, el("button", { type: "button", class: "quiet", onclick: chosen }, name));
  }
  byDropping() {
    const veil = byId("dropping");
    document.addEventListener("dragover", (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      veil.hidden = false;
    });
    document.addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) veil.hidden = true;
    });
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      veil.hidden = true;
      void this.take([...event.dataTransfer?.files ?? []]);
    });
  }
};

// src/stage.ts
var KEY_DEGREES = 1;
var Stage = class {
  constructor(layers2, turned) {
    this.layers = layers2;
    this.turned = turned;
    for (const mode of ["look", "turn", "around"]) byId(mode).addEventListener("click", () => this.show(mode));
    byId("closer").addEventListener("click", () => this.zoom(1.4));
    byId("farther").addEventListener("click", () => this.zoom(1 / 1.4));
    byId("whole").addEventListener("click", () => {
      this.viewer?.viewport.goHome();
      this.sphere?.setHfov(100);
    });
    this.turnByDragging();
    this.picture.addEventListener("keydown", (event) => this.turnByKey(event));
  }
  picture = byId("preview");
  tilesElement = byId("tiles");
  sphereElement = byId("sphere");
  mode = "look";
  drawn = null;
  busy = false;
  waiting = null;
  viewer = null;
  tiles = null;
  sphere = null;
  overPreview = byId("layers");
  overTiles = null;
  get preview() {
    return this.drawn;
  }
  /** Nothing to show. */
  clear() {
    this.drawn = null;
    this.showTiles(null);
    this.picture.hidden = true;
    this.picture.removeAttribute("src");
    byId("tools").hidden = true;
    this.arrange();
  }
  /** Draws the panorama with these wishes on top; of many that come while one is drawn, the last is drawn next. */
  async draw(wishes) {
    if (this.busy) {
      this.waiting = wishes;
      return;
    }
    this.busy = true;
    try {
      const preview = await told("/api/preview", { method: "POST", body: JSON.stringify({ options: wishes }) });
      const blob = await (await ask(`/api/preview/${preview.number}`)).blob();
      const address = URL.createObjectURL(blob);
      const older = this.picture.src;
      this.picture.src = address;
      await this.picture.decode().catch(() => void 0);
      if (older.startsWith("blob:")) URL.revokeObjectURL(older);
      this.drawn = preview;
      this.picture.alt = `The panorama, ${preview.projection?.kind ?? "on its mesh"}`;
      this.picture.dataset["number"] = String(preview.number);
      byId("tools").hidden = false;
      this.arrange();
    } catch (error) {
      if (error instanceof Refused) this.turned.trouble(error);
      else throw error;
    } finally {
      this.busy = false;
    }
    const next = this.waiting;
    this.waiting = null;
    if (next) await this.draw(next);
  }
  /** Shows tiles of the whole panorama, or the preview where there are none. */
  showTiles(number) {
    if (number === this.tiles) return;
    this.tiles = number;
    this.viewer?.destroy();
    this.viewer = null;
    this.overTiles = null;
    if (number !== null) {
      const over = el("div", { class: "layers" });
      const viewer = OpenSeadragon({
        element: this.tilesElement,
        tileSources: `/api/tiles/${number}/panorama.dzi`,
        drawer: "canvas",
        showNavigationControl: false,
        // A panorama may be looked at pixel by pixel, but not more.
        maxZoomPixelRatio: 2,
        visibilityRatio: 0.8,
        animationTime: 0.4,
        gestureSettingsMouse: { clickToZoom: false, dblClickToZoom: true }
      });
      viewer.addOnceHandler("open", () => viewer.addOverlay({ element: over, location: viewer.world.getItemAt(0).getBounds() }));
      this.viewer = viewer;
      this.overTiles = over;
    }
    this.arrange();
  }
  show(mode) {
    this.mode = mode;
    this.arrange();
    if (mode === "turn") this.picture.focus();
  }
  /** Shows what the mode asks for and there is. */
  arrange() {
    const sphere = this.drawn?.projection?.sphere ?? null;
    const canTurn = Boolean(this.drawn?.projection);
    const around = sphere !== null && sphere.projection === "equirectangular";
    if (this.mode === "around" && !around || this.mode === "turn" && this.drawn && !canTurn) this.mode = "look";
    byId("around").hidden = !around;
    byId("turn").disabled = !canTurn;
    for (const mode of ["look", "turn", "around"]) byId(mode).setAttribute("aria-pressed", String(mode === this.mode));
    const showTiles = this.mode === "look" && this.viewer !== null;
    this.tilesElement.hidden = !showTiles;
    this.sphereElement.hidden = this.mode !== "around";
    this.picture.hidden = !this.drawn || showTiles || this.mode === "around";
    this.picture.classList.toggle("turning", this.mode === "turn");
    if (this.mode === "turn") this.picture.tabIndex = 0;
    else this.picture.removeAttribute("tabindex");
    for (const id of ["closer", "farther", "whole"]) byId(id).disabled = !(showTiles || this.mode === "around");
    this.overPreview.hidden = this.picture.hidden;
    if (showTiles && this.overTiles && this.tiles !== null) this.layers.over({ kind: "tiles", number: this.tiles, element: this.overTiles });
    else if (!this.picture.hidden && this.drawn) this.layers.over({ kind: "preview", number: this.drawn.number, element: this.overPreview });
    else this.layers.over(null);
    this.lookAround();
  }
  lookAround() {
    this.sphere?.destroy();
    this.sphere = null;
    const { drawn } = this;
    if (this.mode !== "around" || !drawn?.projection?.sphere) return;
    const { full_width, full_height, top } = drawn.projection.sphere;
    const height = 180 * drawn.canvas.height / full_height;
    this.sphere = pannellum.viewer("sphere", {
      type: "equirectangular",
      panorama: `/api/preview/${drawn.number}`,
      autoLoad: true,
      haov: 360 * drawn.canvas.width / full_width,
      vaov: height,
      vOffset: 90 - 180 * top / full_height - height / 2,
      hfov: 100,
      showControls: false
    });
  }
  zoom(factor) {
    this.viewer?.viewport.zoomBy(factor).applyConstraints();
    if (this.sphere) this.sphere.setHfov(this.sphere.getHfov() / factor);
  }
  /** Degrees of the panorama's middle for a pixel of the screen. */
  degreesPerPixel() {
    const { drawn, picture } = this;
    if (!drawn?.projection) return 0;
    const shown = Math.min(picture.clientWidth / drawn.canvas.width, picture.clientHeight / drawn.canvas.height);
    return 180 / Math.PI / (drawn.projection.px_per_radian * shown);
  }
  turnByDragging() {
    const { picture } = this;
    let from = null;
    const wishes = (event) => {
      if (!from) return {};
      const { degrees } = from;
      return turnedTo(from.yaw - (event.clientX - from.x) * degrees, from.pitch + (event.clientY - from.y) * degrees);
    };
    picture.addEventListener("pointerdown", (event) => {
      if (this.mode !== "turn") return;
      picture.setPointerCapture(event.pointerId);
      from = { x: event.clientX, y: event.clientY, degrees: this.degreesPerPixel(), ...this.turned.now() };
    });
    picture.addEventListener("pointermove", (event) => {
      if (from) this.turned.trying(wishes(event));
    });
    picture.addEventListener("pointerup", (event) => {
      if (from) this.turned.chosen(wishes(event));
      from = null;
    });
    picture.addEventListener("pointercancel", () => {
      from = null;
    });
  }
  turnByKey(event) {
    const step = event.shiftKey ? 10 * KEY_DEGREES : KEY_DEGREES;
    const by = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
    const [yaw, pitch] = by[event.key] ?? [0, 0];
    if (this.mode !== "turn" || yaw === 0 && pitch === 0) return;
    event.preventDefault();
    const now2 = this.turned.now();
    this.turned.chosen(turnedTo(now2.yaw + yaw, now2.pitch + pitch));
  }
};
function turnedTo(yaw, pitch) {
  const around = ((yaw + 180) % 360 + 360) % 360 - 180;
  const up = Math.max(-90, Math.min(90, pitch));
  return { "projection.yaw": around.toFixed(2), "projection.pitch": up.toFixed(2) };
}
async function cutTiles() {
  return (await post("/api/tiles").catch(() => null))?.status === 202;
}

// src/strip.ts
var Strip = class {
  constructor(asked) {
    this.asked = asked;
  }
  shown = "";
  show(now2) {
    const key = JSON.stringify([now2.photographs, now2.folder?.inside]);
    if (key === this.shown) return;
    this.shown = key;
    const strip2 = byId("strip");
    const focused = document.activeElement?.id ?? "";
    const groups = grouped(now2.photographs);
    strip2.replaceChildren(...groups.map((group) => this.group(group, now2)));
    if (focused.startsWith("photograph-")) document.getElementById(focused)?.focus();
  }
  group(group, now2) {
    const others = now2.photographs.filter((one) => !group.photographs.includes(one));
    const instead = group.together ? el("button", { type: "button", class: "quiet", onclick: () => this.asked.leaveOut(Object.fromEntries(now2.photographs.map((one) => [one.number, others.includes(one)]))) }, "Stitch these instead") : null;
    const items = group.photographs.map((photograph) => this.item(photograph, now2));
    return el("section", { class: "group" }, el("h2", {}, group.title, instead), el("ul", {}, ...items));
  }
  item(photograph, now2) {
    const { number, name, verdict } = photograph;
    const address = `/api/photographs/${number}/thumbnail?of=${encodeURIComponent(`${now2.folder?.inside ?? ""}/${name}`)}`;
    const picture = el("img", { src: address, alt: "", loading: "lazy", width: 132, height: 99 });
    const said2 = photograph.left_out ? "left out by you" : verdict?.reason ?? "";
    const masked = photograph.used_mask || photograph.kept_mask ? el("span", { class: "badge" }, "painted") : null;
    const leave = el(
      "button",
      { type: "button", id: `photograph-${number}-leave`, class: "quiet", "aria-label": `${photograph.left_out ? "Take in" : "Leave out"} ${name}`, onclick: () => this.asked.leaveOut({ [number]: !photograph.left_out }) },
      photograph.left_out ? "Take in" : "Leave out"
    );
    const paint = el("button", { type: "button", id: `photograph-${number}-paint`, class: "quiet", "aria-label": `Paint on ${name}`, onclick: () => this.asked.paint(photograph) }, "Paint");
    const isOut = photograph.left_out || verdict !== null && !verdict.used;
    return el(
      "li",
      isOut ? { class: "out" } : {},
      el("div", { class: "thumbnail" }, picture, masked),
      el("p", { class: "name", title: name }, name),
      said2 ? el("p", { class: "small" }, said2, verdict?.hint && !photograph.left_out ? ` ${verdict.hint}` : "") : null,
      el("div", { class: "buttons" }, leave, paint)
    );
  }
};
function grouped(photographs) {
  const stitched = photographs.some((one) => one.verdict);
  if (!stitched) {
    const title = photographs.length === 1 ? "1 photograph" : `${photographs.length} photographs`;
    return photographs.length > 0 ? [{ title, photographs, together: false }] : [];
  }
  const used = photographs.filter((one) => one.verdict?.used);
  const rest = photographs.filter((one) => !one.verdict?.used);
  const byGroup = /* @__PURE__ */ new Map();
  for (const one of rest) {
    const group = one.verdict?.group;
    if (group !== null && group !== void 0) byGroup.set(group, [...byGroup.get(group) ?? [], one]);
  }
  const groups = [{ title: `In the panorama: ${used.length}`, photographs: used, together: false }];
  const together = [...byGroup.values()].filter((group) => group.length > 1);
  for (const group of together) groups.push({ title: `These ${group.length} belong together`, photographs: group, together: true });
  const alone = rest.filter((one) => !together.some((group) => group.includes(one)));
  if (alone.length > 0) groups.push({ title: `Not in it: ${alone.length}`, photographs: alone, together: false });
  return groups;
}

// src/main.ts
var TILES_AFTER = 1500;
var AGAIN_AFTER = 2e3;
var STAGES = {
  source: "Opening the photographs",
  decoding: "Reading the photographs",
  features: "Finding what can be recognized",
  lines: "Finding lines",
  measure: "Looking at the photographs",
  pairing: "Finding neighbors",
  matching: "Comparing photographs",
  cameras: "Finding out where the cameras looked",
  mesh: "Fitting the photographs",
  exposure: "Evening out the light",
  seam: "Finding seams",
  render: "Putting the panorama together",
  output: "Writing"
};
var TASKS = { stitch: "Stitching", tiles: "Making the whole panorama", export: "Saving", reopen: "Opening" };
var now = null;
var drawnFor = "";
var tilesAskedFor = "";
var tilesTimer;
var said = null;
function trouble(refused) {
  said = refused.trouble;
  if (now) tell(now);
}
function doing(asked) {
  said = null;
  asked.catch((error) => {
    if (!(error instanceof Refused)) throw error;
    trouble(error);
    if (now) choices.show(now.wishes);
  });
}
var possible = await told("/api/options");
var heard = {
  trying: (wishes) => {
    if (now?.stitched) void stage.draw(wishes);
  },
  chosen: (wishes) => doing(wish(wishes))
};
var choices = new Choices(possible, heard);
var layers = new Layers(possible, trouble);
var stage = new Stage(layers, {
  ...heard,
  trouble,
  now: () => {
    const wishes = now?.wishes ?? {};
    return { yaw: Choices.value(possible, wishes, "projection.yaw"), pitch: Choices.value(possible, wishes, "projection.pitch") };
  }
});
var painting = new Painting(trouble);
var strip = new Strip({
  leaveOut: (numbers) => doing(wish({}, numbers)),
  paint: (photograph) => doing(painting.open(photograph))
});
var saving = new Saving(possible, trouble);
var opening = new Opening(possible, trouble);
byId("stitch").addEventListener("click", () => doing(post("/api/stitch")));
byId("stop").addEventListener("click", () => doing(post("/api/stop")));
byId("undo").addEventListener("click", () => doing(post("/api/undo")));
byId("redo").addEventListener("click", () => doing(post("/api/redo")));
byId("save").addEventListener("click", () => {
  if (now) saving.open(now);
});
byId("open").addEventListener("click", () => {
  if (now) opening.open(now);
});
document.addEventListener("keydown", (event) => {
  const typing = event.target instanceof HTMLInputElement && ["text", "number"].includes(event.target.type);
  if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || typing) return;
  event.preventDefault();
  doing(post(event.shiftKey ? "/api/redo" : "/api/undo"));
});
function tell(state) {
  const lines = [];
  const problem = said ?? state.trouble;
  if (problem) lines.push(el("p", { class: "trouble" }, el("strong", {}, `${problem.message}. `), problem.hint));
  if (state.stitched?.stale) lines.push(el("p", { class: "note" }, "Stitch again to see these changes."));
  const warnings = [...state.stitched?.warnings ?? []];
  if (warnings.length > 0) {
    const list = warnings.map((one) => el("li", {}, el("strong", {}, one.subject), ` ${one.message}. ${one.hint}`));
    const title = warnings.length === 1 ? "1 thing to look at" : `${warnings.length} things to look at`;
    lines.push(el("details", {}, el("summary", {}, title), el("ul", {}, ...list)));
  }
  const judged = Object.entries(state.stitched?.judgement ?? {}).filter(([, verdict]) => verdict);
  if (judged.length > 0) lines.push(el("p", { class: "small" }, judged.map(([what, verdict]) => `${what}: ${verdict?.replaceAll("-", " ")}`).join(" · ")));
  const panel = byId("told");
  const text = lines.map((line) => line.textContent).join("|");
  if (panel.dataset["text"] === text) return;
  panel.dataset["text"] = text;
  panel.replaceChildren(...lines);
}
function showWork(state) {
  const { work } = state;
  byId("work").hidden = !work;
  byId("work").classList.toggle("beside", work?.task === "tiles" || work?.task === "export");
  if (!work) return;
  const running = work.stages.findLast((stage2) => !stage2.finished);
  const words = running ? STAGES[running.name] ?? running.name : TASKS[work.task];
  byId("work-words").textContent = work.stopping ? "Stopping …" : `${words} …`;
  const bar = byId("work-bar");
  if (running && running.total > 0) bar.value = Math.min(1, running.done / running.total);
  else bar.removeAttribute("value");
}
function showPanorama(state) {
  const { stitched } = state;
  byId("empty").hidden = state.photographs.length > 0;
  if (!stitched) {
    stage.clear();
    drawnFor = "";
    return;
  }
  const wanted = JSON.stringify([stitched.number, state.wishes]);
  if (wanted !== drawnFor) {
    drawnFor = wanted;
    tilesAskedFor = "";
    void stage.draw({});
  }
  cutTilesSoon(state, wanted);
  stage.showTiles(state.tiles);
}
function cutTilesSoon(state, wanted) {
  if (state.work && state.work.task !== "tiles") tilesAskedFor = "";
  if (state.work || state.tiles !== null || wanted === tilesAskedFor) return;
  tilesAskedFor = wanted;
  clearTimeout(tilesTimer);
  tilesTimer = setTimeout(async () => {
    const begun = now !== null && now.tiles === null && !now.work && await cutTiles();
    if (!begun) tilesAskedFor = "";
  }, TILES_AFTER);
}
function show(state) {
  const { stitched } = state;
  byId("place").textContent = state.folder?.name ?? "";
  byId("undo").disabled = !state.can_undo;
  byId("redo").disabled = !state.can_redo;
  byId("save").disabled = !stitched;
  const button = byId("stitch");
  button.disabled = state.photographs.length === 0 || state.work !== null && state.work.task !== "tiles";
  button.textContent = stitched ? "Stitch again" : "Stitch";
  button.classList.toggle("main", !stitched || stitched.stale);
  choices.show(state.wishes);
  strip.show(state);
  saving.show(state);
  tell(state);
  showWork(state);
  showPanorama(state);
}
var after = 0;
for (; ; ) {
  try {
    now = await told(`/api/news?after=${after}`);
    after = now.news;
    show(now);
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
    said = error.trouble;
    if (now) tell(now);
    await new Promise((resolve) => setTimeout(resolve, AGAIN_AFTER));
  }
}
