// Messages to and from a page that contains this one in a frame:
//   { isospectrum: "setIsovalue", isovalue, id }  →  { isospectrum: "reply", id, result: state }
//   { isospectrum: "setView", view: { azimuth, elevation, distance, target }, id }, all properties optional
//   { isospectrum: "setLook", look: { wireframe, silhouette, open, axes, orthographic, occlusion, light, largest, color }, id }, all properties optional
//   { isospectrum: "play", playing, id }          →  ... result: state
//   { isospectrum: "getState", id }               →  ... result: { isovalue, low, high, view, ... }
//   { isospectrum: "screenshot", size, transparent, id }  →  ... result: a PNG, as Blob; size: [width, height], default as in the page
// A reply to a wrong request has `error` instead of `result`. The page sends { isospectrum: "ready", state } after the first picture,
// and from then on { isospectrum: "isovalueChanged", isovalue } after every picture of another isovalue.

/** The HTML of a frame that shows this page in another one. */
function embedOf(viewer) {
    const quoted = (text) => text.replace(/&/g, "&amp;").replace(/"/g, "&quot;");
    return `<iframe src="${quoted(linkTo(viewer))}" title="${quoted(document.title)}" width="720" height="480" `
        + 'style="border: 0" loading="lazy" allow="clipboard-write; fullscreen"></iframe>';
}

/** Checks that an isovalue is a finite number, without conversion from other types. */
function checkedNumber(isovalue) {
    if (Number.isFinite(isovalue)) return isovalue;
    const shown = typeof isovalue === "object" || typeof isovalue === "function"
        ? typeof isovalue : String(isovalue).slice(0, 40);
    throw new TypeError(`isovalue ${isovalue === null ? "null" : shown}, expected a number`);
}

/** Checks the properties of a view in a message, and returns a view with these only. */
function checkedView(sent) {
    const view = {};
    for (const [name, low, high] of [["azimuth", -1e6, 1e6], ["elevation", -90, 90], ["distance", NEAREST, FARTHEST]]) {
        if (sent?.[name] === undefined) continue;
        if (!(low <= sent[name] && sent[name] <= high)) throw new Error(`${name}, expected a number from ${low} to ${high}`);
        view[name] = sent[name];
    }
    if (sent?.target !== undefined) {
        const { target } = sent;
        const isPoint = Array.isArray(target) && target.length === 3 && target.every(Number.isFinite);
        if (!isPoint) throw new Error("target, expected three numbers");
        view.target = [...target];
    }
    return view;
}

/** Checks the properties of a look in a message, and sets them. */
function setLook(viewer, look) {
    const switches = [...SWITCHES, "open"];
    for (const name of switches) {
        if (look?.[name] !== undefined && typeof look[name] !== "boolean") throw new Error(`${name}, expected true or false`);
    }
    const largest = look?.largest;
    if (largest !== undefined && largest !== null && !(Number.isInteger(largest) && largest > 0)) {
        throw new Error("largest, expected null or a number of components");
    }
    const light = look?.light ?? viewer.look.light;
    if (!LIGHTS.includes(light)) throw new Error(`light, expected one of ${LIGHTS.join(", ")}`);
    viewer.setLook({ light });
    viewer.setLook(Object.fromEntries(switches.filter((name) => look?.[name] !== undefined).map((name) => [name, look[name]])));
    const color = look?.color ?? viewer.coloring.color;
    if (!viewer.canShow(color)) throw new Error(`color, expected one of ${Object.keys(COLORS).filter((c) => viewer.canShow(c)).join(", ")}`);
    viewer.setColoring({ color });
    viewer.select({ largest: largest === undefined ? viewer.selection.largest : largest });
}

function listenToMessages(viewer) {
    if (window.parent === window) return;
    const calls = {
        setIsovalue: ({ isovalue }) => {
            checkedNumber(isovalue);
            if (!(viewer.low <= isovalue && isovalue <= viewer.high)) {
                throw new Error(`isovalue ${isovalue} is outside ${viewer.low} to ${viewer.high}`);
            }
            viewer.setIsovalue(isovalue);
            return viewer.state();
        },
        setView: ({ view }) => {
            viewer.isFitWanted = false;
            viewer.setView(checkedView(view));
            return viewer.state();
        },
        setLook: ({ look }) => {
            setLook(viewer, look);
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
    on(window, "message", async ({ source, data }) => {
        // Only the page around this one. The state is not secret, so its origin does not matter.
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
    let sent = viewer.isovalue;
    viewer.onShown = (isovalue) => {
        if (isovalue === sent) return;
        sent = isovalue;
        window.parent.postMessage({ isospectrum: "isovalueChanged", isovalue }, "*");
    };
    window.parent.postMessage({ isospectrum: "ready", state: viewer.state() }, "*");
}
