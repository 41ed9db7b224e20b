// Hosts the page of a spectrum in a frame of its own, so any number stand in one notebook, and keeps the isovalue of the
// page and that of the model the same. The frame may run its scripts and save files, and reach nothing of the notebook.

function render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    frame.allow = "clipboard-write; fullscreen";
    frame.title = "Isosurfaces";
    frame.style.cssText = "border: 0; width: 100%; display: block;";
    const resize = () => { frame.style.height = `${model.get("height")}px`; };
    resize();

    let isReady = false;
    // What the page shows, as far as is known: nothing is told it that it has told.
    let shown = null;
    const send = () => {
        const isovalue = model.get("isovalue");
        if (!isReady || isovalue === shown) return;
        shown = isovalue;
        frame.contentWindow.postMessage({ isospectrum: "setIsovalue", isovalue }, "*");
    };
    const receive = ({ source, data }) => {
        if (source !== frame.contentWindow) return;
        if (data?.isospectrum === "ready") {
            isReady = true;
            shown = data.state.isovalue;
            send();
        } else if (data?.isospectrum === "isovalueChanged" && Number.isFinite(data.isovalue) && data.isovalue !== shown) {
            shown = data.isovalue;
            model.set("isovalue", data.isovalue);
            model.save_changes();
        }
    };
    window.addEventListener("message", receive);
    model.on("change:isovalue", send);
    model.on("change:height", resize);
    frame.srcdoc = model.get("_page");
    el.append(frame);
    // A frame that is gone takes its WebGL or WebGPU context along.
    return () => {
        window.removeEventListener("message", receive);
        model.off("change:isovalue", send);
        model.off("change:height", resize);
        frame.remove();
    };
}

export default { render };
