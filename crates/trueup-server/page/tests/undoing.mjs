// Undo takes back every kind of wish, and Redo brings it again.
import assert from "node:assert/strict";
import { settled, step } from "./desk.mjs";

/** What is wished for now. */
const wished = (page) => page.evaluate(async () => {
    const told = await (await fetch("/api/news")).json();
    const masks = told.photographs.map((one) => [one.left_out, one.used_mask, one.kept_mask]);
    return JSON.stringify([Object.entries(told.wishes).sort(), masks, told.can_undo]);
});

/** Resolves with what is wished for as soon as `is` holds for it. */
async function until(page, is, what) {
    for (let tries = 0; tries < 200; tries += 1) {
        const now = await wished(page);
        if (is(now)) return now;
        await page.waitForTimeout(50);
    }
    throw new Error(`not ${what}`);
}

/** Changes every field of the choices, one after the other, then leaves a photograph out; each is undone, done again, and undone. */
export async function undoEverything(page) {
    await settled(page);
    await page.evaluate(() => document.querySelectorAll("#choices details").forEach((one) => { one.open = true; }));
    const fields = await page.evaluate(() => [...document.querySelectorAll("#choices :is(select, input)")].map((one) => one.id));
    assert.ok(fields.length >= 12, `${fields}`);
    const began = await wished(page);
    let changed = 0;
    const try_it = async (what, change) => {
        if (!(await change())) return;
        const after = await until(page, (now) => now !== began, `${what} is wished for`);
        await page.getByRole("button", { name: "Undo" }).click();
        await until(page, (now) => now === began, `${what} is undone`);
        await page.getByRole("button", { name: "Redo" }).click();
        await until(page, (now) => now === after, `${what} is done again`);
        await page.keyboard.press("Control+z");
        await until(page, (now) => now === began, `${what} is undone by keys`);
        changed += 1;
    };
    for (const id of fields) {
        await try_it(id, () => page.evaluate((id) => {
            const field = document.getElementById(id);
            const another = { "select-one": () => { field.selectedIndex = (field.selectedIndex + 1) % field.options.length; },
                checkbox: () => { field.checked = !field.checked; },
                range: () => { field.value = String(Number(field.value) + 1.5); },
                // What counts things is whole, and one of them is few; what is a share or a factor may be half.
                number: () => { field.value = String(Number(field.value) > 1 ? Number(field.value) + 1 : 0.5); } }[field.type];
            // What is written freely has no other value that is sure to be one.
            if (!another) return false;
            another();
            field.dispatchEvent(new Event("change"));
            return true;
        }, id).then((done) => { if (!done) console.log(`          not tried: ${id}`); return done; }));
    }
    await try_it("leaving out", async () => {
        await page.getByRole("button", { name: /^Leave out/ }).first().click();
        return true;
    });
    assert.ok(changed >= 12, `${changed} of ${fields.length}`);
    await settled(page);
    step(`${changed} kinds of wishes, each undone, done again, and undone`);
}
