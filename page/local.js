// Shows a spectrum file of the reader in place of the page's own spectrum.

/** The number of isovalues of the curves. */
const N_MEASURED = 129;

/** What the scripts know about a file: with the styles of the page, without curves yet. */
function aboutOf({ info, events, named }, about, name) {
    return {
        ...about, name, isovalue: (info.range[0] + info.range[1]) / 2, open: false, keep: {}, field: null, color: {}, basis: null, view: {},
        look: { ...about.look, clip: null, also: [] }, knots: info.size.knots, max_triangles: info.size.most_triangles,
        histogram: null, slice: null, samples: info.parameters?.samples, marks: [], suggested: [], extent: [], curves: { events, named },
    };
}

/** Opens a file; one that cannot be read is reported, and the picture stays. */
async function openLocal(file, old) {
    const { message } = old.panel;
    setText(message, `Opening ${file.name}…`);
    const reader = new FileWorker({ file, name: file.name });
    try {
        const about = aboutOf(await reader.call("description"), old.about, file.name.replace(/\.isp$/i, ""));
        await replaceSpectrum(await viewerOfFile(reader, about), old);
    } catch (error) {
        reader.end();
        setText(message, error.message);
    }
}

/** Puts a viewer of a file in the place of another viewer. */
async function replaceSpectrum(viewer, old) {
    const { about } = viewer;
    // It draws nothing more, even if its device is lost.
    Object.assign(old, { renderer: null, isReplaced: true, recover() {} });
    clearTimeout(old.restTimer);
    clearTimeout(old.placeTimer);
    old.file?.end();
    delete document.documentElement.dataset.ready;
    document.documentElement.classList.remove("more");
    const renderer = readAddress().get("renderer");
    setAddress(renderer ? `#renderer=${renderer}` : "#");
    stopListening();
    own.main.querySelector("h1").textContent = about.name;
    own.main.querySelector("canvas").ariaLabel = own.main.querySelector("canvas").ariaLabel.replace(document.title, about.name);
    document.title = about.name;
    for (const element of own.main.querySelectorAll("figure, .caption, .credit")) element.remove();
    document.querySelector("main").replaceWith(own.main.cloneNode(true));
    viewer.setLoaded(viewer.inRange(viewer.intervals[0]), true);
    // What is between the ends of the range is not known yet.
    viewer.isFitWanted = "now";
    const opened = await openedRenderer(openRenderer(renderersFor(renderer), about));
    if (!opened) return;
    await showFirstPicture(viewer, opened);
    markReady(viewer);
    measureAll(viewer);
}

/** Measures the meshes at evenly spaced isovalues while nothing else is loading, and draws the curves. */
async function measureAll(viewer) {
    const { low, high, all, file, about, panel: { message } } = viewer;
    const isovalues = Array.from({ length: N_MEASURED }, (_, i) => low + ((high - low) * i) / (N_MEASURED - 1));
    const found = [];
    try {
        for (let number = 0, from = 0; from < N_MEASURED; number++) {
            const end = isovalues.findLastIndex((c) => c <= all[number][1]) + 1;
            const wanted = { number, isovalues: isovalues.slice(from, end) };
            let measures = from < end ? null : [];
            while (!measures) {
                while (viewer.loading) await pause();
                measures = await file.call("measures", wanted);
            }
            found.push(...measures);
            from = end;
            if (/^(Curves|$)/.test(message.textContent)) setText(message, from < N_MEASURED ? `Curves ${Math.round((100 * from) / N_MEASURED)} %` : "");
        }
    } catch (error) {
        viewer.report(error);
        return;
    }
    if (viewer.isReplaced) return;
    const boxes = found.flatMap(({ box }) => box);
    const end = (i, axis) => Math[i ? "max" : "min"](...boxes.map((p) => p[axis]));
    if (boxes.length > 0) about.extent = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [0, 1, 2].map((axis) => end((i >> axis) & 1, axis)));
    for (const name of CURVES) about.curves[name] = found.map((measures) => measures[name]);
    viewer.panel.plot.drawCurves();
    viewer.request();
}

/** Opens a file that is dropped on the page or chosen. */
function listenToFiles(viewer) {
    const choose = (files) => { if (files.length > 0) openLocal(files[0], viewer); };
    on("open-file", "click", () => byId("file").click());
    on("file", "change", () => choose(byId("file").files));
    for (const name of ["dragover", "drop"]) {
        on(document, name, (event) => {
            // Texts are dropped into fields.
            if (!event.dataTransfer.types.includes("Files")) return;
            event.preventDefault();
            choose(event.dataTransfer.files);
        });
    }
}
