// Decodes the spectrum in a worker, so that the page stays responsive; in the page itself if it cannot start a worker.

/** Decodes a packed spectrum, base64, and makes the tables that drawing needs. */
async function unpacked(packed, about) {
    const spectrum = spectrumOf(await inflated(bytesOfBase64(packed)), about);
    spectrum.orders = ordersOf(spectrum);
    spectrum.tables = tablesOf(spectrum, about.step);
    return spectrum;
}

/** As unpacked, in a worker that runs the script of the page. */
async function unpackedInWorker(packed, about, script) {
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

/** Answers the page when the script runs in a worker. */
function runWorker() {
    self.onmessage = async ({ data: { packed, about } }) => {
        try {
            const spectrum = await unpacked(packed, about);
            // Columns can be views of one buffer, which may be transferred only once.
            self.postMessage({ spectrum }, [...buffersOf(spectrum)]);
        } catch (error) {
            self.postMessage({ error: error.message });
        }
    };
}

/** The buffers of all typed arrays in an object, at any depth. */
function buffersOf(thing, found = new Set()) {
    if (ArrayBuffer.isView(thing)) found.add(thing.buffer);
    else if (thing && typeof thing === "object") Object.values(thing).forEach((x) => buffersOf(x, found));
    return found;
}
