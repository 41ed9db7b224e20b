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
        const isovalueContent = await contentOf(isovalueTable);
        const isovalues = isovaluesOf(isovalueContent);
        // One of a volume in bricks has a table for each; after the count (8 bytes) comes the width of the numbers.
        if (isovalueContent.length > 9 + isovalueContent[8] * isovalues.length) {
            throw new Error("was computed in bricks; `isospectrum convert` writes a file that a page opens");
        }
        const chunks = chunksOf(await contentOf(index), isovalues.length);
        const quantum = quantumOf(info.tolerance);
        return { info, isovalues, chunks, ends: chunks.filter(({ pivot }) => pivot < 0), quantum, samples: new Samples(info.volume, 1 / quantum) };
    }

    /** The intervals of isovalues that need the same chunks, ascending: those of the chunks without children. */
    async intervals() {
        const { ends, isovalues } = await this.tables();
        return ends.map(({ span: [start, end] }) => [
            start === 0 ? -Infinity : isovalues[start], end === isovalues.length ? Infinity : below(isovalues[end]),
        ]);
    }

    /** The spectrum of some intervals, given by their numbers; null if others were wanted meanwhile. */
    async spectrumOf(numbers) {
        const tables = await this.tables();
        const { info, isovalues, chunks, ends, quantum } = tables;
        const wanted = chunks.filter((chunk) => numbers.some((i) => chunk.number <= ends[i].number && ends[i].number < chunk.end));
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
            this.decoded.set(chunk.number, decodedChunk(stored, chunk, above.map(({ number }) => this.decoded.get(number)), tables));
            this.requests.delete(chunk.number);
        }
        this.keep(wanted);
        const all = joined(wanted.map(({ number }) => this.decoded.get(number)));
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
