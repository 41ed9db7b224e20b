// Talks to a page that shows this one in a frame, by messages:
//   { isospectrum: "setIsovalue", isovalue, id }  →  { isospectrum: "reply", id, result: state }
//   { isospectrum: "getState", id }               →  ... result: { isovalue, low, high, view, ... }
//   { isospectrum: "screenshot", id }             →  ... result: a PNG, as Blob
// A reply has `error` instead of `result` where something was wrong. Once the first picture is
// there, { isospectrum: "ready", state } is sent unasked.

function followMessages(viewer) {
    if (window.parent === window) return;
    const calls = {
        setIsovalue: ({ isovalue }) => {
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
