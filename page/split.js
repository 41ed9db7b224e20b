// Begins a page whose isovalues lie in files beside it, each with the isovalues of an interval: a file is fetched when the isovalue
// comes into its interval, and until it is there the nearest isovalue that is there is shown.

/** Files that stay unpacked: the last ones that were shown. */
const MOST_KEPT = 4;

/** The spectra of the files. */
class Chunks {
    constructor(about, script) {
        Object.assign(this, { about, script, kept: new Map() });
    }

    /** The number of the file with an isovalue. */
    at(isovalue) {
        return Math.max(this.about.chunks.findLastIndex(({ from }) => from <= isovalue), 0);
    }

    /** Between which isovalues a file's are. */
    ends(number) {
        const { from, to } = this.about.chunks[number];
        return [from, to];
    }

    /** The spectrum in a file: fetched once, as long as it is one of the last. */
    get(number) {
        const known = this.kept.get(number) ?? this.fetched(this.about.chunks[number].file);
        this.kept.delete(number);
        this.kept.set(number, known);
        if (this.kept.size > MOST_KEPT) this.kept.delete(this.kept.keys().next().value);
        // What could not be had may be there the next time.
        known.catch(() => this.kept.delete(number));
        return known;
    }

    async fetched(file) {
        const response = await fetch(file);
        if (!response.ok) throw new Error(`${file}: ${response.status}`);
        return unpackedBeside(await response.text(), this.about, this.script);
    }
}

/** A viewer of the isovalues that are there, which fetches others when they are wanted. */
class SplitViewer extends Viewer {
    setIsovalue(isovalue) {
        super.setIsovalue(isovalue);
        this.isWhole = this.isovalue === this.wanted;
    }

    /** All: those of the next file are wanted at the end of one. */
    reach() {
        return [this.low, this.high];
    }

    update() {
        // What was not to be had is asked for again once something else was shown.
        if (this.isWhole) this.missed = null;
        else this.fetch(this.chunks.at(this.wanted));
        super.update();
    }

    async fetch(number) {
        if (number === this.fetching || number === this.missed) return;
        this.fetching = number;
        try {
            const spectrum = await this.chunks.get(number);
            // Others may be wanted by now.
            if (number === this.chunks.at(this.wanted)) await this.takeWhole(spectrum, this.chunks.ends(number));
            if (number === this.fetching) this.fetching = null;
            this.request();
        } catch (error) {
            console.info(error.message);
            if (number === this.fetching) this.fetching = null;
            this.missed = number;
            byId("loading").textContent = `These isovalues are not to be had: ${error.message}.`;
        }
    }
}

async function start(script) {
    const about = JSON.parse(byId("about").textContent);
    performance.mark("start");
    const opening = openRenderer(renderersFor(readAddress().get("renderer")), about);
    const first = taken("first");
    const chunks = new Chunks(about, script);
    const number = chunks.at(about.isovalue);
    const viewer = new SplitViewer(first ? await unpacked(first, about) : await chunks.get(number), about);
    viewer.chunks = chunks;
    applyAddress(viewer);
    viewer.limit(first ? about.first : chunks.ends(number), true);
    const renderer = await drawable(opening);
    if (!renderer) return;
    await present(viewer, renderer);
    performance.mark("whole");
    finished(viewer);
}

run(start);
