// The report, opened as a file by a browser that has no network.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { accessible, command, desk, open, picture, room, step } from "./desk.mjs";

/** The value at a place in a record (RFC 6901). */
const at = (record, pointer) => pointer.split("/").slice(1)
    .reduce((value, key) => value?.[key.replaceAll("~1", "/").replaceAll("~0", "~")], record);

/** The report of the project in `file` says what that says, in light and dark, on a desk and on a phone, and asks for nothing. */
export async function openReport(file, photographs = room) {
    const report = join(desk, "report.html");
    execFileSync(command, ["report", file, "--photos", photographs, "-o", report]);
    const record = JSON.parse(await readFile(file, "utf8"));
    for (const [name, options] of [
        ["report", {}],
        ["report-dark", { colorScheme: "dark" }],
        ["report-phone", { viewport: { width: 390, height: 844 }, isMobile: true }],
    ]) {
        const page = await open("about:blank", { offline: true, ...options });
        const asked = [];
        page.on("request", (request) => asked.push(request.url().slice(0, 80)));
        await page.goto(`file://${report}`);
        // The panorama is drawn under several drawings, and so is a part of one; each photograph is a picture of its own.
        const pictures = await page.evaluate(() => Promise.all([...document.querySelectorAll("img, svg image")].map(async (one) => {
            const picture = new Image();
            picture.src = one.getAttribute("src") ?? one.getAttribute("href");
            await picture.decode();
            return picture.naturalWidth;
        })));
        assert.equal(pictures.length, 1 + record.images.filter((image) => image.status === "used").length);
        assert.ok(pictures.every((width) => width > 0), `${pictures}`);
        assert.deepEqual(asked.filter((url) => !url.startsWith("data:") && !url.startsWith(`file://${dirname(report)}/report.html`)), []);
        const figures = await page.evaluate(() => [...document.querySelectorAll("data[data-field]")].map((one) => [one.dataset.field, one.value]));
        assert.ok(figures.length > 50, `${figures.length} figures`);
        for (const [field, value] of figures) assert.equal(Number(value), at(record, field), field);
        const wide = await page.evaluate(() => document.documentElement.scrollWidth > window.innerWidth);
        assert.equal(wide, false, "nothing is wider than the page");
        await accessible(page, name);
        await picture(page, name, { fullPage: true });
        if (name === "report") step(`the report opens without a network; its ${figures.length} figures are the project's`);
    }
    step("the report in the dark and on a phone");
}
