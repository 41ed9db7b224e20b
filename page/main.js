// Opens a renderer and shows the first picture.

/** The renderers, the preferred one first. */
const RENDERERS = { webgpu: WebGpuRenderer, webgl2: WebGl2Renderer };

/** Opens the first of some renderers that works; null if none does. */
async function openRenderer(names, about) {
    for (const name of names) {
        try {
            // A canvas can have one kind of context only.
            return await RENDERERS[name].open(byId("canvas").cloneNode(false), about);
        } catch (error) {
            console.info(`${name}: ${error.message}`);
        }
    }
    return null;
}

/** The names of all renderers, the wanted one (any text of the address) first. */
function renderersFor(wanted) {
    return Object.keys(RENDERERS).sort((a, b) => (b === wanted) - (a === wanted));
}

/** Shows the still picture with a sentence why. */
function showStill(sentence) {
    byId("still").hidden = false;
    byId("stage").hidden = true;
    byId("controls").hidden = true;
    byId("still-message").textContent = sentence;
}

/** Resolves when the page is loaded. */
function documentLoaded() {
    if (document.readyState !== "loading") return Promise.resolve();
    return new Promise((resolve) => on(document, "DOMContentLoaded", resolve, { once: true }));
}

/** Removes an element and returns its text. */
function takeText(id) {
    const element = byId(id);
    const text = element.textContent;
    element.remove();
    return text;
}

/** Draws with a renderer, or with WebGL2 if WebGPU refuses, for example for lack of memory. */
async function drawWith(viewer, renderer) {
    try {
        await viewer.setRenderer(renderer);
    } catch (error) {
        await drawWithWebGl2(viewer, renderer, error);
    }
}

async function drawWithWebGl2(viewer, renderer, error) {
    const other = renderer.name === "WebGPU" ? await openRenderer(["webgl2"], viewer.about) : null;
    if (!other) throw error;
    await viewer.setRenderer(other);
}

/** The renderer that is being opened; shows the still picture if there is none. */
async function openedRenderer(opening) {
    const renderer = await opening;
    if (!renderer) {
        await documentLoaded();
        const consequence = document.querySelector("#still img")
            ? "so this picture does not move" : "one of which this page needs to show the surface";
        showStill(`This browser has neither WebGPU nor WebGL2, ${consequence}.`);
    }
    return renderer;
}

/** Marks the page as ready and starts to answer messages. */
function markReady(viewer) {
    document.documentElement.dataset.ready = Math.round(performance.now());
    listenToMessages(viewer);
}

/** What the program has written about the page. */
function readAbout() {
    performance.mark("start");
    return JSON.parse(byId("about").textContent);
}

/** Runs the script: starts the page, or answers as a worker. `openFile` opens a file from its source. */
function run(start, openFile) {
    own.openFile = openFile;
    if (typeof document === "undefined") {
        runWorker();
        return;
    }
    Object.assign(own, { script: document.currentScript.textContent, main: document.querySelector("main").cloneNode(true) });
    start().catch((error) => {
        console.error(error);
        showStill(`This page cannot be shown: ${error.message}.`);
    });
}

/** Draws the first picture and listens to input. */
async function showFirstPicture(viewer, renderer) {
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
    listenToKeys(viewer);
    listenToFiles(viewer);
    on(viewer.prefersDark, "change", () => viewer.request());
    on(window, "beforeprint", () => byId("print-picture").replaceChildren(drawPrint(viewer)));
    on(window, "hashchange", () => {
        if (location.hash !== viewer.address) applyAddress(viewer);
    });
    window.isospectrum = {
        setIsovalue: (isovalue) => viewer.setIsovalue(checkedNumber(isovalue)),
        getState: () => viewer.state(),
        screenshot: () => viewer.saves.screenshot(),
        pixels: () => viewer.saves.pixels(),
    };
    await viewer.frame(performance.now());
    performance.mark("picture");
}

/** A viewer of a spectrum, in the state that the address describes. */
function viewerOf(spectrum, about) {
    const viewer = new Viewer(spectrum, about);
    applyAddress(viewer);
    return viewer;
}
