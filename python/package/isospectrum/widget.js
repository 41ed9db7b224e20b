// Shows the page of a spectrum in an iframe of its own, so that a notebook may contain several, and synchronizes the isovalues of
// the page and of the model. The iframe may run scripts and save files, but has no access to the notebook.

function render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    frame.allow = "clipboard-write; fullscreen";
    frame.title = "Isosurfaces";
    frame.style.cssText = "border: 0; width: 100%; display: block;";
    const resize = () => { frame.style.height = `${model.get("height")}px`; };
    resize();

    let isReady = false;
    // The last isovalue known to be shown by the page, which is not sent back to it.
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
    // Removing the iframe also releases its WebGL or WebGPU context.
    return () => {
        window.removeEventListener("message", receive);
        model.off("change:isovalue", send);
        model.off("change:height", resize);
        frame.remove();
    };
}

export default { render };
