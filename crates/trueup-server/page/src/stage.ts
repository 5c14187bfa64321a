// The panorama: a preview that follows every wish, tiles of the whole to look closer, and a sphere to stand in.

import type { Preview, Wishes } from "./api.js";
import { ask, post, Refused, told } from "./api.js";
import { byId, el } from "./dom.js";
import type { Layers } from "./layers.js";

type Mode = "look" | "turn" | "around";

/** By how much a press of an arrow key turns, in degrees; with Shift ten times as much. */
const KEY_DEGREES = 1;

export interface Turned {
    trying(wishes: Wishes): void;
    chosen(wishes: Wishes): void;
    /** Where the view is turned to, in degrees. */
    now(): { yaw: number; pitch: number };
    trouble(refused: Refused): void;
}

export class Stage {
    private readonly picture = byId<HTMLImageElement>("preview");
    private readonly tilesElement = byId("tiles");
    private readonly sphereElement = byId("sphere");
    private mode: Mode = "look";
    private drawn: Preview | null = null;
    private busy = false;
    private waiting: Wishes | null = null;
    private viewer: OpenSeadragonViewer | null = null;
    private tiles: number | null = null;
    private sphere: PannellumViewer | null = null;
    private readonly overPreview = byId("layers");
    private overTiles: HTMLElement | null = null;

    constructor(private readonly layers: Layers, private readonly turned: Turned) {
        for (const mode of ["look", "turn", "around"] as const) byId(mode).addEventListener("click", () => this.show(mode));
        byId("closer").addEventListener("click", () => this.zoom(1.4));
        byId("farther").addEventListener("click", () => this.zoom(1 / 1.4));
        byId("whole").addEventListener("click", () => { this.viewer?.viewport.goHome(); this.sphere?.setHfov(100); });
        this.turnByDragging();
        this.picture.addEventListener("keydown", (event) => this.turnByKey(event));
    }

    get preview(): Preview | null {
        return this.drawn;
    }

    /** Nothing to show. */
    clear(): void {
        this.drawn = null;
        this.showTiles(null);
        this.picture.hidden = true;
        this.picture.removeAttribute("src");
        byId("tools").hidden = true;
        this.arrange();
    }

    /** Draws the panorama with these wishes on top; of many that come while one is drawn, the last is drawn next. */
    async draw(wishes: Wishes): Promise<void> {
        if (this.busy) {
            this.waiting = wishes;
            return;
        }
        this.busy = true;
        try {
            const preview = await told<Preview>("/api/preview", { method: "POST", body: JSON.stringify({ options: wishes }) });
            const blob = await (await ask(`/api/preview/${preview.number}`)).blob();
            const address = URL.createObjectURL(blob);
            const older = this.picture.src;
            this.picture.src = address;
            await this.picture.decode().catch(() => undefined);
            if (older.startsWith("blob:")) URL.revokeObjectURL(older);
            this.drawn = preview;
            this.picture.alt = `The panorama, ${preview.projection?.kind ?? "on its mesh"}`;
            this.picture.dataset["number"] = String(preview.number);
            byId("tools").hidden = false;
            this.arrange();
        } catch (error) {
            if (error instanceof Refused) this.turned.trouble(error);
            else throw error;
        } finally {
            this.busy = false;
        }
        const next = this.waiting;
        this.waiting = null;
        if (next) await this.draw(next);
    }

    /** Shows tiles of the whole panorama, or the preview where there are none. */
    showTiles(number: number | null): void {
        if (number === this.tiles) return;
        this.tiles = number;
        this.viewer?.destroy();
        this.viewer = null;
        this.overTiles = null;
        if (number !== null) {
            const over = el("div", { class: "layers" });
            const viewer = OpenSeadragon({
                element: this.tilesElement,
                tileSources: `/api/tiles/${number}/panorama.dzi`,
                drawer: "canvas",
                showNavigationControl: false,
                // A panorama may be looked at pixel by pixel, but not more.
                maxZoomPixelRatio: 2,
                visibilityRatio: 0.8,
                animationTime: 0.4,
                gestureSettingsMouse: { clickToZoom: false, dblClickToZoom: true },
            });
            viewer.addOnceHandler("open", () => viewer.addOverlay({ element: over, location: viewer.world.getItemAt(0).getBounds() }));
            this.viewer = viewer;
            this.overTiles = over;
        }
        this.arrange();
    }

    private show(mode: Mode): void {
        this.mode = mode;
        this.arrange();
        if (mode === "turn") this.picture.focus();
    }

    /** Shows what the mode asks for and there is. */
    private arrange(): void {
        const sphere = this.drawn?.projection?.sphere ?? null;
        const canTurn = Boolean(this.drawn?.projection);
        const around = sphere !== null && sphere.projection === "equirectangular";
        if ((this.mode === "around" && !around) || (this.mode === "turn" && this.drawn && !canTurn)) this.mode = "look";
        byId("around").hidden = !around;
        byId<HTMLButtonElement>("turn").disabled = !canTurn;
        for (const mode of ["look", "turn", "around"]) byId(mode).setAttribute("aria-pressed", String(mode === this.mode));
        const showTiles = this.mode === "look" && this.viewer !== null;
        this.tilesElement.hidden = !showTiles;
        this.sphereElement.hidden = this.mode !== "around";
        this.picture.hidden = !this.drawn || showTiles || this.mode === "around";
        this.picture.classList.toggle("turning", this.mode === "turn");
        if (this.mode === "turn") this.picture.tabIndex = 0;
        else this.picture.removeAttribute("tabindex");
        for (const id of ["closer", "farther", "whole"]) byId<HTMLButtonElement>(id).disabled = !(showTiles || this.mode === "around");
        this.overPreview.hidden = this.picture.hidden;
        if (showTiles && this.overTiles && this.tiles !== null) this.layers.over({ kind: "tiles", number: this.tiles, element: this.overTiles });
        else if (!this.picture.hidden && this.drawn) this.layers.over({ kind: "preview", number: this.drawn.number, element: this.overPreview });
        else this.layers.over(null);
        this.lookAround();
    }

    private lookAround(): void {
        this.sphere?.destroy();
        this.sphere = null;
        const { drawn } = this;
        if (this.mode !== "around" || !drawn?.projection?.sphere) return;
        const { full_width, full_height, top } = drawn.projection.sphere;
        const height = (180 * drawn.canvas.height) / full_height;
        this.sphere = pannellum.viewer("sphere", {
            type: "equirectangular",
            panorama: `/api/preview/${drawn.number}`,
            autoLoad: true,
            haov: (360 * drawn.canvas.width) / full_width,
            vaov: height,
            vOffset: 90 - (180 * top) / full_height - height / 2,
            hfov: 100,
            showControls: false,
        });
    }

    private zoom(factor: number): void {
        this.viewer?.viewport.zoomBy(factor).applyConstraints();
        if (this.sphere) this.sphere.setHfov(this.sphere.getHfov() / factor);
    }

    /** Degrees of the panorama's middle for a pixel of the screen. */
    private degreesPerPixel(): number {
        const { drawn, picture } = this;
        if (!drawn?.projection) return 0;
        const shown = Math.min(picture.clientWidth / drawn.canvas.width, picture.clientHeight / drawn.canvas.height);
        return 180 / Math.PI / (drawn.projection.px_per_radian * shown);
    }

    private turnByDragging(): void {
        const { picture } = this;
        let from: { x: number; y: number; yaw: number; pitch: number; degrees: number } | null = null;
        const wishes = (event: PointerEvent): Wishes => {
            if (!from) return {};
            const { degrees } = from;
            return turnedTo(from.yaw - (event.clientX - from.x) * degrees, from.pitch + (event.clientY - from.y) * degrees);
        };
        picture.addEventListener("pointerdown", (event) => {
            if (this.mode !== "turn") return;
            picture.setPointerCapture(event.pointerId);
            from = { x: event.clientX, y: event.clientY, degrees: this.degreesPerPixel(), ...this.turned.now() };
        });
        picture.addEventListener("pointermove", (event) => { if (from) this.turned.trying(wishes(event)); });
        picture.addEventListener("pointerup", (event) => {
            if (from) this.turned.chosen(wishes(event));
            from = null;
        });
        picture.addEventListener("pointercancel", () => { from = null; });
    }

    private turnByKey(event: KeyboardEvent): void {
        const step = event.shiftKey ? 10 * KEY_DEGREES : KEY_DEGREES;
        const by: Record<string, [number, number]> = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
        const [yaw, pitch] = by[event.key] ?? [0, 0];
        if (this.mode !== "turn" || (yaw === 0 && pitch === 0)) return;
        event.preventDefault();
        const now = this.turned.now();
        this.turned.chosen(turnedTo(now.yaw + yaw, now.pitch + pitch));
    }
}

/** A direction as the options have it: round and round, but never beyond the zenith. */
function turnedTo(yaw: number, pitch: number): Wishes {
    const around = ((((yaw + 180) % 360) + 360) % 360) - 180;
    const up = Math.max(-90, Math.min(90, pitch));
    return { "projection.yaw": around.toFixed(2), "projection.pitch": up.toFixed(2) };
}

/** Asks for tiles of the whole panorama; whether they were begun, which they are not while something else is being done. */
export async function cutTiles(): Promise<boolean> {
    return (await post("/api/tiles").catch(() => null))?.status === 202;
}
