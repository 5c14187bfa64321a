// Drawings over the panorama: outlines, seams, lines, errors, overlaps, as the report has them.

import type { Layer, Possible } from "./api.js";
import { Refused, told } from "./api.js";
import { byId, el } from "./dom.js";

const SVG = "http://www.w3.org/2000/svg";

/** What the drawings lie over: a preview or tiles, by their number, in an element that covers it. */
export interface Under { kind: "preview" | "tiles"; number: number; element: HTMLElement }

export class Layers {
    private readonly button = byId<HTMLButtonElement>("layers-button");
    private readonly panel = byId("layers-panel");
    private readonly chosen = new Set<string>();
    private readonly details = new Map<string, HTMLElement>();
    private under: Under | null = null;
    private shown = "";

    constructor(possible: Possible, private readonly trouble: (refused: Refused) => void) {
        for (const { name, title } of possible.layers) {
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

    /** Draws what is chosen over this from now on. */
    over(under: Under | null): void {
        const same = under?.number === this.under?.number && under?.kind === this.under?.kind && under?.element === this.under?.element;
        this.button.disabled = under === null;
        if (under === null) this.open(false);
        if (same) return;
        this.under?.element.replaceChildren();
        this.under = under;
        this.shown = "";
        void this.draw();
    }

    private open(isOpen: boolean): void {
        this.panel.hidden = !isOpen;
        this.button.setAttribute("aria-expanded", String(isOpen));
    }

    private choose(name: string, isChosen: boolean): void {
        if (isChosen) this.chosen.add(name);
        else this.chosen.delete(name);
        void this.draw();
    }

    /** Fetches and shows the drawings; what was chosen otherwise, or lies over something else by then, is not shown. */
    private async draw(): Promise<void> {
        const { under } = this;
        const wanted = JSON.stringify([under?.kind, under?.number, [...this.chosen]]);
        if (wanted === this.shown) return;
        this.shown = wanted;
        const names = [...this.details.keys()].filter((name) => this.chosen.has(name));
        try {
            const asked = under === null ? [] : names.map((name) => told<Layer>(`/api/${under.kind}/${under.number}/layers/${name}`));
            const layers = await Promise.all(asked);
            if (wanted !== this.shown) return;
            under?.element.replaceChildren(...layers.flatMap((layer) => drawing(layer, under.kind)));
            for (const [name, detail] of this.details) {
                const layer = layers[names.indexOf(name)];
                detail.replaceChildren(...(layer ? described(layer) : []));
            }
        } catch (error) {
            if (!(error instanceof Refused)) throw error;
            // A picture that is no longer kept makes way for the next.
            if (wanted === this.shown) this.trouble(error);
        }
    }
}

/** The drawing as an element; it is made of numbers and escaped names, and nothing in it runs. */
function drawing(layer: Layer, kind: Under["kind"]): Element[] {
    if (layer.drawing === null) return [];
    const svg = document.importNode(new DOMParser().parseFromString(layer.drawing, "image/svg+xml").documentElement, true);
    // A preview is shown as large as fits, in the middle; tiles fill what they lie on.
    if (kind === "preview") svg.setAttribute("preserveAspectRatio", "xMidYMid meet");
    return [svg];
}

/** What the colors stand for, or that there is nothing to see. */
function described(layer: Layer): HTMLElement[] {
    if (layer.drawing === null) return [el("p", { class: "small" }, "There is nothing of that to see here.")];
    const entries = layer.legend.map((one) => el("li", {}, swatch(one.color, one.dashes), one.words));
    const elsewhere = "Measured in the view that was stitched, drawn where this view shows it.";
    const note = layer.is_measured_elsewhere ? [el("p", { class: "small" }, elsewhere)] : [];
    return [...(entries.length > 0 ? [el("ul", { class: "legend small" }, ...entries)] : []), ...note];
}

function swatch(color: string, dashes: string): Element {
    const svg = document.createElementNS(SVG, "svg");
    const line = document.createElementNS(SVG, "path");
    for (const [name, value] of [["viewBox", "0 0 38 12"], ["aria-hidden", "true"]] as const) svg.setAttribute(name, value);
    for (const [name, value] of [["d", "M1 6h36"], ["stroke", color], ["stroke-width", "6"], ["stroke-dasharray", dashes]] as const) {
        if (value !== "") line.setAttribute(name, value);
    }
    svg.append(line);
    return svg;
}
