// Writes films as WebM: the browser encodes VP9 or VP8, the container is written here (RFC 8794 and the elements of Matroska).
// Pictures have equal durations, however long they took to draw.

/** Seconds between key frames. */
const KEY_SECONDS = 2;
/** The bit rate of the film per pixel of a picture, bits. */
const BITS_PER_PIXEL = 0.14;

/** An EBML element with an id and a content of bytes, elements, integers (as eight bytes) and texts; a list of byte arrays. */
function ebml(id, ...parts) {
    const number = (x, n) => Uint8Array.from({ length: n }, (_, i) => Math.floor(x / 256 ** (n - 1 - i)) % 256);
    const body = parts.flat(9).map((part) => (typeof part === "number" ? number(part, 8)
        : typeof part === "string" ? new TextEncoder().encode(part) : part));
    const length = body.reduce((sum, part) => sum + part.length, 0);
    // The first byte of the length marks a length of eight bytes.
    const size = number(length, 8);
    size[0] = 1;
    return [number(id, Math.ceil(Math.log2(id + 1) / 8)), size, ...body];
}

const lengthOf = (parts) => parts.reduce((sum, part) => sum + part.length, 0);

class WebM {
    /** Opens a film of a canvas with even sides, `rate` pictures a second; throws if the browser cannot encode that size. */
    static async open(canvas, rate) {
        const { width, height } = canvas;
        const common = { width, height, framerate: rate, bitrate: Math.round(BITS_PER_PIXEL * width * height * rate), latencyMode: "quality" };
        for (const [codec, name] of [["vp09.00.51.08", "V_VP9"], ["vp8", "V_VP8"]]) {
            const config = { ...common, codec };
            if ((await VideoEncoder.isConfigSupported(config)).supported) return new WebM(canvas, rate, config, name);
        }
        throw new Error("this browser encodes no film of this size");
    }

    constructor(canvas, rate, config, name) {
        Object.assign(this, { canvas, rate, name, n: 0, chunks: [] });
        this.encoder = new VideoEncoder({
            output: (chunk) => {
                const bytes = new Uint8Array(chunk.byteLength);
                chunk.copyTo(bytes);
                this.chunks.push({ bytes, isKey: chunk.type === "key", time: Math.round(chunk.timestamp / 1000) });
            },
            error: (error) => { this.error = error; },
        });
        this.encoder.configure(config);
    }

    /** Adds the canvas as the next picture. */
    async add() {
        const frame = new VideoFrame(this.canvas, { timestamp: Math.round((1e6 * this.n) / this.rate), duration: Math.round(1e6 / this.rate) });
        this.encoder.encode(frame, { keyFrame: this.n++ % (KEY_SECONDS * this.rate) === 0 });
        frame.close();
        while (this.encoder.encodeQueueSize > 4 && !this.error) await new Promise((resolve) => setTimeout(resolve, 5));
        if (this.error) throw this.error;
    }

    async finish() {
        await this.encoder.flush();
        this.encoder.close();
        const { width, height } = this.canvas;
        const duration = new Uint8Array(8);
        new DataView(duration.buffer).setFloat64(0, (1000 * this.n) / this.rate);
        const head = ebml(0x1a45dfa3, ebml(0x4286, 1), ebml(0x42f7, 1), ebml(0x42f2, 4), ebml(0x42f3, 8),
            ebml(0x4282, "webm"), ebml(0x4287, 2), ebml(0x4285, 2));
        const info = ebml(0x1549a966, ebml(0x2ad7b1, 1e6), ebml(0x4489, duration), ebml(0x4d80, GENERATOR), ebml(0x5741, GENERATOR));
        const tracks = ebml(0x1654ae6b, ebml(0xae, ebml(0xd7, 1), ebml(0x73c5, 1), ebml(0x83, 1), ebml(0x86, this.name),
            ebml(0xe0, ebml(0xb0, width), ebml(0xba, height))));
        const groups = [];
        for (const chunk of this.chunks) {
            if (chunk.isKey || groups.length === 0) groups.push([]);
            groups.at(-1).push(chunk);
        }
        const clusters = groups.map((group) => ebml(0x1f43b675, ebml(0xe7, group[0].time), group.map(({ bytes, isKey, time }) => {
            const offset = time - group[0].time;
            return ebml(0xa3, Uint8Array.of(0x81, offset >> 8, offset, isKey ? 0x80 : 0), bytes);
        })));
        // The positions of clusters, by which players seek. The element has the same length for all positions.
        const cues = (positions) => ebml(0x1c53bb6b, groups.map(([{ time }], i) =>
            ebml(0xbb, ebml(0xb3, time), ebml(0xb7, ebml(0xf7, 1), ebml(0xf1, positions[i] ?? 0)))));
        let at = lengthOf(info) + lengthOf(tracks) + lengthOf(cues([]));
        const positions = clusters.map((cluster) => {
            const position = at;
            at += lengthOf(cluster);
            return position;
        });
        return new Blob([...head, ...ebml(0x18538067, info, tracks, cues(positions), clusters)], { type: "video/webm" });
    }
}
