// Starts a page that contains its isovalues: shows the first ones while a worker decodes the whole spectrum.

/** With at most this many processors, decoding at the same time would delay the first picture. */
const FEW_PROCESSORS = 2;

async function start() {
    const about = readAbout();
    // The device is opened while the rest of the page is still loading.
    const opening = openRenderer(renderersFor(readAddress().get("renderer")), about);
    const first = takeText("first");
    let unpacking;
    const unpack = () => {
        unpacking ??= documentLoaded().then(() => unpackedInWorker(takeText("data"), about));
        // Errors are reported below, where the promise is awaited.
        unpacking.catch(() => {});
        return unpacking;
    };
    if (!first || navigator.hardwareConcurrency > FEW_PROCESSORS) unpack();
    let viewer;
    if (first) {
        viewer = viewerOf(await unpacked(first, about), about);
        viewer.setLoaded(about.first, false);
        // The isovalue in the address may not be among the first ones.
        if (viewer.isovalue !== viewer.wanted) viewer = null;
    }
    const renderer = await openedRenderer(opening);
    if (!renderer) return;
    if (viewer) {
        await showFirstPicture(viewer, renderer);
        await viewer.setSpectrum(await unpack());
        performance.mark("whole");
    } else {
        viewer = viewerOf(await unpack(), about);
        performance.mark("whole");
        await showFirstPicture(viewer, renderer);
    }
    markReady(viewer);
}

run(start, (source) => new LocalFile(source));
