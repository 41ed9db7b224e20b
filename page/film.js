// A film of the sweep through all isovalues, made in the page, picture by picture.

/** Pictures a second: what eyes take for motion. */
const RATE = 25;

/**
 * Makes a film of what the viewer shows while the isovalue goes from one end to the other, as fast as it is played; `isStopped`
 * is asked before each picture with the share that is done. Null where it was stopped.
 */
async function filmOf(viewer, isStopped) {
    const canvas = document.createElement("canvas");
    const seen = viewer.saves.size ?? [viewer.canvas.width, viewer.canvas.height];
    // Packed colours are of two by two pixels.
    const size = ([canvas.width, canvas.height] = seen.map((n) => Math.max(2 * (n >> 1), 2)));
    const film = await WebM.open(canvas, RATE);
    const n = Math.max(Math.round((RATE * SWEEP_SECONDS) / viewer.speed), 2);
    const { isovalue, low, high } = viewer;
    viewer.play(false);
    try {
        for (let i = 0; i < n; i++) {
            if (isStopped(i / n)) return null;
            const t = i / (n - 1);
            viewer.isovalue = low * (1 - t) + high * t;
            canvasOf(canvas, await viewer.saves.pixels(size), viewer);
            await film.add();
        }
        return await film.finish();
    } finally {
        viewer.setIsovalue(isovalue);
    }
}
