// Talks to a page that shows this one in a frame, by messages:
//   { isospectrum: "setIsovalue", isovalue, id }  →  { isospectrum: "reply", id, result: state }
//   { isospectrum: "setView", view: { azimuth, elevation, distance, target }, id }, each if it is to change
//   { isospectrum: "setLook", look: { wireframe, open, axes, orthographic, occlusion, light, largest, color }, id }, likewise
//   { isospectrum: "play", playing, id }          →  ... result: state
//   { isospectrum: "getState", id }               →  ... result: { isovalue, low, high, view, ... }
//   { isospectrum: "screenshot", size, transparent, id }  →  ... result: a PNG, as Blob; size: [width, height], else as seen
// A reply has `error` instead of `result` where something was wrong. Once the first picture is
// there, { isospectrum: "ready", state } is sent unasked, and from then on { isospectrum: "isovalueChanged", isovalue }
// with every picture that shows another one.

/** The frame that shows it in another page. */
function embedOf(viewer) {
    const quoted = (text) => text.replace(/&/g, "&amp;").replace(/"/g, "&quot;");
    return `<iframe src="${quoted(linkTo(viewer))}" title="${quoted(document.title)}" width="720" height="480" `
        + 'style="border: 0" loading="lazy" allow="clipboard-write; fullscreen"></iframe>';
}

/** What is told as an isovalue, if it is a number: nothing is made one. */
function numberOf(isovalue) {
    if (Number.isFinite(isovalue)) return isovalue;
    const told = typeof isovalue === "object" || typeof isovalue === "function"
        ? typeof isovalue : String(isovalue).slice(0, 40);
    throw new TypeError(`isovalue ${isovalue === null ? "null" : told}, expected a number`);
}

/** Checks that what is told of a view are numbers that make one; returns that alone. */
function viewOf(told) {
    const view = {};
    for (const [name, low, high] of [["azimuth", -1e6, 1e6], ["elevation", -90, 90], ["distance", NEAREST, FARTHEST]]) {
        if (told?.[name] === undefined) continue;
        if (!(low <= told[name] && told[name] <= high)) throw new Error(`${name}, expected a number from ${low} to ${high}`);
        view[name] = told[name];
    }
    if (told?.target !== undefined) {
        const { target } = told;
        const isPoint = Array.isArray(target) && target.length === 3 && target.every(Number.isFinite);
        if (!isPoint) throw new Error("target, expected three numbers");
        view.target = [...target];
    }
    return view;
}

/** Changes how the surface looks as far as it is told. */
function setToldLook(viewer, told) {
    const switches = [...SWITCHES, "open"];
    for (const name of switches) {
        if (told?.[name] !== undefined && typeof told[name] !== "boolean") throw new Error(`${name}, expected true or false`);
    }
    const largest = told?.largest;
    if (largest !== undefined && largest !== null && !(Number.isInteger(largest) && largest > 0)) {
        throw new Error("largest, expected null or a number of components");
    }
    const light = told?.light ?? viewer.look.light;
    if (!LIGHTS.includes(light)) throw new Error(`light, expected one of ${LIGHTS.join(", ")}`);
    viewer.setLook({ light });
    viewer.setLook(Object.fromEntries(switches.filter((name) => told?.[name] !== undefined).map((name) => [name, told[name]])));
    const color = told?.color ?? viewer.coloring.color;
    if (!viewer.canShow(color)) throw new Error(`color, expected one of ${Object.keys(COLORS).filter((c) => viewer.canShow(c)).join(", ")}`);
    viewer.setColoring({ color });
    viewer.select({ largest: largest === undefined ? viewer.selection.largest : largest });
}

function followMessages(viewer) {
    if (window.parent === window) return;
    const calls = {
        setIsovalue: ({ isovalue }) => {
            numberOf(isovalue);
            if (!(viewer.low <= isovalue && isovalue <= viewer.high)) {
                throw new Error(`isovalue ${isovalue} lies outside ${viewer.low} to ${viewer.high}`);
            }
            viewer.setIsovalue(isovalue);
            return viewer.state();
        },
        setView: ({ view }) => {
            viewer.isFitWanted = false;
            viewer.setView(viewOf(view));
            return viewer.state();
        },
        setLook: ({ look }) => {
            setToldLook(viewer, look);
            return viewer.state();
        },
        play: ({ playing }) => {
            viewer.play(playing !== false);
            return viewer.state();
        },
        getState: () => viewer.state(),
        screenshot: ({ size, transparent }) => {
            const { largest } = viewer.renderer;
            const isSize = (n) => Number.isInteger(n) && n >= 1 && n <= largest;
            if (size !== undefined && !(Array.isArray(size) && size.length === 2 && size.every(isSize))) {
                throw new Error(`size, expected two whole numbers from 1 to ${largest}`);
            }
            return viewer.saves.screenshot({ size, transparent: transparent === undefined ? undefined : Boolean(transparent) });
        },
    };
    window.addEventListener("message", async ({ source, data }) => {
        // The frame around this page only. What it gets to know is no secret, so any origin may be it.
        const name = data?.isospectrum;
        if (source !== window.parent || !Object.hasOwn(calls, name)) return;
        const reply = { isospectrum: "reply", id: data.id };
        try {
            reply.result = await calls[name](data);
        } catch (error) {
            reply.error = error.message;
        }
        source.postMessage(reply, "*");
    });
    let told = viewer.isovalue;
    viewer.onShown = (isovalue) => {
        if (isovalue === told) return;
        told = isovalue;
        window.parent.postMessage({ isospectrum: "isovalueChanged", isovalue }, "*");
    };
    window.parent.postMessage({ isospectrum: "ready", state: viewer.state() }, "*");
}
