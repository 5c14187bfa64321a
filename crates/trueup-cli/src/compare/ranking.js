const store = `trueup-ranking-${data.comparison}`;
const letterOf = (position) => String.fromCharCode(65 + position);

/** The entry behind a veiled name: its bytes in hexadecimal digits, the last first. */
function unveil(key) {
  const bytes = (key.match(/../g) || []).map((digits) => parseInt(digits, 16)).reverse();
  return new TextDecoder().decode(new Uint8Array(bytes));
}

/** Numbers in 0..1 from a text: the same text, the same numbers (FNV-1a, then the output function of SplitMix32). */
function numbersFrom(text) {
  let state = 0x811c9dc5;
  for (const letter of text) state = Math.imul(state ^ letter.codePointAt(0), 0x01000193);
  return () => {
    state = (state + 0x9e3779b9) | 0;
    let z = Math.imul(state ^ (state >>> 16), 0x21f0aaad);
    z = Math.imul(z ^ (z >>> 15), 0x735a2d97);
    return ((z ^ (z >>> 15)) >>> 0) / 4294967296;
  };
}

function shuffled(items, random) {
  const order = [...items];
  for (let last = order.length - 1; last > 0; last--) {
    const other = Math.floor(random() * (last + 1));
    [order[last], order[other]] = [order[other], order[last]];
  }
  return order;
}

function readAnswers() {
  try {
    const kept = JSON.parse(memory.get(store));
    return Array.isArray(kept) ? kept : [];
  } catch { return []; }
}

const gaze = new Gaze();
const aspects = data.panoramas.map(({ width, height }) => width / height).sort((one, two) => one - two);
const view = new View(gaze, Math.max(1.2, Math.min(3, aspects[Math.floor(aspects.length / 2)])), "The panorama: plus and minus zoom");
let answers = readAnswers();
let order = [];
let seen = 0;
let ranks = [];

/** Shows one panorama. */
function see(position) {
  seen = (position + order.length) % order.length;
  view.planes.forEach(({ element }, index) => element.classList.toggle("away", index !== seen));
  [...byId("letters").children].forEach((button, index) => button.setAttribute("aria-pressed", String(index === seen)));
  [...byId("choices").children].forEach((choice, index) => choice.classList.toggle("seen", index === seen));
}

/** A rank belongs to one panorama: whichever had it gives it up. */
function rank(position, value) {
  ranks = ranks.map((other, index) => (index === position ? value : other === value ? null : other));
  for (const input of byId("choices").querySelectorAll("input")) {
    input.checked = ranks[Number(input.dataset.position)] === Number(input.value);
  }
  tell();
}

function tell() {
  const missing = order.map((_, index) => index).filter((index) => !ranks[index]).map(letterOf);
  byId("save").disabled = missing.length > 0;
  byId("missing").textContent = missing.length ? `still without a rank: ${missing.join(", ")}` : "";
  byId("count").textContent = answers.length === 1 ? "1 ranking" : `${answers.length} rankings`;
  for (const id of ["download", "copy", "remove"]) byId(id).disabled = answers.length === 0;
}

function choice({ file }, position) {
  const letter = letterOf(position);
  const inputs = order.map((_, index) => make("label", null,
    make("input", { type: "radio", name: `rank-${position}`, value: index + 1, "data-position": position, onchange: () => rank(position, index + 1) }),
    ` ${index + 1}`));
  return make("fieldset", null, make("legend", null, `Panorama ${letter}`),
    make("button", { type: "button", "aria-label": `Show panorama ${letter}`, onclick: () => see(position) }, make("img", { src: file, alt: "" })),
    make("div", { class: "row" }, "Rank", ...inputs));
}

/** A new participant: another order, no ranks. */
function begin() {
  order = shuffled(data.panoramas, numbersFrom(`${data.comparison} ${answers.length}`));
  ranks = order.map(() => null);
  view.clear();
  order.forEach(({ file, width, height }, position) => {
    const box = { left: 0, top: 0, width, height };
    const image = make("img", { src: file, alt: `Panorama ${letterOf(position)}`, draggable: "false" });
    view.add(make("div", { class: "plane" }, image), box, box);
  });
  byId("letters").replaceChildren(...order.map((_, position) =>
    make("button", { type: "button", onclick: () => see(position) }, `${letterOf(position)} `, make("kbd", null, String(position + 1)))));
  byId("choices").replaceChildren(...order.map(choice));
  byId("participant").value = "";
  gaze.reset();
  see(0);
  tell();
}

function newId() {
  const digits = crypto.getRandomValues(new Uint32Array(3));
  return [...digits].map((one) => one.toString(16).padStart(8, "0")).join("");
}

function save(event) {
  event.preventDefault();
  const names = order.map(({ key }) => unveil(key));
  const ranking = names.map((name, index) => [ranks[index], name]).sort((one, two) => one[0] - two[0]).map(([, name]) => name);
  const participant = byId("participant").value.trim();
  answers.push({ id: newId(), participant, finished: new Date().toISOString(), shown: names, ranking });
  const kept = memory.set(store, JSON.stringify(answers));
  begin();
  byId("told").textContent = kept ? "Thank you, it is saved." : "Saved until this page is closed: download it before.";
  scrollTo({ top: 0 });
}

const results = () => `${JSON.stringify({ format: data.format, version: data.version, comparison: data.comparison, answers }, null, 2)}\n`;

function download() {
  const url = URL.createObjectURL(new Blob([results()], { type: "application/json" }));
  make("a", { href: url, download: `ranking-${data.comparison}.json` }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

async function copy() {
  try {
    await navigator.clipboard.writeText(results());
    byId("told").textContent = "Copied.";
  } catch {
    byId("told").textContent = "The browser does not allow copying here; download the results instead.";
  }
}

function removeAll() {
  if (!confirm(`Remove ${answers.length} rankings from this computer?`)) return;
  answers = [];
  memory.set(store, "[]");
  begin();
  byId("told").textContent = "";
}

byId("stage").append(view.element);
byId("form").addEventListener("submit", save);
byId("download").addEventListener("click", download);
byId("copy").addEventListener("click", copy);
byId("remove").addEventListener("click", removeAll);
document.addEventListener("keydown", (event) => {
  if (isTyping(event) && !(event.target instanceof HTMLInputElement && event.target.type === "radio")) return;
  const digit = Number(event.key);
  if (digit >= 1 && digit <= order.length) see(digit - 1);
  else if (event.key === "n") see(seen + 1);
  else if (event.key === "b") see(seen - 1);
  // Arrow keys move the page and choose ranks, unless the view has the focus.
  else if (event.key.startsWith("Arrow") || !gaze.key(event)) return;
  event.preventDefault();
});
begin();
themeButton(byId("theme"));
