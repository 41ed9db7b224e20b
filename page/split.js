// Starts a page whose isovalues are in files, one for each interval. A file is fetched when the isovalue enters its interval; until it is
// loaded, the nearest loaded isovalue is shown. The twin of src/page/split.rs.

/** The number of decoded files that are kept, the last ones that were shown. */
const MAX_KEPT = 4;

/** Fetches and keeps the spectra of the files. */
class Chunks {
    constructor(about, script) {
        Object.assign(this, { about, script, kept: new Map() });
    }

    /** The number of the file with an isovalue. */
    numberAt(isovalue) {
        return Math.max(this.about.chunks.findLastIndex(({ from }) => from <= isovalue), 0);
    }

    /** The interval of a file. */
    interval(number) {
        const { from, to } = this.about.chunks[number];
        return [from, to];
    }

    /** The spectrum in a file, fetched if it is not kept. */
    get(number) {
        const known = this.kept.get(number) ?? this.fetched(this.about.chunks[number]);
        this.kept.delete(number);
        this.kept.set(number, known);
        if (this.kept.size > MAX_KEPT) this.kept.delete(this.kept.keys().next().value);
        // A file that could not be fetched is tried again the next time.
        known.catch(() => this.kept.delete(number));
        return known;
    }

    async fetched({ file, crc32 }) {
        const response = await fetch(file);
        if (!response.ok) throw new Error(`${file}: ${response.status}`);
        const bytes = new Uint8Array(await response.arrayBuffer());
        if (crc32Of(bytes) !== crc32) throw new Error(`${file}: not the file of this page`);
        return unpackedInWorker(bytes, this.about, this.script);
    }
}

/** A viewer that fetches isovalues when they are wanted. */
class SplitViewer extends Viewer {
    setIsovalue(isovalue) {
        super.setIsovalue(isovalue);
        this.isWhole = this.isovalue === this.wanted;
    }

    /** The whole range: a sweep continues into the next file. */
    sweepRange() {
        return [this.low, this.high];
    }

    update() {
        // A file that failed is tried again after something else was shown.
        if (this.isWhole) this.failed = null;
        else this.fetch(this.chunks.numberAt(this.wanted));
        super.update();
    }

    async fetch(number) {
        if (number === this.fetching || number === this.failed) return;
        this.fetching = number;
        try {
            const spectrum = await this.chunks.get(number);
            // The reader may have moved on.
            if (number === this.chunks.numberAt(this.wanted)) await this.setSpectrum(spectrum, this.chunks.interval(number));
            if (number === this.fetching) this.fetching = null;
            this.request();
        } catch (error) {
            console.info(error.message);
            if (number === this.fetching) this.fetching = null;
            this.failed = number;
            byId("loading").textContent = `These isovalues cannot be loaded: ${error.message}.`;
        }
    }
}

async function start(script) {
    const about = JSON.parse(byId("about").textContent);
    performance.mark("start");
    const opening = openRenderer(renderersFor(readAddress().get("renderer")), about);
    const first = takeText("first");
    const chunks = new Chunks(about, script);
    const number = chunks.numberAt(about.isovalue);
    const viewer = new SplitViewer(first ? await unpacked(first, about) : await chunks.get(number), about);
    viewer.chunks = chunks;
    applyAddress(viewer);
    viewer.setLoaded(first ? about.first : chunks.interval(number), true);
    const renderer = await openedRenderer(opening);
    if (!renderer) return;
    await showFirstPicture(viewer, renderer);
    performance.mark("whole");
    markReady(viewer);
}

run(start);
