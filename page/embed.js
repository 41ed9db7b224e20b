// Talks to a page that shows this one in a frame, by messages:
//   { isospectrum: "setIsovalue", isovalue, id }  →  { isospectrum: "reply", id, result: state }
//   { isospectrum: "getState", id }               →  ... result: { isovalue, low, high, view, ... }
//   { isospectrum: "screenshot", id }             →  ... result: a PNG, as Blob
// A reply has `error` instead of `result` where something was wrong. Once the first picture is
// there, { isospectrum: "ready", state } is sent unasked.

/** What is told as an isovalue, if it is a number: nothing is made one. */
function numberOf(isovalue) {
    if (Number.isFinite(isovalue)) return isovalue;
    const told = typeof isovalue === "object" || typeof isovalue === "function"
        ? typeof isovalue : String(isovalue).slice(0, 40);
    throw new TypeError(`isovalue ${isovalue === null ? "null" : told}, expected a number`);
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
        getState: () => viewer.state(),
        screenshot: () => viewer.screenshot(),
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
    window.parent.postMessage({ isospectrum: "ready", state: viewer.state() }, "*");
}
