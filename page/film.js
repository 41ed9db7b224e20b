// Films of the sweep through all isovalues.

/** Pictures a second. */
const RATE = 25;

/**
 * Makes a film of the viewer while the isovalue goes from one end of the range to the other, at the speed of "Play". `isStopped`
 * is called before each picture with the share that is done; the film is null if it returns true.
 */
async function filmOf(viewer, isStopped) {
    const canvas = element("canvas");
    const wanted = viewer.saves.size ?? [viewer.canvas.width, viewer.canvas.height];
    // Encoders need even sides: they store one colour for two by two pixels.
    const size = ([canvas.width, canvas.height] = wanted.map((n) => Math.max(2 * (n >> 1), 2)));
    const film = await WebM.open(canvas, RATE);
    const n = Math.max(Math.round((RATE * SWEEP_SECONDS) / viewer.speed), 2);
    const { isovalue, low, high } = viewer;
    viewer.play(false);
    try {
        for (let i = 0; i < n; i++) {
            if (isStopped(i / n)) return null;
            const t = i / (n - 1);
            viewer.isovalue = low * (1 - t) + high * t;
            drawPicture(canvas, await viewer.saves.pixels(size), viewer);
            await film.add();
        }
        return await film.finish();
    } finally {
        viewer.setIsovalue(isovalue);
    }
}
