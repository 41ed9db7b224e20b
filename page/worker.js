// A worker that runs the script of the page, so that the page stays responsive: it decodes the spectrum of the page, or reads a file. The
// page itself does it if it cannot start a worker.

/** The text of the script, what opens a file for its worker, and the controls of the page as they were at first. */
const own = {};

/** Starts a worker. */
function startWorker() {
    return new Worker(URL.createObjectURL(new Blob([own.script], { type: "text/javascript" })));
}

/** Answers the page when the script runs in a worker. */
function runWorker() {
    let file = null;
    self.onmessage = async ({ data: { id, packed, about, source, method, argument } }) => {
        try {
            if (source) file ??= own.openFile(source);
            const result = await (file ? file[method](argument) : unpacked(packed, about));
            // Columns can be views of one buffer, which may be transferred only once.
            self.postMessage({ id, result }, [...buffersOf(result)]);
        } catch (error) {
            self.postMessage({ id, error: error.message });
        }
    };
}

/** The buffers of all typed arrays in an object, at any depth. */
function buffersOf(thing, found = new Set()) {
    if (ArrayBuffer.isView(thing)) found.add(thing.buffer);
    else if (thing && typeof thing === "object") Object.values(thing).forEach((x) => buffersOf(x, found));
    return found;
}

/** A file in a worker, or in the page itself. `source` is what `own.openFile` takes, with the `name` of the file for errors. */
class FileWorker {
    constructor(source) {
        this.source = source;
        this.calls = new Map();
        this.send = (message) => this.worker.postMessage({ ...message, source });
        try {
            this.worker = startWorker();
            this.worker.onerror = () => this.moveHere();
            this.worker.onmessage = ({ data: { id, result, error } }) => {
                const { resolve, reject } = this.calls.get(id);
                this.calls.delete(id);
                if (error) reject(new Error(error));
                else resolve(result);
            };
        } catch {
            this.moveHere();
        }
    }

    /** Reads in the page from now on, and what was called before as well. */
    moveHere() {
        console.info("no worker: refused");
        const file = own.openFile(this.source);
        this.worker = null;
        this.send = ({ id, method, argument }) => {
            const { resolve, reject } = this.calls.get(id);
            this.calls.delete(id);
            file[method](argument).then(resolve, reject);
        };
        for (const [id, { method, argument }] of this.calls) this.send({ id, method, argument });
    }

    async call(method, argument) {
        try {
            return await new Promise((resolve, reject) => {
                const id = (this.nCalls = (this.nCalls ?? 0) + 1);
                this.calls.set(id, { resolve, reject, method, argument });
                this.send({ id, method, argument });
            });
        } catch (error) {
            throw new Error(`${this.source.name}: ${error.message}`);
        }
    }

    end() {
        this.worker?.terminate();
    }
}
