// Starts a page whose isovalues are in a spectrum file on a server.

async function start() {
    const about = readAbout();
    const opening = openRenderer(renderersFor(readAddress().get("renderer")), about);
    const { link } = about;
    const file = new FileWorker({ ...link, name: link.url, address: String(new URL(link.url, document.baseURI)) });
    const reading = file.call("intervals");
    // Reported below.
    reading.catch(() => {});
    const first = takeText("first");
    const viewer = first ? new LoadingViewer(await unpacked(first, about), about, file, [about.first]) : await viewerOfFile(file, about);
    applyAddress(viewer);
    viewer.setLoaded(viewer.inRange(viewer.intervals[0]), true);
    const renderer = await openedRenderer(opening);
    if (!renderer) return;
    await showFirstPicture(viewer, renderer);
    try {
        viewer.all = await reading;
    } catch (error) {
        viewer.report(error);
    }
    performance.mark("whole");
    markReady(viewer);
}

run(start, (source) => (source.file ? new LocalFile(source) : new LinkedFile(source)));
