// Files: saving in every format, opening folders, photographs and projects.

import type { Possible, Told } from "./api.js";
import { ask, post, Refused } from "./api.js";
import { byId, el, firstSentence, size } from "./dom.js";

export class Saving {
    private readonly dialog = byId<HTMLDialogElement>("saving");
    private asked = false;

    constructor(possible: Possible, private readonly trouble: (refused: Refused) => void) {
        const formats = possible.extensions.split(/, | or /);
        byId("save-format").append(...formats.map((extension) => el("option", { value: extension }, extension)));
        const beside = possible.side_outputs.map((one) =>
            el("label", {}, el("input", { type: "checkbox", name: "beside", value: one.flag }), ` ${firstSentence(one.meaning)}`));
        byId("save-beside").append(...beside);
        byId("save-format").addEventListener("change", () => this.places());
        byId("save-go").addEventListener("click", () => void this.save());
    }

    open(now: Told): void {
        byId("save-where").hidden = now.folder === null;
        byId("save-told").textContent = "";
        this.asked = false;
        this.show(now);
        this.places();
        this.dialog.showModal();
    }

    show(now: Told): void {
        const files = now.exports.flatMap((one) => one.files.map((file, index) => {
            const said = `${file.name}, ${size(file.bytes)}`;
            const address = `/api/exports/${one.number}/${index}`;
            return el("li", {}, one.to_fetch ? el("a", { href: address, download: file.name }, said) : `${said}, in the folder`);
        }));
        const list = byId("save-files");
        const key = JSON.stringify(now.exports.map((one) => one.number));
        // Links that are there are not replaced: one of them may have the focus.
        if (list.dataset["key"] !== key) {
            list.dataset["key"] = key;
            list.replaceChildren(...files);
        }
        const busy = now.work?.task === "export";
        byId<HTMLButtonElement>("save-go").disabled = busy;
        if (busy) byId("save-told").textContent = "Writing …";
        else if (now.trouble) byId("save-told").textContent = `${now.trouble.message}. ${now.trouble.hint}`;
        else if (this.asked) byId("save-told").textContent = "Done.";
    }

    /** A folder of tiles cannot be downloaded as one file: without a folder to put it into, there is none. */
    private places(): void {
        const noFolder = byId("save-where").hidden;
        const tiles = byId("save-format").querySelector<HTMLOptionElement>("option[value='.dzi']");
        if (tiles) tiles.disabled = noFolder;
        const fetch = this.dialog.querySelector<HTMLInputElement>("input[value=fetch]");
        const folder = this.dialog.querySelector<HTMLInputElement>("input[value=folder]");
        const isFolder = byId<HTMLSelectElement>("save-format").value === ".dzi";
        if (fetch) fetch.disabled = isFolder;
        if (folder && isFolder) folder.checked = true;
        else if (fetch && noFolder) fetch.checked = true;
    }

    private async save(): Promise<void> {
        const name = byId<HTMLInputElement>("save-name");
        if (!name.reportValidity()) return;
        const beside = [...this.dialog.querySelectorAll<HTMLInputElement>("input[name=beside]:checked")].map((one) => one.value);
        const into_folder = this.dialog.querySelector<HTMLInputElement>("input[value=folder]")?.checked ?? false;
        try {
            this.asked = true;
            await post("/api/exports", { name: name.value + byId<HTMLSelectElement>("save-format").value, beside, into_folder });
        } catch (error) {
            this.asked = false;
            if (!(error instanceof Refused)) throw error;
            byId("save-told").textContent = `${error.trouble.message}. ${error.trouble.hint}`;
            this.trouble(error);
        }
    }
}

export class Opening {
    private readonly dialog = byId<HTMLDialogElement>("opening");

    constructor(possible: Possible, private readonly trouble: (refused: Refused) => void) {
        for (const id of ["choose", "choose-more"]) {
            const input = byId<HTMLInputElement>(id);
            // Systems do not know all of them for pictures; telephones offer their gallery for pictures only.
            input.accept = ["image/*", ...possible.photographs].join(",");
            input.addEventListener("change", () => void this.take([...(input.files ?? [])]).then(() => { input.value = ""; }));
        }
        const project = byId<HTMLInputElement>("choose-project");
        project.addEventListener("change", () => void this.take([...(project.files ?? [])]).then(() => { project.value = ""; }));
        this.byDropping();
    }

    open(now: Told): void {
        const inside = now.folder?.inside ? `${now.folder.inside}/` : "";
        const folders = (now.folder?.folders ?? []).map((name) => this.choice(name, () => post("/api/folder", { folder: inside + name })));
        const back = now.folder ? [this.choice("The folder of the beginning", () => post("/api/folder", { folder: "" }))] : [];
        const projects = (now.folder?.projects ?? []).map((name) => this.choice(name, () => post("/api/project", { name })));
        const list = (title: string, items: HTMLElement[]) => (items.length > 0 ? [el("h3", {}, title), el("ul", { class: "picks" }, ...items)] : []);
        byId("opening-lists").replaceChildren(...list("Folders", [...back, ...folders]), ...list("Projects in this folder", projects));
        this.dialog.showModal();
    }

    /** Takes photographs, and a project after them. One that is refused does not keep the others out; the first such is told. */
    async take(files: File[]): Promise<void> {
        this.dialog.close();
        const isProject = (file: File) => file.name.toLowerCase().endsWith(".json");
        let first: Refused | null = null;
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

    private choice(name: string, open: () => Promise<unknown>): HTMLElement {
        const chosen = () => {
            this.dialog.close();
            open().catch((error: unknown) => { if (error instanceof Refused) this.trouble(error); });
        };
        return el("li", {}, el("button", { type: "button", class: "quiet", onclick: chosen }, name));
    }

    private byDropping(): void {
        const veil = byId("dropping");
        document.addEventListener("dragover", (event) => {
            if (!event.dataTransfer?.types.includes("Files")) return;
            event.preventDefault();
            veil.hidden = false;
        });
        document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) veil.hidden = true; });
        document.addEventListener("drop", (event) => {
            event.preventDefault();
            veil.hidden = true;
            void this.take([...(event.dataTransfer?.files ?? [])]);
        });
    }
}
