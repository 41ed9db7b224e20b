// Decodes the spectrum that the page contains, in a worker if it can start one.

/** Decodes a packed spectrum, base64, and makes the tables that drawing needs. */
async function unpacked(packed, about) {
    const spectrum = spectrumOf(await inflated(bytesOfBase64(packed)), about);
    spectrum.orders = ordersOf(spectrum);
    spectrum.tables = tablesOf(spectrum, about.step);
    return spectrum;
}

/** As unpacked, in a worker. */
async function unpackedInWorker(packed, about) {
    let worker;
    try {
        worker = startWorker();
        return await new Promise((resolve, reject) => {
            worker.onerror = reject;
            worker.onmessage = ({ data }) => {
                if (data.error) reject(new Error(data.error));
                else resolve(data.result);
            };
            worker.postMessage({ packed, about });
        });
    } catch (error) {
        console.info(`no worker: ${error.message ?? "refused"}`);
        return unpacked(packed, about);
    } finally {
        worker?.terminate();
    }
}
