// Reads a spectrum file of the reader, which was dropped on the page or chosen.

/** The events of section EVNT: isovalue and kind of each, and number, persistence and place of those of the largest persistence. */
function eventsOf(content) {
    const columns = new Columns(content);
    const n = columns.count();
    const doubles = () => new Float64Array(columns.column64(n).buffer);
    const isovalues = doubles();
    const places = [0, 1, 2].map(() => signed(columns.column(n)));
    const kinds = columns.column(n);
    const persistence = doubles();
    const largest = [...persistence.keys()].sort((i, j) => persistence[j] - persistence[i]).slice(0, MAX_NAMED);
    return {
        events: Array.from(isovalues, (c, i) => [c, kinds[i]]),
        named: largest.map((i) => [i, persistence[i], places.map((place) => place[i] / EVENT_UNITS)]),
    };
}

/** The most events of which more than isovalue and kind is known, as in src/page/curves.rs. */
const MAX_NAMED = 200;
/** Units of the places of events in a voxel. */
const EVENT_UNITS = 1024;

/** The least and the greatest coordinates of a mesh; none of one that is mostly caps, which is the box of the volume. */
function extentOf({ positions, caps }) {
    if (2 * caps.reduce((n, cap) => n + cap, 0) > caps.length) return [];
    const box = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    positions.forEach((x, i) => {
        box[0][i % 3] = Math.min(box[0][i % 3], x);
        box[1][i % 3] = Math.max(box[1][i % 3], x);
    });
    return positions.length > 0 ? box : [];
}

class LocalFile extends ChunkedFile {
    async bytes(from, end) {
        return new Uint8Array(await this.file.slice(from, end).arrayBuffer());
    }

    async heads() {
        const { size } = this.file;
        checkHeader(await this.bytes(0, FILE_HEADER));
        const footer = await this.bytes(size - FOOTER, size);
        if (textOf(footer.subarray(12)) !== END) throw new Error("its end is missing");
        const head = await this.bytes(Number(viewOf(footer).getBigUint64(0, true)), size);
        const events = sectionIn(sectionIn(head, "INFO").rest, "EVNT");
        this.events = eventsOf(await contentOf(events));
        return [head, events.rest];
    }

    /** What the page tells about the file. */
    async description() {
        const { info } = await this.tables();
        return { info, ...this.events };
    }

    /** The measures of the meshes at isovalues of an interval; null if other isovalues were wanted meanwhile. */
    async measures({ number, isovalues }) {
        const spectrum = await this.spectrumOf([number]);
        if (!spectrum) return null;
        const { wanted } = this;
        const query = new Query(spectrum, spectrum.step);
        const all = [];
        for (const c of isovalues) {
            await otherTasks();
            if (this.wanted !== wanted) return null;
            query.moveTo(c, false);
            const mesh = query.mesh(false);
            const box = extentOf(mesh);
            all.push({ box, ...measuresOf(placeInWorld(mesh, spectrum.info.volume.placement)) });
        }
        return all;
    }
}
