// The choices: a field for every option that the program declares for people.

import type { Option, Possible, Wishes } from "./api.js";
import { byId, el, firstSentence } from "./dom.js";

/** What photographers call these; any other option goes by its own name. */
const WORDS: Record<string, string> = {
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
    "output.tiff_compression": "TIFF compression",
};
const GROUPS: [string, string, boolean][] = [
    ["arrange", "View", true],
    ["compose", "Light and file", false],
    ["align", "Shape", false],
    ["match", "Matching", false],
    ["measure", "Reading", false],
];

export interface Heard {
    /** While a field is moved. */
    trying(wishes: Wishes): void;
    /** When it is let go. */
    chosen(wishes: Wishes): void;
}

interface Field { option: Option; show(value: string): void }

export class Choices {
    private fields: Field[] = [];

    constructor(possible: Possible, private heard: Heard) {
        const form = byId<HTMLFormElement>("choices");
        form.addEventListener("submit", (event) => event.preventDefault());
        const known = new Set(GROUPS.map(([phase]) => phase));
        for (const [phase, title, open] of GROUPS) {
            const own = possible.options.filter((option) => option.phase === phase || (phase === "compose" && !known.has(option.phase)));
            if (own.length === 0) continue;
            form.append(el("details", open ? { open: true } : {}, el("summary", {}, title), ...own.map((option) => this.field(option))));
        }
        form.append(el("p", { class: "small" }, "Shape, matching and reading take effect when you stitch again."));
    }

    /** Shows the values that are wished for. */
    show(wishes: Wishes): void {
        for (const field of this.fields) field.show(wishes[field.option.name] ?? field.option.default);
    }

    /** The value of an option as it is shown. */
    static value(possible: Possible, wishes: Wishes, name: string): number {
        const option = possible.options.find((one) => one.name === name);
        return Number(wishes[name] ?? option?.default ?? 0);
    }

    private field(option: Option): HTMLElement {
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

    private chosen(option: Option, value: string): void {
        this.heard.chosen({ [option.name]: value });
    }

    private toggle(option: Option, id: string, words: string, help: HTMLElement): HTMLElement {
        const input = el("input", { id, type: "checkbox", "aria-describedby": help.id, onchange: () => this.chosen(option, String(input.checked)) });
        this.fields.push({ option, show: (value) => { input.checked = value === "true"; } });
        return el("div", { class: "field" }, el("label", { class: "check" }, input, words), help);
    }

    private select(option: Option, id: string, words: string, help: HTMLElement): HTMLElement {
        const select = el("select", { id, "aria-describedby": help.id, onchange: () => this.chosen(option, select.value) });
        for (const choice of option.choices) select.append(el("option", { value: choice.name }, choice.name));
        this.fields.push({
            option,
            show: (value) => {
                select.value = value;
                const choice = option.choices.find((one) => one.name === value);
                help.textContent = firstSentence(choice?.meaning ?? option.meaning);
            },
        });
        return el("div", { class: "field" }, el("label", { for: id }, words), select, help);
    }

    private slider(option: Option, id: string, words: string, help: HTMLElement, min: number, max: number): HTMLElement {
        const shown = el("input", { id: `${id}-number`, type: "number", min, max, step: "any", "aria-label": `${words} in degrees` });
        const slider = el("input", { id, type: "range", min, max, step: 0.5, "aria-describedby": help.id });
        slider.addEventListener("input", () => {
            shown.value = slider.value;
            this.heard.trying({ [option.name]: slider.value });
        });
        slider.addEventListener("change", () => this.chosen(option, slider.value));
        shown.addEventListener("change", () => this.chosen(option, shown.value || option.default));
        this.fields.push({ option, show: (value) => { slider.value = value; shown.value = String(Math.round(Number(value) * 100) / 100); } });
        return el("div", { class: "field" }, el("label", { for: id }, words), el("div", { class: "row" }, slider, shown, el("span", { class: "unit" }, "°")), help);
    }

    private text(option: Option, id: string, words: string, help: HTMLElement, isNumber: boolean): HTMLElement {
        const input = el("input", { id, type: isNumber ? "number" : "text", step: "any", "aria-describedby": help.id });
        input.addEventListener("change", () => this.chosen(option, input.value.trim() || option.default));
        const choices = option.choices.filter((choice) => !choice.name.startsWith("#"));
        const list = choices.length > 0 ? el("datalist", { id: `${id}-list` }, ...choices.map((choice) => el("option", { value: choice.name }))) : null;
        if (list) input.setAttribute("list", list.id);
        this.fields.push({ option, show: (value) => { input.value = value; } });
        return el("div", { class: "field" }, el("label", { for: id }, words), input, list, help);
    }
}
