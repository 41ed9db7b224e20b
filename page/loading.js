// Shows isovalues of a spectrum file. What an isovalue needs of the file is read when it is wanted; until it is there, the nearest loaded
// isovalue is shown.

/** Milliseconds between looks whether an isovalue of a film is loaded. */
const PAUSE = 20;

const pause = () => new Promise((resolve) => setTimeout(resolve, PAUSE));

/** Pictures of films wait until their isovalues are loaded. */
class LoadingSaves extends Saves {
    async pixels(size, isTransparent) {
        await this.viewer.untilLoaded();
        return super.pixels(size, isTransparent);
    }
}

/** A viewer that loads isovalues when they are wanted. */
class LoadingViewer extends Viewer {
    constructor(spectrum, about, file, intervals) {
        super(spectrum, about);
        Object.assign(this, { file, intervals, saves: new LoadingSaves(this) });
    }

    setIsovalue(isovalue) {
        // Chunks of further isosurfaces are loaded, too.
        const c = clamped(isovalue, [this.low, this.high]);
        const interval = this.intervals.find(([low, high]) => low <= c && c <= high);
        if (interval) this.loaded = this.inRange(interval);
        super.setIsovalue(isovalue);
        this.isWhole = this.isovalue === this.wanted;
    }

    /** The whole range: a sweep continues with the isovalues that are loaded next. */
    sweepRange() {
        return [this.low, this.high];
    }

    /** The part of an interval that is in the range. */
    inRange(interval) {
        return interval.map((c) => clamped(c, [this.low, this.high]));
    }

    /** Whether the mesh at an isovalue is loaded. */
    isLoaded(isovalue) {
        return this.intervals.some(([low, high]) => low <= isovalue && isovalue <= high);
    }

    shownExtras() {
        return this.extras.filter(({ isovalue }) => this.isLoaded(isovalue));
    }

    async setSpectrum(spectrum, loaded) {
        // Positions in a file have finer units than those that the page contains.
        this.about.step = spectrum.step;
        await super.setSpectrum(spectrum, this.inRange(loaded));
    }

    update() {
        const wanted = [this.wanted, ...this.extras.map(({ isovalue }) => isovalue)];
        // What failed is tried again after something else was shown.
        if (wanted.every((c) => this.isLoaded(c))) this.failed = null;
        else if (this.all) this.load([...new Set(wanted.map((c) => this.all.findIndex(([, high]) => c <= high)))]);
        else this.readIntervals();
        super.update();
    }

    /** Reads the intervals of isovalues that need the same chunks. */
    async readIntervals() {
        if (this.loading || this.failed === this.wanted) return;
        this.loading = "intervals";
        try {
            this.all = await this.file.call("intervals");
        } catch (error) {
            this.failed = this.wanted;
            this.report(error);
        }
        this.loading = null;
        this.request();
    }

    /** Loads some intervals; the first one is shown. */
    async load(numbers) {
        const key = numbers.join();
        if (key === this.loading || key === this.failed) return;
        this.loading = key;
        try {
            const spectrum = await this.file.call("load", numbers);
            // The reader may have moved on.
            if (!spectrum || key !== this.loading) return;
            this.intervals = numbers.map((i) => this.all[i]);
            await this.setSpectrum(spectrum, this.intervals[0]);
        } catch (error) {
            if (key !== this.loading) return;
            this.failed = key;
            this.report(error);
        }
        if (key === this.loading) this.loading = null;
        this.request();
    }

    /** Waits until the isovalue that was just set, of a film, is loaded. */
    async untilLoaded() {
        if (this.isLoaded(this.isovalue)) return;
        this.setIsovalue(this.isovalue);
        while (!this.isWhole) {
            if (this.failed) throw new Error("some isovalues cannot be loaded");
            await pause();
        }
    }

    /** Says why isovalues are not loaded. */
    report(error) {
        console.info(error.message);
        const element = byId("loading");
        element.textContent = `Other isovalues cannot be loaded: ${error.message}.`;
        element.hidden = false;
    }
}

/** A viewer of a file that shows an isovalue of `about`, which gets the units of the file. */
async function viewerOfFile(file, about) {
    const all = await file.call("intervals");
    const number = all.findIndex(([, high]) => about.isovalue <= high);
    const spectrum = await file.call("load", [number]);
    about.step = spectrum.step;
    return Object.assign(new LoadingViewer(spectrum, about, file, [all[number]]), { all });
}
