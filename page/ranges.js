// Reads a spectrum file on a server: its tables, and the chunks that some isovalues need, by HTTP range requests. Everything is checked by its
// checksum. The twin of src/file/spectrum_file.rs.

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

/** A spectrum file behind an address. `link`: its URL, the places of its tables and the checksum of its index. */
class LinkedFile {
    constructor(link, address) {
        Object.assign(this, { link, address });
        // By number of the chunk.
        this.decoded = new Map();
        this.requests = new Map();
        // The chunks of the last sets of isovalues.
        this.kept = [];
    }

    /** The bytes from one position up to another. */
    async bytes(from, end, signal) {
        const { url } = this.link;
        let [status, bytes] = [0, null];
        try {
            const response = await fetch(this.address, { headers: { Range: `bytes=${from}-${end - 1}` }, signal });
            ({ status } = response);
            if (status === 206) bytes = new Uint8Array(await response.arrayBuffer());
            else response.body?.cancel();
        } catch {
            const isLocal = this.address.startsWith("file:");
            throw new Error(`${url}: ${isLocal ? "a page that is opened from a disk may not read it; it needs a server" : "no answer"}`);
        }
        if (bytes) return bytes;
        if (status === 416) throw new Error(`${url}: not the file of this page`);
        throw new Error(`${url}: status ${status}, expected 206${status === 200 ? "; the server does not answer range requests" : ""}`);
    }

    /** The tables; a request that failed is sent again the next time. */
    tables() {
        this.reading ??= this.readTables();
        this.reading.catch(() => { this.reading = null; });
        return this.reading;
    }

    async readTables() {
        const { url, info: place, isovalues: from, end, crc32 } = this.link;
        const [head, tail] = await Promise.all([this.bytes(...place), this.bytes(from, end)]);
        const footer = tail.subarray(-FOOTER);
        if (head.length !== place[1] - place[0] || tail.length !== end - from || textOf(footer.subarray(12)) !== END
            || textOf(head.subarray(0, 4)) !== "INFO" || textOf(tail.subarray(0, 4)) !== "ISOV") {
            throw new Error(`${url}: not the file of this page`);
        }
        try {
            const isovalueTable = sectionIn(tail, "ISOV");
            const index = sectionIn(sectionIn(isovalueTable.rest, "COLL").rest, "INDX");
            if (index.crc !== crc32) throw new Error("not the file of this page");
            const info = JSON.parse(new TextDecoder().decode(await contentOf(sectionIn(head, "INFO"))));
            const isovalues = isovaluesOf(await contentOf(isovalueTable));
            const chunks = chunksOf(await contentOf(index), isovalues.length);
            const quantum = quantumOf(info.tolerance);
            return { info, isovalues, chunks, ends: chunks.filter(({ pivot }) => pivot < 0), quantum, samples: new Samples(info.volume, 1 / quantum) };
        } catch (error) {
            throw new Error(`${url}: ${error.message}`);
        }
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
        spectrum.tables = tablesOf(spectrum, quantum);
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
        const { url } = this.link;
        if (start < from) {
            try {
                checkHeader(bytes);
            } catch (error) {
                throw new Error(`${url}: ${error.message}`);
            }
        }
        const stored = bytes.subarray(from - start);
        if (stored.length !== n || crc32Of(stored) !== crc) throw new Error(`${url}: chunk ${number} is damaged, or of another file: its checksum is wrong`);
        return stored;
    }

    /** Keeps decoded chunks of the last wanted sets only. */
    keep(wanted) {
        this.kept = [wanted, ...this.kept].slice(0, MAX_KEPT);
        const numbers = new Set(this.kept.flat().map(({ number }) => number));
        for (const number of this.decoded.keys()) if (!numbers.has(number)) this.decoded.delete(number);
    }
}

/** Answers the page when the script runs in a worker. */
function runLinkedWorker() {
    let file = null;
    self.onmessage = async ({ data: { id, link, address, method, numbers } }) => {
        file ??= new LinkedFile(link, address);
        try {
            const result = await file[method](numbers);
            self.postMessage({ id, result }, method === "spectrumOf" ? [...buffersOf(result)] : []);
        } catch (error) {
            self.postMessage({ id, error: error.message });
        }
    };
}

/** A LinkedFile in a worker that runs the script of the page; in the page itself if it cannot start a worker. */
class RemoteFile {
    constructor(link, script) {
        const address = String(new URL(link.url, document.baseURI));
        this.calls = new Map();
        this.send = (message) => this.worker.postMessage({ ...message, link, address });
        try {
            this.worker = new Worker(URL.createObjectURL(new Blob([script], { type: "text/javascript" })));
            this.worker.onerror = () => this.moveHere(link, address);
            this.worker.onmessage = ({ data: { id, result, error } }) => {
                const { resolve, reject } = this.calls.get(id);
                this.calls.delete(id);
                if (error) reject(new Error(error));
                else resolve(result);
            };
        } catch {
            this.moveHere(link, address);
        }
    }

    /** Reads in the page from now on, and what was called before as well. */
    moveHere(link, address) {
        console.info("no worker: refused");
        const file = new LinkedFile(link, address);
        this.worker = null;
        this.send = ({ id, method, numbers }) => {
            const { resolve, reject } = this.calls.get(id);
            this.calls.delete(id);
            file[method](numbers).then(resolve, reject);
        };
        for (const [id, { method, numbers }] of this.calls) this.send({ id, method, numbers });
    }

    call(method, numbers) {
        return new Promise((resolve, reject) => {
            const id = (this.nCalls = (this.nCalls ?? 0) + 1);
            this.calls.set(id, { resolve, reject, method, numbers });
            this.send({ id, method, numbers });
        });
    }
}
