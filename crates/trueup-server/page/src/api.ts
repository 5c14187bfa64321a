// What the server is asked, and what it tells.

export interface Trouble { message: string; hint: string }
export interface Stage { name: string; done: number; total: number; finished: boolean }
export interface Verdict { used: boolean; reason: string; hint: string; group: number | null }
export interface Photograph {
    number: number;
    name: string;
    dropped: boolean;
    left_out: boolean;
    used_mask: string | null;
    kept_mask: string | null;
    verdict: Verdict | null;
}
export interface Warning { subject: string; message: string; hint: string }
export interface Stitched {
    number: number;
    stale: boolean;
    used: number;
    judgement: Record<string, string | null>;
    warnings: Warning[];
}
export interface Export { number: number; to_fetch: boolean; files: { name: string; bytes: number }[] }
export interface Told {
    news: number;
    /** `inside` is its path from the folder of the beginning. */
    folder: { name: string; inside: string; folders: string[]; projects: string[] } | null;
    photographs: Photograph[];
    work: { task: "stitch" | "tiles" | "export" | "reopen"; stages: Stage[]; stopping: boolean } | null;
    trouble: Trouble | null;
    stitched: Stitched | null;
    wishes: Record<string, string>;
    can_undo: boolean;
    can_redo: boolean;
    tiles: number | null;
    exports: Export[];
}
export interface Option {
    name: string;
    default: string;
    allowed: string;
    unit: string;
    meaning: string;
    choices: { name: string; meaning: string }[];
    phase: string;
}
export interface Possible {
    options: Option[];
    /** Extensions of photographs that are read, with their dots. */
    photographs: string[];
    extensions: string;
    side_outputs: { flag: string; meaning: string }[];
    layers: { name: string; title: string }[];
}
/** A drawing over a preview or tiles; none where there is nothing to draw. */
export interface Layer {
    drawing: string | null;
    legend: { color: string; dashes: string; words: string }[];
    is_measured_elsewhere: boolean;
}
export interface Sphere { full_width: number; full_height: number; left: number; top: number; projection: string }
export interface Preview {
    number: number;
    stitched: number;
    canvas: { width: number; height: number; full_turn: boolean };
    projection: { kind: string; px_per_radian: number; sphere: Sphere | null } | null;
    warnings: Warning[];
}
export type Wishes = Record<string, string>;

/** What was refused, in words for people. */
export class Refused extends Error {
    constructor(readonly trouble: Trouble) {
        super(trouble.message);
    }
}

export async function ask(path: string, init: RequestInit = {}): Promise<Response> {
    let response: Response;
    try {
        response = await fetch(path, init);
    } catch {
        throw new Refused({ message: "the program does not answer", hint: "Look whether it still runs in the terminal." });
    }
    if (!response.ok) {
        const trouble = await response.json().catch(() => ({ message: response.statusText, hint: "Reload the page." }));
        throw new Refused(trouble as Trouble);
    }
    return response;
}

export async function told<T>(path: string, init: RequestInit = {}): Promise<T> {
    return (await (await ask(path, init)).json()) as T;
}

export function post(path: string, body: unknown = {}): Promise<Response> {
    return ask(path, { method: "POST", body: JSON.stringify(body) });
}

export function wish(options: Wishes, left_out: Record<number, boolean> = {}): Promise<Response> {
    return post("/api/wishes", { options, left_out });
}
