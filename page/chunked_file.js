// Reads a spectrum file in parts: its tables, and the chunks that some isovalues need. Everything is checked by its checksum. The twin of
// src/file/spectrum_file.rs; where the bytes come from is in ranges.js and local_file.js.

const OTHER_FILE = "not the file of this page";

/** Decoded chunks are kept for so many sets of isovalues, the last ones that were wanted. */
const MAX_KEPT = 4;

/** The largest number below a finite one. */
function below(x) {
    if (x === 0) return -Number.MIN_VALUE;
    const number = new Float64Array([x]);
    new BigInt64Array(number.buffer)[0] += x > 0 ? -1n : 1n;
    return number[0];
}

/** The numbers of sorted lists, sorted, each once. */
const unionOf = (lists) => (lists.length > 1 ? Float64Array.from(new Set(lists.flatMap((list) => [...list]))).sort() : lists[0]);

/**
 * The intervals of isovalues that need the same chunks, ascending: each with its `range` and the last chunks (`ends`) on the ways from the roots. The ends of a
 * single tree reach to all isovalues.
 */
function intervalsOf(chunks, tables) {
    const isSingle = tables.length === 1;
    const ends = chunks.filter(({ pivot }) => pivot < 0).map((chunk) => {
        const { tree, span: [start, end] } = chunk;
        const table = tables[tree];
        const from = isSingle && start === 0 ? -Infinity : table[start];
        return { chunk, from, to: end < table.length ? table[end] : isSingle ? Infinity : table.at(-1) };
    });
    const cuts = unionOf([[-Infinity], ends.flatMap(({ from, to }) => [from, to]), [Infinity]]);
    return [...cuts.subarray(1)].map((end, i) => {
        const found = ends.filter(({ from, to }) => from <= cuts[i] && cuts[i] < to);
        // Where no tree has triangles, any chunk serves.
        return { range: [cuts[i], end === Infinity ? end : below(end)], ends: (found.length > 0 ? found : ends.slice(0, 1)).map(({ chunk }) => chunk) };
    });
}

/** Waits until the messages so far are handled. */
const otherTasks = () => new Promise((resolve) => setTimeout(resolve));

/**
 * A spectrum file. What extends this has `bytes(from, end, signal)`, the bytes from one position up to another, and `heads()`, bytes that
 * begin with section INFO and others that begin with ISOV; `crc32` is the checksum of the index, if it is known.
 */
class ChunkedFile {
    constructor(source) {
        Object.assign(this, source);
        // By number of the chunk.
        this.decoded = new Map();
        this.requests = new Map();
        // The chunks of the last sets of isovalues.
        this.kept = [];
    }

    /** The tables; a request that failed is sent again the next time. */
    tables() {
        this.reading ??= this.readTables();
        this.reading.catch(() => { this.reading = null; });
        return this.reading;
    }

    async readTables() {
        const [head, tail] = await this.heads();
        const isovalueTable = sectionIn(tail, "ISOV");
        const index = sectionIn(sectionIn(isovalueTable.rest, "COLL").rest, "INDX");
        if (this.crc32 !== undefined && index.crc !== this.crc32) throw new Error(OTHER_FILE);
        const info = JSON.parse(new TextDecoder().decode(await contentOf(sectionIn(head, "INFO"))));
        const columns = new Columns(await contentOf(isovalueTable));
        // By tree.
        const tables = [];
        while (columns.at < columns.bytes.length) tables.push(isovaluesOf(columns));
        const chunks = chunksOf(await contentOf(index), tables.map(({ length }) => length));
        const quantum = quantumOf(info.tolerance);
        return {
            info, isovalues: unionOf(tables), tables, chunks, intervals: intervalsOf(chunks, tables), quantum, samples: new Samples(info.volume, 1 / quantum),
        };
    }

    /** The intervals of isovalues that need the same chunks, ascending. */
    async intervals() {
        return (await this.tables()).intervals.map(({ range }) => range);
    }

    /** The spectrum of some intervals, given by their numbers; null if others were wanted meanwhile. */
    async spectrumOf(numbers) {
        const { info, isovalues, tables, chunks, intervals, quantum, samples } = await this.tables();
        const ends = numbers.flatMap((i) => intervals[i].ends);
        const wanted = chunks.filter((chunk) => ends.some(({ number }) => chunk.number <= number && number < chunk.end));
        const requests = this.request(wanted);
        for (const [i, chunk] of wanted.entries()) {
            if (this.decoded.has(chunk.number)) continue;
            // A request that was given up fails.
            const stored = await requests[i].catch((error) => {
                if (this.wanted === wanted) throw error;
            });
            await otherTasks();
            if (this.wanted !== wanted) return null;
            const above = wanted.filter(({ number, end }) => number < chunk.number && chunk.number < end);
            const decoded = decodedChunk(stored, chunk, above.map(({ number }) => this.decoded.get(number)), { isovalues: tables[chunk.tree], samples });
            if (tables.length > 1) decoded.shared = sharedOf(await contentOf(seamOf(stored)));
            this.decoded.set(chunk.number, decoded);
            this.requests.delete(chunk.number);
        }
        this.keep(wanted);
        const trees = tables.map((table, tree) => {
            const all = joined(wanted.filter((chunk) => chunk.tree === tree).map(({ number }) => this.decoded.get(number)));
            return { ...all, table };
        });
        const all = trees.length > 1 ? joinedTrees(trees, isovalues) : trees[0];
        // The tables stay here; what is returned may be transferred.
        const spectrum = { info, isovalues: isovalues.slice(), ...sortedByBirth(all, isovalues.length), step: quantum };
        spectrum.orders = ordersOf(spectrum);
        return spectrum;
    }

    /** The spectrum of some intervals with the tables that drawing needs; null if others were wanted meanwhile. */
    async load(numbers) {
        const spectrum = await this.spectrumOf(numbers);
        if (spectrum) spectrum.tables = tablesOf(spectrum, spectrum.step);
        return spectrum;
    }

    /** Requests the chunks that are not decoded, and gives up requests for others. Returns the bytes of each that is not decoded. */
    request(wanted) {
        this.wanted = wanted;
        for (const [number, { controller }] of this.requests) {
            if (wanted.some((chunk) => chunk.number === number)) continue;
            controller.abort();
            this.requests.delete(number);
        }
        for (const chunk of wanted) {
            if (this.decoded.has(chunk.number) || this.requests.has(chunk.number)) continue;
            const controller = new AbortController();
            const promise = this.stored(chunk, controller.signal);
            // A request that failed is sent again the next time.
            promise.catch(() => { if (this.requests.get(chunk.number)?.promise === promise) this.requests.delete(chunk.number); });
            this.requests.set(chunk.number, { promise, controller });
        }
        return wanted.map(({ number }) => this.requests.get(number)?.promise);
    }

    /** The stored bytes of a chunk. The first one is read with the header of the file. */
    async stored({ number, from, bytes: n, crc }, signal) {
        const start = number === 0 ? 0 : from;
        const bytes = await this.bytes(start, from + n, signal);
        if (start < from) checkHeader(bytes);
        const stored = bytes.subarray(from - start);
        if (stored.length !== n || crc32Of(stored) !== crc) throw new Error(`chunk ${number} is damaged, or of another file: its checksum is wrong`);
        return stored;
    }

    /** Keeps decoded chunks of the last wanted sets only. */
    keep(wanted) {
        this.kept = [wanted, ...this.kept].slice(0, MAX_KEPT);
        const numbers = new Set(this.kept.flat().map(({ number }) => number));
        for (const number of this.decoded.keys()) if (!numbers.has(number)) this.decoded.delete(number);
    }
}
