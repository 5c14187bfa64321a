// Makes the folder `built` of the sources: what the server holds. The same sources give the same bytes.
import { build } from "esbuild";
import { cp, mkdir, readFile, rm, writeFile } from "node:fs/promises";

const here = (path) => new URL(path, import.meta.url);
const vendored = [
    { name: "OpenSeadragon", version: "openseadragon", license: "openseadragon/LICENSE.txt" },
    { name: "Pannellum", version: "pannellum", license: "pannellum/COPYING" },
];

await rm(here("built"), { recursive: true, force: true });
await mkdir(here("built"));
await build({
    entryPoints: [here("src/main.ts").pathname],
    outfile: here("built/page.js").pathname,
    bundle: true,
    format: "esm",
    target: "es2022",
    charset: "utf8",
});
for (const name of ["index.html", "page.css", "icon.svg"]) {
    await cp(here(`src/${name}`), here(`built/${name}`));
}
const withoutMap = (text) => text.replace(/\n\/\/# sourceMappingURL=.*\s*$/, "\n");
const scripts = [
    ["openseadragon/build/openseadragon/openseadragon.min.js", "openseadragon.js"],
    ["pannellum/build/pannellum.js", "pannellum.js"],
    ["pannellum/build/pannellum.css", "pannellum.css"],
];
for (const [from, to] of scripts) {
    await writeFile(here(`built/${to}`), withoutMap(await readFile(here(`node_modules/${from}`), "utf8")));
}
let licenses = "The viewers that are part of this page, and their licenses.\n";
for (const { name, version, license } of vendored) {
    const { version: number } = JSON.parse(await readFile(here(`node_modules/${version}/package.json`), "utf8"));
    licenses += `\n${"=".repeat(80)}\n${name} ${number}\n\n${await readFile(here(`node_modules/${license}`), "utf8")}`;
}
await writeFile(here("built/licenses.txt"), licenses);
