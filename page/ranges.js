// Reads a spectrum file on a server by HTTP range requests. The places of its tables are those of src/page/link.rs.

class LinkedFile extends ChunkedFile {
    /** The bytes from one position up to another. */
    async bytes(from, end, signal) {
        let [status, bytes] = [0, null];
        try {
            const response = await fetch(this.address, { headers: { Range: `bytes=${from}-${end - 1}` }, signal });
            ({ status } = response);
            if (status === 206) bytes = new Uint8Array(await response.arrayBuffer());
            else response.body?.cancel();
        } catch {
            const isLocal = this.address.startsWith("file:");
            throw new Error(isLocal ? "a page that is opened from a disk may not read it; it needs a server" : "no answer");
        }
        if (bytes) return bytes;
        if (status === 416) throw new Error(OTHER_FILE);
        throw new Error(`status ${status}, expected 206${status === 200 ? "; the server does not answer range requests" : ""}`);
    }

    async heads() {
        const { info: place, isovalues: from, end } = this;
        const [head, tail] = await Promise.all([this.bytes(...place), this.bytes(from, end)]);
        if (head.length !== place[1] - place[0] || tail.length !== end - from || textOf(tail.subarray(-4)) !== END
            || textOf(head.subarray(0, 4)) !== "INFO" || textOf(tail.subarray(0, 4)) !== "ISOV") {
            throw new Error(OTHER_FILE);
        }
        return [head, tail];
    }
}
