// What trying the page takes: the command's server, the browser, and steps that are told.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { cp, mkdtemp, readFile, rm } from "node:fs/promises";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";

const here = (path) => new URL(path, import.meta.url).pathname;
/** The built command. */
export const command = process.env.TRUEUP ?? here("../../../../target/release/trueup");
const browserPath = process.env.CHROMIUM ?? "/usr/bin/chromium";
const pictures = process.env.SCREENSHOTS;
const axe = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

// What a browser without a screen, a processor for graphics and a network needs to be told; the folder of its settings is new in every run.
const flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader"];
/** Longest a step may take, in milliseconds: a machine may be busy with other things. */
const PATIENCE = 60_000;

/** A folder for this run alone. */
export const desk = await mkdtemp(join(tmpdir(), "trueup-page-"));
/** The five photographs of the room in it. */
export const room = join(desk, "room");
for (const number of [0, 1, 2, 3, 4]) await cp(here(`../../../../examples/room/0${number}.jpg`), join(room, `0${number}.jpg`));

const children = [];
/** Starts the server; resolves with the address it prints. */
export function serve(...folders) {
    return new Promise((resolve, reject) => {
        const child = spawn(command, ["serve", ...folders], { stdio: ["ignore", "pipe", "inherit"] });
        children.push(child);
        child.stdout.on("data", (text) => {
            const address = /http:\S+/.exec(String(text));
            if (address) resolve(address[0]);
        });
        child.on("exit", (status) => reject(new Error(`the server ended with ${status}`)));
    });
}

/** The process of the server that was started last. */
export const server = () => children.at(-1).pid;

const browser = await chromium.launch({ executablePath: browserPath, headless: true, args: flags });
/** What the browser complained of. */
export const complaints = [];
/** Opens an address in a window of its own, with cookies of its own. */
export async function open(address, options = {}) {
    const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, acceptDownloads: true, ...options });
    const page = await context.newPage();
    page.setDefaultTimeout(PATIENCE);
    page.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });
    page.on("pageerror", (error) => complaints.push(String(error)));
    page.on("request", (request) => {
        const url = request.url();
        if (!/^(blob:|data:|file:)/.test(url) && new URL(url).hostname !== "127.0.0.1") complaints.push(`asked elsewhere: ${url}`);
    });
    await page.goto(address);
    return page;
}

let last = Date.now();
/** Tells what was done, and how long it took. */
export function step(words) {
    console.log(`${((Date.now() - last) / 1000).toFixed(1).padStart(6)} s  ${words}`);
    last = Date.now();
}

/** No violation of accessibility, whatever is shown. */
export async function accessible(page, where) {
    // Evaluated by the browser's own tools, not by the page, whose policy lets no other script in.
    // A color on its way to another is none that stays.
    await page.emulateMedia({ reducedMotion: "reduce" });
    await page.evaluate(axe);
    const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
    const violations = found.violations.map((one) => `${one.id}: ${one.nodes.map((node) => node.html).join(" | ")}`);
    assert.deepEqual(violations, [], where);
}

/** A picture of the page, where such are wanted. */
export async function picture(page, name, options = {}) {
    if (pictures) await page.screenshot({ path: join(pictures, `${name}.jpg`), type: "jpeg", quality: 70, ...options });
}

/** The number of the preview that is shown. */
export const drawn = (page) => page.locator("#preview").getAttribute("data-number");
/** Resolves when another preview than `before` is shown. */
export async function redrawn(page, before) {
    await page.waitForFunction((number) => {
        const shown = document.getElementById("preview")?.dataset.number;
        return shown !== undefined && shown !== number;
    }, before);
}
/** Resolves when nothing is being done. */
export const settled = (page) => page.waitForFunction(() => document.getElementById("work").hidden);
/** Resolves when the panorama is shown whole. */
export const tiled = (page) => page.waitForFunction(() => !document.getElementById("tiles").hidden);

/** Ends all that was started, and leaves nothing behind. */
export async function clear() {
    await browser.close();
    for (const child of children) {
        child.removeAllListeners("exit");
        child.kill("SIGINT");
    }
    await rm(desk, { recursive: true, force: true });
}
