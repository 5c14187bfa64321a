// The photographs, each with what became of it.

import type { Photograph, Told } from "./api.js";
import { byId, el } from "./dom.js";

export interface Asked {
    leaveOut(numbers: Record<number, boolean>): void;
    paint(photograph: Photograph): void;
}

/** Thumbnails by group: the panorama, what belongs together beside it, what was left out. */
export class Strip {
    private shown = "";

    constructor(private readonly asked: Asked) {}

    show(now: Told): void {
        const key = JSON.stringify([now.photographs, now.folder?.inside]);
        if (key === this.shown) return;
        this.shown = key;
        const strip = byId("strip");
        const focused = document.activeElement?.id ?? "";
        const groups = grouped(now.photographs);
        strip.replaceChildren(...groups.map((group) => this.group(group, now)));
        if (focused.startsWith("photograph-")) document.getElementById(focused)?.focus();
    }

    private group(group: Group, now: Told): HTMLElement {
        const others = now.photographs.filter((one) => !group.photographs.includes(one));
        const instead = group.together
            ? el("button", { type: "button", class: "quiet", onclick: () => this.asked.leaveOut(Object.fromEntries(now.photographs.map((one) => [one.number, others.includes(one)]))) }, "Stitch these instead")
            : null;
        const items = group.photographs.map((photograph) => this.item(photograph, now));
        return el("section", { class: "group" }, el("h2", {}, group.title, instead), el("ul", {}, ...items));
    }

    private item(photograph: Photograph, now: Told): HTMLElement {
        const { number, name, verdict } = photograph;
        const address = `/api/photographs/${number}/thumbnail?of=${encodeURIComponent(`${now.folder?.inside ?? ""}/${name}`)}`;
        const picture = el("img", { src: address, alt: "", loading: "lazy", width: 132, height: 99 });
        const said = photograph.left_out ? "left out by you" : (verdict?.reason ?? "");
        const masked = photograph.used_mask || photograph.kept_mask ? el("span", { class: "badge" }, "painted") : null;
        const leave = el(
            "button",
            { type: "button", id: `photograph-${number}-leave`, class: "quiet", "aria-label": `${photograph.left_out ? "Take in" : "Leave out"} ${name}`, onclick: () => this.asked.leaveOut({ [number]: !photograph.left_out }) },
            photograph.left_out ? "Take in" : "Leave out",
        );
        const paint = el("button", { type: "button", id: `photograph-${number}-paint`, class: "quiet", "aria-label": `Paint on ${name}`, onclick: () => this.asked.paint(photograph) }, "Paint");
        const isOut = photograph.left_out || (verdict !== null && !verdict.used);
        return el(
            "li",
            isOut ? { class: "out" } : {},
            el("div", { class: "thumbnail" }, picture, masked),
            el("p", { class: "name", title: name }, name),
            said ? el("p", { class: "small" }, said, verdict?.hint && !photograph.left_out ? ` ${verdict.hint}` : "") : null,
            el("div", { class: "buttons" }, leave, paint),
        );
    }
}

interface Group { title: string; photographs: Photograph[]; together: boolean }

function grouped(photographs: Photograph[]): Group[] {
    const stitched = photographs.some((one) => one.verdict);
    if (!stitched) {
        const title = photographs.length === 1 ? "1 photograph" : `${photographs.length} photographs`;
        return photographs.length > 0 ? [{ title, photographs, together: false }] : [];
    }
    const used = photographs.filter((one) => one.verdict?.used);
    const rest = photographs.filter((one) => !one.verdict?.used);
    const byGroup = new Map<number, Photograph[]>();
    for (const one of rest) {
        const group = one.verdict?.group;
        if (group !== null && group !== undefined) byGroup.set(group, [...(byGroup.get(group) ?? []), one]);
    }
    const groups: Group[] = [{ title: `In the panorama: ${used.length}`, photographs: used, together: false }];
    const together = [...byGroup.values()].filter((group) => group.length > 1);
    for (const group of together) groups.push({ title: `These ${group.length} belong together`, photographs: group, together: true });
    const alone = rest.filter((one) => !together.some((group) => group.includes(one)));
    if (alone.length > 0) groups.push({ title: `Not in it: ${alone.length}`, photographs: alone, together: false });
    return groups;
}
