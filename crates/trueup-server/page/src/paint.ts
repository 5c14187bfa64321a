// Masks, painted on a photograph: red is ignored, green is kept.

import type { Photograph } from "./api.js";
import { ask, Refused } from "./api.js";
import { byId } from "./dom.js";

type Brush = "ignore" | "keep" | "erase";
const COLORS: Record<"ignore" | "keep", [number, number, number]> = { ignore: [214, 48, 49], keep: [39, 160, 90] };
/** How far an arrow key moves the brush, as a share of the picture's width. */
const KEY_STEP = 0.02;

export class Painting {
    private readonly dialog = byId<HTMLDialogElement>("painting");
    private readonly canvas = byId<HTMLCanvasElement>("paint-canvas");
    private readonly picture = byId<HTMLImageElement>("paint-picture");
    private brush: Brush = "ignore";
    private photograph: Photograph | null = null;
    private full = { width: 0, height: 0 };
    private at = { x: 0.5, y: 0.5 };
    private changed = false;

    constructor(private readonly trouble: (refused: Refused) => void) {
        for (const brush of ["ignore", "keep", "erase"] as const) byId(`paint-${brush}`).addEventListener("click", () => this.take(brush));
        byId("paint-clear").addEventListener("click", () => {
            this.changed = true;
            this.context().clearRect(0, 0, this.canvas.width, this.canvas.height);
        });
        byId("paint-done").addEventListener("click", () => void this.done());
        this.byPointer();
        this.canvas.addEventListener("keydown", (event) => this.byKey(event));
    }

    async open(photograph: Photograph): Promise<void> {
        this.photograph = photograph;
        this.changed = false;
        byId("painting-title").textContent = photograph.name;
        const response = await ask(`/api/photographs/${photograph.number}/picture`);
        this.full = { width: Number(response.headers.get("x-width")), height: Number(response.headers.get("x-height")) };
        this.picture.src = URL.createObjectURL(await response.blob());
        await this.picture.decode();
        this.canvas.width = this.picture.naturalWidth;
        this.canvas.height = this.picture.naturalHeight;
        if (photograph.used_mask) await this.load(`use`, "ignore");
        if (photograph.kept_mask) await this.load(`keep`, "keep");
        this.dialog.showModal();
        this.canvas.focus();
    }

    private context(): CanvasRenderingContext2D {
        const context = this.canvas.getContext("2d", { willReadFrequently: true });
        if (!context) throw new Error("no canvas");
        return context;
    }

    /** Shows a mask that was painted before: black is ignored in one, white is kept in the other. */
    private async load(kind: string, brush: "ignore" | "keep"): Promise<void> {
        const blob = await (await ask(`/api/photographs/${this.photograph?.number}/mask/${kind}`)).blob();
        const { width, height } = this.canvas;
        const mask = await createImageBitmap(blob, { resizeWidth: width, resizeHeight: height });
        const scratch = new OffscreenCanvas(width, height).getContext("2d");
        if (!scratch) return;
        scratch.drawImage(mask, 0, 0);
        const data = scratch.getImageData(0, 0, width, height).data;
        const context = this.context();
        const painted = context.getImageData(0, 0, width, height);
        for (let at = 0; at < data.length; at += 4) {
            const white = (data[at] ?? 0) > 127;
            if (white === (brush === "keep")) painted.data.set([...COLORS[brush], 255], at);
        }
        context.putImageData(painted, 0, 0);
    }

    private take(brush: Brush): void {
        this.brush = brush;
        for (const one of ["ignore", "keep", "erase"]) byId(`paint-${one}`).setAttribute("aria-pressed", String(one === brush));
    }

    /** A stroke between two places, in shares of the picture. */
    private stroke(from: { x: number; y: number }, to: { x: number; y: number }): void {
        const { width, height } = this.canvas;
        const context = this.context();
        context.globalCompositeOperation = this.brush === "erase" ? "destination-out" : "source-over";
        context.strokeStyle = this.brush === "erase" ? "#000" : `rgb(${COLORS[this.brush].join(" ")})`;
        context.lineWidth = (Number(byId<HTMLInputElement>("paint-size").value) / 100) * width;
        context.lineCap = "round";
        context.beginPath();
        context.moveTo(from.x * width, from.y * height);
        context.lineTo(to.x * width + 0.01, to.y * height);
        context.stroke();
        this.changed = true;
    }

    private byPointer(): void {
        const { canvas } = this;
        const place = (event: PointerEvent) => {
            const box = canvas.getBoundingClientRect();
            return { x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height };
        };
        let last: { x: number; y: number } | null = null;
        canvas.addEventListener("pointerdown", (event) => {
            canvas.setPointerCapture(event.pointerId);
            last = place(event);
            this.stroke(last, last);
        });
        canvas.addEventListener("pointermove", (event) => {
            if (!last) return;
            const next = place(event);
            this.stroke(last, next);
            last = next;
        });
        const end = () => { last = null; };
        canvas.addEventListener("pointerup", end);
        canvas.addEventListener("pointercancel", end);
    }

    private byKey(event: KeyboardEvent): void {
        const by: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
        const move = by[event.key];
        if (!move && event.key !== " ") return;
        event.preventDefault();
        const from = this.at;
        const inside = (value: number) => Math.max(0, Math.min(1, value));
        if (move) this.at = { x: inside(from.x + move[0] * KEY_STEP), y: inside(from.y + move[1] * KEY_STEP) };
        // With Shift, the brush paints as it moves.
        if (event.key === " " || event.shiftKey) this.stroke(from, this.at);
        this.canvas.style.setProperty("--brush-x", `${this.at.x * 100}%`);
        this.canvas.style.setProperty("--brush-y", `${this.at.y * 100}%`);
    }

    private async done(): Promise<void> {
        const { photograph } = this;
        try {
            if (photograph && this.changed) {
                await this.send(photograph.number, "use", "ignore");
                await this.send(photograph.number, "keep", "keep");
            }
            this.dialog.close();
        } catch (error) {
            if (error instanceof Refused) this.trouble(error);
            else throw error;
        }
    }

    /** Sends what was painted with a brush, in the photograph's own size; nothing if nothing was. */
    private async send(number: number, kind: string, brush: "ignore" | "keep"): Promise<void> {
        const { width, height } = this.canvas;
        const painted = this.context().getImageData(0, 0, width, height);
        let any = false;
        for (let at = 0; at < painted.data.length; at += 4) {
            const own = (painted.data[at + 3] ?? 0) > 127 && (painted.data[at] ?? 0) > 127 === (brush === "ignore");
            any ||= own;
            const level = own === (brush === "keep") ? 255 : 0;
            painted.data.set([level, level, level, 255], at);
        }
        const before = brush === "ignore" ? this.photograph?.used_mask : this.photograph?.kept_mask;
        if (!any && !before) return;
        await ask(`/api/photographs/${number}/mask/${kind}`, { method: "PUT", body: any ? await this.inFull(painted) : null });
    }

    private async inFull(painted: ImageData): Promise<Blob> {
        const small = new OffscreenCanvas(painted.width, painted.height);
        small.getContext("2d")?.putImageData(painted, 0, 0);
        const full = new OffscreenCanvas(this.full.width, this.full.height);
        const context = full.getContext("2d");
        if (context) context.imageSmoothingEnabled = false;
        context?.drawImage(small, 0, 0, this.full.width, this.full.height);
        return full.convertToBlob({ type: "image/png" });
    }
}
