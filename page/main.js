// Puts the page together: reads what it holds, finds a way to draw, and shows the first picture.

/** The best renderer there is, or the one that is wanted; null where there is none. */
async function openRenderer(wanted, about) {
    const kinds = { webgpu: WebGpuRenderer, webgl2: WebGl2Renderer };
    for (const [name, kind] of Object.entries(kinds)) {
        if (wanted in kinds && wanted !== name) continue;
        try {
            // A canvas that has had one kind of context gets no other.
            return await kind.open(document.getElementById("canvas").cloneNode(false), about);
        } catch (error) {
            console.info(`${name}: ${error.message}`);
        }
    }
    return null;
}

/** Says why there is only the still picture. */
function showStill(sentence) {
    document.getElementById("still").hidden = false;
    document.getElementById("stage").hidden = true;
    document.getElementById("controls").hidden = true;
    document.getElementById("still-message").textContent = sentence;
}

async function start() {
    const text = (id) => document.getElementById(id).textContent;
    const about = JSON.parse(text("about"));
    performance.mark("start");
    // The device gets ready while the spectrum is unpacked.
    const opening = openRenderer(readAddress().get("renderer"), about);
    const bytes = await inflated(bytesOfBase64(text("data").trim()));
    performance.mark("inflated");
    const spectrum = spectrumOf(bytes, about.normalRadius);
    performance.mark("decoded");
    document.getElementById("data").remove();
    const viewer = new Viewer(spectrum, about);
    applyAddress(viewer);
    const renderer = await opening;
    if (!renderer) {
        const then = document.querySelector("#still img")
            ? "so this picture does not move" : "one of which this page needs to show the surface";
        showStill(`This browser has neither WebGPU nor WebGL2, ${then}.`);
        return;
    }
    try {
        await viewer.use(renderer);
    } catch (error) {
        // Too little memory, say: the other way may have it.
        const other = renderer.name === "WebGPU" ? await openRenderer("webgl2", about) : null;
        if (!other) throw error;
        await viewer.use(other);
    }
    document.getElementById("stage").hidden = false;
    performance.mark("renderer");
    document.getElementById("still").hidden = true;
    document.getElementById("controls").hidden = false;
    viewer.panel = new Panel(viewer, about);
    followKeys(viewer);
    window.addEventListener("hashchange", () => {
        if (location.hash !== viewer.address) applyAddress(viewer);
    });
    window.isospectrum = {
        setIsovalue: (isovalue) => viewer.setIsovalue(isovalue),
        getState: () => viewer.state(),
        screenshot: () => viewer.screenshot(),
        pixels: () => viewer.pixels(),
    };
    await viewer.frame(performance.now());
    performance.mark("picture");
    document.documentElement.dataset.ready = Math.round(performance.now());
    followMessages(viewer);
}

start().catch((error) => {
    console.error(error);
    showStill(`This page cannot be shown: ${error.message}.`);
});
