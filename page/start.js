// Begins a page that holds its isovalues: shows the first picture, and then takes over the whole spectrum, which is
// unpacked meanwhile.

/** With no more than these, unpacking beside the first picture would hold it up. */
const FEW_PROCESSORS = 2;

async function start(script) {
    const about = JSON.parse(byId("about").textContent);
    performance.mark("start");
    // The device gets ready while the page arrives.
    const opening = openRenderer(renderersFor(readAddress().get("renderer")), about);
    const first = taken("first");
    let unpacking = null;
    const unpack = () => {
        unpacking ??= parsed().then(() => unpackedBeside(taken("data"), about, script));
        // What is wrong with it is told below, when it is waited for.
        unpacking.catch(() => {});
        return unpacking;
    };
    // Few processors work on the first picture first.
    if (!first || navigator.hardwareConcurrency > FEW_PROCESSORS) unpack();
    let viewer = null;
    if (first) {
        viewer = viewerOf(await unpacked(first, about), about);
        viewer.limit(about.first, false);
        // What comes first is around the isovalue the page opens at.
        if (viewer.isovalue !== viewer.wanted) viewer = null;
    }
    const renderer = await drawable(opening);
    if (!renderer) return;
    if (viewer) {
        await present(viewer, renderer);
        await viewer.takeWhole(await unpack());
        performance.mark("whole");
    } else {
        viewer = viewerOf(await unpack(), about);
        performance.mark("whole");
        await present(viewer, renderer);
    }
    finished(viewer);
}

run(start);
