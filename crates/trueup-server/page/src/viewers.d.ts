// The parts of the two viewers that this page uses.

interface OpenSeadragonViewer {
    open(source: unknown): void;
    close(): void;
    destroy(): void;
    addOnceHandler(name: string, handler: () => void): void;
    addOverlay(overlay: { element: HTMLElement; location: unknown }): void;
    world: { getItemAt(index: number): { getBounds(): unknown } };
    viewport: {
        zoomBy(factor: number): OpenSeadragonViewer["viewport"];
        applyConstraints(): void;
        goHome(immediately?: boolean): void;
    };
}
declare const OpenSeadragon: (options: Record<string, unknown>) => OpenSeadragonViewer;

interface PannellumViewer {
    destroy(): void;
    getHfov(): number;
    setHfov(degrees: number): void;
}
declare const pannellum: { viewer(id: string, options: Record<string, unknown>): PannellumViewer };
