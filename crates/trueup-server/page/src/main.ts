// The page: what the server tells is shown, what the person wishes is sent.

import type { Possible, Told, Wishes } from "./api.js";
import { post, Refused, told, wish } from "./api.js";
import { Choices } from "./choices.js";
import { byId, el } from "./dom.js";
import { Layers } from "./layers.js";
import { Painting } from "./paint.js";
import { Opening, Saving } from "./save.js";
import { cutTiles, Stage } from "./stage.js";
import { Strip } from "./strip.js";

/** The whole panorama is made when nothing was wished for so long, in milliseconds. */
const TILES_AFTER = 1500;
/** After trouble, the server is asked again so much later, in milliseconds. */
const AGAIN_AFTER = 2000;

/** What the stages of the work are, for people. */
const STAGES: Record<string, string> = {
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
    output: "Writing",
};
const TASKS = { stitch: "Stitching", tiles: "Making the whole panorama", export: "Saving", reopen: "Opening" };

let now: Told | null = null;
let drawnFor = "";
let tilesAskedFor = "";
let tilesTimer: ReturnType<typeof setTimeout> | undefined;
let said: { message: string; hint: string } | null = null;

function trouble(refused: Refused): void {
    said = refused.trouble;
    if (now) tell(now);
}

/** Does what the person asked for, and says what is refused. */
function doing(asked: Promise<unknown>): void {
    said = null;
    asked.catch((error: unknown) => {
        if (!(error instanceof Refused)) throw error;
        trouble(error);
        if (now) choices.show(now.wishes);
    });
}

const possible = await told<Possible>("/api/options");
const heard = {
    trying: (wishes: Wishes) => { if (now?.stitched) void stage.draw(wishes); },
    chosen: (wishes: Wishes) => doing(wish(wishes)),
};
const choices = new Choices(possible, heard);
const layers = new Layers(possible, trouble);
const stage = new Stage(layers, {
    ...heard,
    trouble,
    now: () => {
        const wishes = now?.wishes ?? {};
        return { yaw: Choices.value(possible, wishes, "projection.yaw"), pitch: Choices.value(possible, wishes, "projection.pitch") };
    },
});
const painting = new Painting(trouble);
const strip = new Strip({
    leaveOut: (numbers) => doing(wish({}, numbers)),
    paint: (photograph) => doing(painting.open(photograph)),
});
const saving = new Saving(possible, trouble);
const opening = new Opening(possible, trouble);

byId("stitch").addEventListener("click", () => doing(post("/api/stitch")));
byId("stop").addEventListener("click", () => doing(post("/api/stop")));
byId("undo").addEventListener("click", () => doing(post("/api/undo")));
byId("redo").addEventListener("click", () => doing(post("/api/redo")));
byId("save").addEventListener("click", () => { if (now) saving.open(now); });
byId("open").addEventListener("click", () => { if (now) opening.open(now); });
document.addEventListener("keydown", (event) => {
    const typing = event.target instanceof HTMLInputElement && ["text", "number"].includes(event.target.type);
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || typing) return;
    event.preventDefault();
    doing(post(event.shiftKey ? "/api/redo" : "/api/undo"));
});

/** What is wrong or may be wanted, beside the choices. */
function tell(state: Told): void {
    const lines: HTMLElement[] = [];
    const problem = said ?? state.trouble;
    if (problem) lines.push(el("p", { class: "trouble" }, el("strong", {}, `${problem.message}. `), problem.hint));
    if (state.stitched?.stale) lines.push(el("p", { class: "note" }, "Stitch again to see these changes."));
    const warnings = [...(state.stitched?.warnings ?? [])];
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

function showWork(state: Told): void {
    const { work } = state;
    byId("work").hidden = !work;
    byId("work").classList.toggle("beside", work?.task === "tiles" || work?.task === "export");
    if (!work) return;
    const running = work.stages.findLast((stage) => !stage.finished);
    const words = running ? (STAGES[running.name] ?? running.name) : TASKS[work.task];
    byId("work-words").textContent = work.stopping ? "Stopping …" : `${words} …`;
    const bar = byId<HTMLProgressElement>("work-bar");
    if (running && running.total > 0) bar.value = Math.min(1, running.done / running.total);
    else bar.removeAttribute("value");
}

function showPanorama(state: Told): void {
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

/**
 * Asks for tiles when what is wished has rested for a while and nothing is being done: once, so that tiles which fail are not begun again and
 * again, and once more after other work, for which tiles make way.
 */
function cutTilesSoon(state: Told, wanted: string): void {
    if (state.work && state.work.task !== "tiles") tilesAskedFor = "";
    if (state.work || state.tiles !== null || wanted === tilesAskedFor) return;
    tilesAskedFor = wanted;
    clearTimeout(tilesTimer);
    tilesTimer = setTimeout(async () => {
        const begun = now !== null && now.tiles === null && !now.work && (await cutTiles());
        if (!begun) tilesAskedFor = "";
    }, TILES_AFTER);
}

function show(state: Told): void {
    const { stitched } = state;
    byId("place").textContent = state.folder?.name ?? "";
    byId<HTMLButtonElement>("undo").disabled = !state.can_undo;
    byId<HTMLButtonElement>("redo").disabled = !state.can_redo;
    byId<HTMLButtonElement>("save").disabled = !stitched;
    const button = byId<HTMLButtonElement>("stitch");
    button.disabled = state.photographs.length === 0 || (state.work !== null && state.work.task !== "tiles");
    button.textContent = stitched ? "Stitch again" : "Stitch";
    button.classList.toggle("main", !stitched || stitched.stale);
    choices.show(state.wishes);
    strip.show(state);
    saving.show(state);
    tell(state);
    showWork(state);
    showPanorama(state);
}

let after = 0;
for (;;) {
    try {
        now = await told<Told>(`/api/news?after=${after}`);
        after = now.news;
        show(now);
    } catch (error) {
        if (!(error instanceof Refused)) throw error;
        said = error.trouble;
        if (now) tell(now);
        await new Promise((resolve) => setTimeout(resolve, AGAIN_AFTER));
    }
}
