// The page in a real browser, as a person uses it: `npm test`, with the built command and Chromium.
//
// TRUEUP is the command (target/release/trueup otherwise), CHROMIUM the browser. With SCREENSHOTS=DIR, pictures of the page are
// written there.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { cp, readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { accessible, clear, command, complaints, desk, drawn, open, picture, redrawn, room, serve, settled, step, tiled } from "./desk.mjs";
import { timeRedraws } from "./redraws.mjs";
import { openReport } from "./reports.mjs";
import { undoEverything } from "./undoing.mjs";

/** A name that would be markup, on a file that is a photograph of nothing else here. */
const script = "<img src=x onerror=window.harmed=1>.jpg";

async function stitchAndLook() {
    const page = await open(await serve(room));
    assert.ok(!page.url().includes("token"), "the key is not left in the address");
    await page.locator("#strip li").nth(4).waitFor();
    await accessible(page, "before stitching");
    await page.locator("#strip img").first().evaluate((image) => image.decode());
    await picture(page, "page-photographs");
    step("five photographs are shown");

    await page.getByRole("button", { name: "Stitch", exact: true }).click();
    await page.locator("#work").waitFor();
    assert.notEqual(await page.locator("#work-words").textContent(), "");
    await page.getByRole("button", { name: "Stop" }).click();
    await settled(page);
    step("stopped, unless it was done before");

    await page.getByRole("button", { name: /^Stitch( again)?$/ }).click();
    await redrawn(page, null);
    assert.match(await page.locator("#strip h2").first().textContent(), /In the panorama: 5/);
    await tiled(page);
    await settled(page);
    await accessible(page, "stitched");
    await page.waitForTimeout(800);
    await picture(page, "page");
    step("stitched, and shown whole in tiles");
    return page;
}

async function choose(page) {
    let before = await drawn(page);
    await page.getByLabel("View", { exact: true }).selectOption("cylindrical");
    await redrawn(page, before);
    before = await drawn(page);
    await page.getByLabel("Crop", { exact: true }).selectOption("rectangle");
    await redrawn(page, before);
    step("another view, cropped");

    const before_turn = await page.locator("#option-projection-yaw-number").inputValue();
    await page.getByRole("button", { name: "Turn", exact: true }).click();
    const box = await page.locator("#preview").boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 - 60, box.y + box.height / 2, { steps: 4 });
    await page.mouse.up();
    await page.waitForFunction((value) => document.getElementById("option-projection-yaw-number").value !== value, before_turn);
    const turned = Number(await page.locator("#option-projection-yaw-number").inputValue());
    assert.ok(turned > 1 && turned < 60, `turned by ${turned} degrees`);
    await page.keyboard.press("ArrowLeft");
    await page.waitForFunction((value) => Math.abs(Number(document.getElementById("option-projection-yaw-number").value) - value) < 0.02, turned - 1);
    await page.keyboard.press("Control+z");
    await page.waitForFunction((value) => Math.abs(Number(document.getElementById("option-projection-yaw-number").value) - value) < 0.02, turned);
    step(`turned by dragging, by ${turned} degrees, and by a key; undone`);
}

/** The report's drawings over the panorama, chosen by keys: over the preview and over the tiles. */
async function drawOver(page) {
    await settled(page);
    const button = page.getByRole("button", { name: "Layers" });
    await button.focus();
    await page.keyboard.press("Enter");
    assert.equal(await button.getAttribute("aria-expanded"), "true");
    const panel = page.getByRole("group", { name: "Drawings over the panorama" });
    const names = { "Outlines of the photographs": /^Outlines of 5 photographs/, Seams: /^Seams between/, "Lines by vanishing point": /long lines of the photographs/, "Alignment error": /^Heat map/, Overlaps: /joined by/ };
    for (const mode of ["Turn", "Look closer"]) {
        await page.getByRole("button", { name: mode, exact: true }).click();
        const over = page.locator(mode === "Turn" ? "#layers" : "#tiles .layers");
        if (mode !== "Turn") await tiled(page);
        for (const [title, label] of Object.entries(names)) {
            const box = panel.getByRole("checkbox", { name: title });
            await box.focus();
            await page.keyboard.press("Space");
            await over.getByRole("img", { name: label }).waitFor();
            await accessible(page, `${title} over ${mode}`);
            await page.waitForTimeout(200);
            await picture(page, `page-layers-${mode === "Turn" ? "preview" : "tiles"}-${title.split(" ")[0].toLowerCase()}`);
            await box.focus();
            await page.keyboard.press("Space");
            await over.getByRole("img").waitFor({ state: "detached" });
        }
    }
    // The drawing covers the panorama, however it is zoomed: its outlines are where the photographs are.
    await panel.getByRole("checkbox", { name: "Outlines of the photographs" }).check();
    const drawing = page.locator("#tiles .layers svg");
    await drawing.waitFor();
    const before = await drawing.boundingBox();
    await page.getByRole("button", { name: "Zoom in" }).click();
    await page.waitForTimeout(900);
    const after = await drawing.boundingBox();
    assert.ok(Math.abs(after.width / before.width - 1.4) < 0.03, `${before.width} to ${after.width}`);
    assert.ok(Math.abs(after.height / before.height - 1.4) < 0.03, `${before.height} to ${after.height}`);
    await page.getByRole("button", { name: "Whole" }).click();
    // What is wished next is drawn with its own drawing.
    const number = await drawn(page);
    await page.getByRole("button", { name: "Turn", exact: true }).click();
    const canvas = await page.locator("#layers svg").getAttribute("viewBox");
    await page.keyboard.press("Shift+ArrowUp");
    await redrawn(page, number);
    await page.waitForFunction((older) => ![null, undefined, older].includes(document.querySelector("#layers svg")?.getAttribute("viewBox")), canvas);
    const [picture_box, drawing_box] = [await page.locator("#preview").boundingBox(), await page.locator("#layers svg").boundingBox()];
    assert.ok(drawing_box.x >= picture_box.x && drawing_box.x + drawing_box.width <= picture_box.x + picture_box.width, "within the picture");
    await page.getByRole("button", { name: "Undo" }).click();
    await page.getByRole("checkbox", { name: "Outlines of the photographs" }).focus();
    await page.keyboard.press("Space");
    await page.keyboard.press("Escape");
    assert.equal(await panel.isVisible(), false);
    assert.equal(await button.evaluate((element) => element === document.activeElement), true, "back at the button");
    await page.getByRole("button", { name: "Look closer" }).click();
    step("drawings over the preview and the tiles, by keys, named for screen readers");
}

async function paint(page) {
    await page.getByRole("button", { name: "Paint on 02.jpg" }).click();
    const canvas = page.locator("#paint-canvas");
    await canvas.waitFor();
    const box = await canvas.boundingBox();
    await page.mouse.move(box.x + 60, box.y + 60);
    await page.mouse.down();
    await page.mouse.move(box.x + 200, box.y + 100, { steps: 5 });
    await page.mouse.up();
    await page.getByRole("button", { name: "Keep" }).click();
    await canvas.focus();
    for (const key of ["ArrowRight", "ArrowDown", "Space", "Shift+ArrowRight", "Shift+ArrowRight"]) await page.keyboard.press(key);
    await accessible(page, "painting");
    await picture(page, "page-painting");
    await page.getByRole("button", { name: "Done" }).click();
    await page.locator("#strip .badge").waitFor();
    await page.getByRole("button", { name: "Stitch again" }).click();
    await page.waitForFunction(() => document.querySelector("#told .note") === null && document.getElementById("work").hidden);
    assert.match(await page.locator("#strip h2").first().textContent(), /In the panorama: 5/);
    step("painted by mouse and keys, stitched again");
    // What is to be ignored and what is to be kept are a step each.
    for (const left of [1, 0]) {
        await page.getByRole("button", { name: "Undo" }).click();
        await page.locator("#strip .badge").waitFor({ state: left ? "attached" : "detached", timeout: 20_000 });
        await settled(page);
    }
    // What is saved is what was stitched: without what was painted.
    await page.getByRole("button", { name: "Stitch again" }).click();
    await page.waitForFunction(() => document.querySelector("#told .note") === null && document.getElementById("work").hidden);
}

async function save(page) {
    await settled(page);
    const formats = await page.locator("#save-format option").allTextContents();
    assert.ok(formats.length >= 6, `${formats}`);
    await page.getByRole("button", { name: "Save", exact: true }).first().click();
    await accessible(page, "saving");
    await page.getByLabel("Name").fill("of the room");
    await page.locator("input[name=beside][value=project]").check();
    for (const format of formats.filter((one) => one !== ".dzi")) {
        await page.getByRole("combobox", { name: "Format" }).selectOption(format);
        await page.locator("#save-go").click();
        const link = page.locator("#save-files a", { hasText: `of the room${format}` });
        await link.waitFor();
        await page.waitForFunction(() => !document.getElementById("save-go").disabled);
        const [download] = await Promise.all([page.waitForEvent("download"), link.click()]);
        await download.saveAs(join(desk, `saved${format}`));
        assert.ok((await readFile(join(desk, `saved${format}`))).length > 10_000, format);
    }
    await page.getByRole("combobox", { name: "Format" }).selectOption(".dzi");
    await page.locator("#save-go").click();
    await page.locator("#save-files li", { hasText: "of the room.dzi" }).waitFor();
    assert.match(await readFile(join(room, "of the room.dzi"), "utf8"), /TileSize/);
    const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#save-files a", { hasText: ".json" }).first().click()]);
    await download.saveAs(join(desk, "saved.json"));
    await page.getByRole("button", { name: "Close", exact: true }).click();
    step(`saved as ${formats.join(" ")}, with the project`);
}

async function reopen() {
    const page = await open(await serve(room), { colorScheme: "dark" });
    await page.locator("#strip li").nth(4).waitFor();
    await page.getByRole("button", { name: "Open" }).click();
    await accessible(page, "opening");
    await page.locator("#choose-project").setInputFiles(join(desk, "saved.json"));
    await redrawn(page, null);
    assert.equal(await page.getByLabel("View", { exact: true }).inputValue(), "cylindrical");
    assert.equal(await page.getByLabel("Crop", { exact: true }).inputValue(), "rectangle");
    const project = await page.evaluate(async () => (await fetch("/api/project")).json());
    const saved = JSON.parse(await readFile(join(desk, "saved.json"), "utf8"));
    // What is cut off, and so where the rest lies, is found as the panorama is composed.
    const composed = { canvas: null, mesh_canvas: null, crop: null, projection: null };
    for (const one of [project, saved]) {
        Object.assign(one, { ...composed, seconds: null, diagnostics: null, measures: null });
        for (const image of one.images) Object.assign(image, { mesh: null, solved_mesh: null });
    }
    assert.deepEqual(project, saved);
    await tiled(page);
    await settled(page);
    await accessible(page, "dark");
    await page.waitForTimeout(800);
    await picture(page, "page-dark");
    step("opened again, in the dark: the same project");

    // The command makes of the saved project the very file that the page saved.
    execFileSync(command, ["compose", join(desk, "saved.json"), "--photos", room, "-o", join(desk, "composed.png"), "--quiet"]);
    assert.ok((await readFile(join(desk, "composed.png"))).equals(await readFile(join(desk, "saved.png"))), "the same bytes");
    step("composed by the command: the same file");

    await page.getByLabel("View", { exact: true }).selectOption("equirectangular");
    await page.getByRole("button", { name: "Look around" }).click();
    await page.locator("#sphere canvas, #sphere .pnlm-error-msg").first().waitFor({ state: "attached" });
    await page.waitForTimeout(1500);
    assert.equal(await page.locator("#sphere .pnlm-error-msg").isVisible(), false, "the sphere is shown");
    await accessible(page, "around");
    await picture(page, "page-around");
    step("looked around on the sphere");
}

/** A mask that was painted, saved with its project in the folder, is there when that is opened by another program. */
async function keepMasks() {
    const page = await open(await serve(room));
    await page.locator("#strip li").nth(4).waitFor();
    await page.getByRole("button", { name: "Paint on 02.jpg" }).click();
    await page.locator("#paint-canvas").waitFor();
    await page.locator("#paint-canvas").focus();
    for (const key of ["Space", "Shift+ArrowRight", "Shift+ArrowRight"]) await page.keyboard.press(key);
    await page.getByRole("button", { name: "Done" }).click();
    await page.locator("#strip .badge").waitFor();
    await page.getByRole("button", { name: "Stitch", exact: true }).click();
    await redrawn(page, null);
    await tiled(page);
    await settled(page);
    await page.getByRole("button", { name: "Save", exact: true }).first().click();
    await page.getByLabel("Name").fill("painted");
    await page.getByRole("combobox", { name: "Format" }).selectOption(".png");
    await page.locator("input[name=beside][value=project]").check();
    await page.getByRole("radio", { name: "In the folder of the photographs" }).check();
    await page.locator("#save-go").click();
    await page.locator("#save-files li", { hasText: "painted-masks/painted-02.jpg-use.png" }).waitFor();
    await picture(page, "page-saved-masks");
    const mask = await readFile(join(room, "painted-masks", "painted-02.jpg-use.png"));
    assert.ok(mask.length > 100);

    const other = await open(await serve(room));
    await other.locator("#strip li").nth(4).waitFor();
    await other.getByRole("button", { name: "Open" }).click();
    await other.getByRole("button", { name: "painted.json" }).click();
    await redrawn(other, null);
    await other.locator("#strip .badge").waitFor();
    assert.equal(await other.locator("#strip li").count(), 5, "masks are no photographs");
    step("a painted mask is saved beside its project, and found again");
}

async function phone() {
    await cp(join(room, "00.jpg"), join(desk, script));
    const page = await open(await serve(), { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
    await page.getByText("Drop photographs here").waitFor();
    const accepted = await page.locator("#choose").getAttribute("accept");
    for (const wanted of ["image/*", ".exr", ".hdr", ".jxl", ".heic", ".tif"]) assert.ok(accepted.split(",").includes(wanted), accepted);
    await accessible(page, "empty, on a phone");
    const files = [0, 1, 2].map((number) => join(room, `0${number}.jpg`));
    await page.locator("#choose").setInputFiles(files);
    await page.locator("#strip li").nth(2).waitFor();
    await page.getByRole("button", { name: "Stitch", exact: true }).click();
    await redrawn(page, null);
    await tiled(page);
    await settled(page);
    await accessible(page, "on a phone");
    const wide = await page.evaluate(() => document.documentElement.scrollWidth > window.innerWidth);
    assert.equal(wide, false, "nothing is wider than the phone");
    await page.waitForTimeout(800);
    await picture(page, "page-phone");
    await page.getByRole("button", { name: "Save", exact: true }).first().click();
    // A folder of tiles has nowhere to go.
    assert.equal(await page.locator("#save-format option[value='.dzi']:disabled").count(), 1);
    await page.getByRole("combobox", { name: "Format" }).selectOption(".jpg");
    await page.locator("#save-go").click();
    await page.locator("#save-files a", { hasText: "panorama.jpg" }).waitFor();
    step("dropped on a phone, stitched and saved");
}

/** A name with markup, in a folder whose photographs cannot be used: all that is said of it is text. */
async function names() {
    const folder = join(desk, "names");
    await cp(join(room, "00.jpg"), join(folder, script));
    await cp(join(room, "03.jpg"), join(folder, "b&lt;b.jpg"));
    await writeFile(join(folder, "text<script>window.harmed=1<\u002fscript>.jpg".replace("/", "")), "no photograph");
    const page = await open(await serve(folder));
    await page.locator("#strip li").nth(2).waitFor();
    assert.equal(await page.locator("#strip .name").first().textContent(), script);
    await page.getByRole("button", { name: "Stitch", exact: true }).click();
    await settled(page);
    await page.waitForTimeout(300);
    assert.equal(await page.evaluate(() => window.harmed), undefined);
    assert.equal(await page.locator("#strip img[src=x]").count(), 0);
    const refused = complaints.splice(0).filter((text) => !text.includes("422"));
    complaints.push(...refused);
    step("markup in names is text");
}

/** Files that are refused do not keep those after them out, and the first is told by its name. */
async function refusals() {
    const page = await open(await serve());
    await page.getByText("Drop photographs here").waitFor();
    await writeFile(join(desk, "notes.txt"), "no photograph");
    await writeFile(join(desk, "none.json"), new Uint8Array([0xff]));
    const files = [join(desk, "none.json"), join(room, "00.jpg"), join(desk, "notes.txt"), join(room, "01.jpg")];
    await page.locator("#choose").setInputFiles(files);
    await page.locator("#told .trouble", { hasText: "notes.txt: " }).waitFor();
    await page.locator("#strip li").nth(1).waitFor();
    assert.deepEqual(await page.locator("#strip .name").allTextContents(), ["00.jpg", "01.jpg"]);
    const refused = complaints.splice(0).filter((text) => !text.includes("422"));
    complaints.push(...refused);
    step("what is refused keeps nothing else out");
}

/** Of a folder that was opened, the folders in it are opened, and none of the same name elsewhere. */
async function folders() {
    const folder = join(desk, "folders");
    await cp(join(room, "00.jpg"), join(folder, "b", "elsewhere.jpg"));
    await cp(join(room, "00.jpg"), join(folder, "a", "b", "meant.jpg"));
    const page = await open(await serve(folder));
    for (const name of ["a", "b"]) {
        await page.getByRole("button", { name: "Open" }).click();
        await page.getByRole("button", { name, exact: true }).click();
        await page.waitForFunction((shown) => document.getElementById("place").textContent === shown, name);
    }
    await page.locator("#strip .name", { hasText: "meant.jpg" }).waitFor();
    await page.getByRole("button", { name: "Open" }).click();
    await page.getByRole("button", { name: "The folder of the beginning" }).click();
    await page.waitForFunction(() => document.getElementById("place").textContent === "folders");
    step("folders in folders are opened");
}

let failure;
try {
    const page = await stitchAndLook();
    await drawOver(page);
    await choose(page);
    await timeRedraws(page);
    await undoEverything(page);
    await paint(page);
    await save(page);
    await reopen();
    await openReport(join(desk, "saved.json"));
    await keepMasks();
    await phone();
    await names();
    await refusals();
    await folders();
    assert.deepEqual(complaints, [], "the browser complains of nothing");
    step("done");
} catch (error) {
    failure = error;
} finally {
    await clear();
}
if (failure) {
    console.error(failure, complaints);
    process.exit(1);
}
