// Unpacks the spectrum beside the page: in a worker, so that what is shown already keeps moving; in
// the page itself where a worker may not be.

/** All that is made of a packed spectrum before anything of it is drawn. */
async function unpacked(packed, about) {
    const spectrum = spectrumOf(await inflated(bytesOfLetters(packed)), about);
    spectrum.orders = ordersOf(spectrum);
    spectrum.tables = tablesOf(spectrum, about.step);
    return spectrum;
}

/** As unpacked, by a worker that runs the script of the page. */
async function unpackedBeside(packed, about, script) {
    let worker;
    const address = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
    try {
        worker = new Worker(address);
        return await new Promise((resolve, reject) => {
            worker.onerror = reject;
            worker.onmessage = ({ data }) => {
                if (data.error) reject(new Error(data.error));
                else resolve(data.spectrum);
            };
            worker.postMessage({ packed, about });
        });
    } catch (error) {
        console.info(`no worker: ${error.message ?? "refused"}`);
        return unpacked(packed, about);
    } finally {
        worker?.terminate();
        URL.revokeObjectURL(address);
    }
}

/** What the script does in a worker. */
function work() {
    self.onmessage = async ({ data: { packed, about } }) => {
        try {
            const spectrum = await unpacked(packed, about);
            // Columns may be views of one buffer, and are handed over once.
            self.postMessage({ spectrum }, [...buffersOf(spectrum)]);
        } catch (error) {
            self.postMessage({ error: error.message });
        }
    };
}

/** The buffers of all arrays in an object, at any depth. */
function buffersOf(thing, found = new Set()) {
    if (ArrayBuffer.isView(thing)) found.add(thing.buffer);
    else if (thing && typeof thing === "object") Object.values(thing).forEach((x) => buffersOf(x, found));
    return found;
}
