// Puts the page together: finds a way to draw, and shows the first picture.

/** Ways to draw, the best first. */
const RENDERERS = { webgpu: WebGpuRenderer, webgl2: WebGl2Renderer };

/** The first of some ways to draw that there is; null where there is none. */
async function openRenderer(names, about) {
    for (const name of names) {
        try {
            // A canvas that has had one kind of context gets no other.
            return await RENDERERS[name].open(byId("canvas").cloneNode(false), about);
        } catch (error) {
            console.info(`${name}: ${error.message}`);
        }
    }
    return null;
}

/** All ways to draw, the wanted one first. What the address wants may be anything. */
function renderersFor(wanted) {
    return Object.keys(RENDERERS).sort((a, b) => (b === wanted) - (a === wanted));
}

/** Says why there is only the still picture. */
function showStill(sentence) {
    byId("still").hidden = false;
    byId("stage").hidden = true;
    byId("controls").hidden = true;
    byId("still-message").textContent = sentence;
}

/** Resolves when all of the page is there. */
function parsed() {
    if (document.readyState !== "loading") return Promise.resolve();
    return new Promise((resolve) => document.addEventListener("DOMContentLoaded", resolve, { once: true }));
}

/** The text of an element that is not needed again. */
function taken(id) {
    const element = byId(id);
    const text = element.textContent;
    element.remove();
    return text;
}

/** Draws with a renderer, or with WebGL2 where WebGPU refuses: too little memory, say. */
async function drawWith(viewer, renderer) {
    try {
        await viewer.use(renderer);
    } catch (error) {
        await drawOtherwise(viewer, renderer, error);
    }
}

async function drawOtherwise(viewer, renderer, error) {
    const other = renderer.name === "WebGPU" ? await openRenderer(["webgl2"], viewer.about) : null;
    if (!other) throw error;
    await viewer.use(other);
}

/** The way to draw, once it is there; without one says so. */
async function drawable(opening) {
    const renderer = await opening;
    if (!renderer) {
        await parsed();
        const then = document.querySelector("#still img")
            ? "so this picture does not move" : "one of which this page needs to show the surface";
        showStill(`This browser has neither WebGPU nor WebGL2, ${then}.`);
    }
    return renderer;
}

/** All is there: the page around may talk to this one. */
function finished(viewer) {
    document.documentElement.dataset.ready = Math.round(performance.now());
    followMessages(viewer);
}

/** Begins a page, or in a worker what it has done there. */
function run(start) {
    if (typeof document === "undefined") {
        work();
        return;
    }
    start(document.currentScript.textContent).catch((error) => {
        console.error(error);
        showStill(`This page cannot be shown: ${error.message}.`);
    });
}

/** Draws what the viewer has, and listens to the reader. */
async function present(viewer, renderer) {
    await drawWith(viewer, renderer);
    document.documentElement.classList.toggle("framed", IS_FRAMED);
    byId("stage").hidden = false;
    performance.mark("renderer");
    byId("still").hidden = true;
    byId("controls").hidden = false;
    viewer.panel = new Panel(viewer, viewer.about);
    viewer.overlay = new Overlay(byId("overlay"));
    viewer.cube = new Cube(byId("cube"), viewer);
    viewer.legend = new Legend(byId("legend"));
    followKeys(viewer);
    window.addEventListener("hashchange", () => {
        if (location.hash !== viewer.address) applyAddress(viewer);
    });
    window.isospectrum = {
        setIsovalue: (isovalue) => viewer.setIsovalue(numberOf(isovalue)),
        getState: () => viewer.state(),
        screenshot: () => viewer.saves.screenshot(),
        pixels: () => viewer.saves.pixels(),
    };
    await viewer.frame(performance.now());
    performance.mark("picture");
}

/** A viewer of a spectrum, showing what the address asks for. */
function viewerOf(spectrum, about) {
    const viewer = new Viewer(spectrum, about);
    applyAddress(viewer);
    return viewer;
}
