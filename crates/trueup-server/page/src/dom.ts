// Elements. Texts from photographs and projects become text, never markup.

type Content = string | Node | null | undefined | false;
type Properties = Record<string, string | number | boolean | ((event: Event) => void)>;

export function byId<T extends HTMLElement>(id: string): T {
    const element = document.getElementById(id);
    if (!element) throw new Error(`no element ${id}`);
    return element as T;
}

/** An element with attributes, listeners (`onclick`) and content. */
export function el<K extends keyof HTMLElementTagNameMap>(
    tag: K,
    properties: Properties = {},
    ...content: Content[]
): HTMLElementTagNameMap[K] {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(properties)) {
        if (typeof value === "function") element.addEventListener(name.slice(2), value);
        else if (value === true) element.setAttribute(name, "");
        else if (value !== false) element.setAttribute(name, String(value));
    }
    for (const one of content) if (one) element.append(one);
    return element;
}

/** The first sentence of a text. */
export function firstSentence(text: string): string {
    const stop = text.indexOf(". ");
    return stop < 0 ? text : text.slice(0, stop + 1);
}

export function size(bytes: number): string {
    const units: [number, string][] = [[1e9, "GB"], [1e6, "MB"], [1e3, "kB"]];
    const unit = units.find(([one]) => bytes >= one);
    return unit ? `${(bytes / unit[0]).toFixed(1)} ${unit[1]}` : `${bytes} bytes`;
}
