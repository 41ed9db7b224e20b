// Reads a spectrum file whose sections are stored as they are. FORMAT.md describes the bytes; the
// twin of src/file.rs, without its checks: the page was written by the program itself.

/** Takes numbers off the bytes of one section. */
class Columns {
    constructor(bytes) {
        this.bytes = bytes;
        this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
        this.at = 0;
    }

    /** A count: a u64 that is small enough for a number. */
    count() {
        const count = Number(this.view.getBigUint64(this.at, true));
        this.at += 8;
        return count;
    }

    /** A column of n numbers: Uint32Array where four bytes hold each of them, else Float64Array. */
    column(n) {
        const width = this.bytes[this.at++];
        const { bytes, at } = this;
        this.at += width * n;
        const numbers = width <= 4 ? new Uint32Array(n) : new Float64Array(n);
        for (let plane = 0, unit = 1; plane < width; plane++, unit *= 256) {
            const start = at + plane * n;
            for (let i = 0; i < n; i++) numbers[i] += unit * bytes[start + i];
        }
        return numbers;
    }

    /** As column, of zigzag-coded numbers; Int32Array or Float64Array. */
    signedColumn(n) {
        const numbers = this.column(n);
        if (numbers instanceof Uint32Array) {
            const signed = new Int32Array(numbers.buffer);
            for (let i = 0; i < n; i++) signed[i] = (numbers[i] >>> 1) ^ -(numbers[i] & 1);
            return signed;
        }
        for (let i = 0; i < n; i++) {
            const x = numbers[i];
            numbers[i] = x % 2 ? -(x + 1) / 2 : x / 2;
        }
        return numbers;
    }

    /** A column of n numbers of all 64 bits. */
    column64(n) {
        const width = this.bytes[this.at++];
        const numbers = new BigUint64Array(n);
        const planes = new Uint8Array(numbers.buffer);
        for (let plane = 0; plane < width; plane++) {
            for (let i = 0; i < n; i++) planes[8 * i + plane] = this.bytes[this.at + plane * n + i];
        }
        this.at += width * n;
        return numbers;
    }
}

/** The content of every section by its tag. */
function sectionsOf(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const sections = {};
    for (let at = 16; at < bytes.length; ) {
        const tag = String.fromCharCode(...bytes.subarray(at, at + 4));
        const stored = Number(view.getBigUint64(at + 8, true));
        if (view.getUint32(at + 4, true) !== 0) throw new Error(`section ${tag} is packed`);
        sections[tag] = bytes.subarray(at + 28, at + 28 + stored);
        at += 28 + stored;
    }
    return sections;
}

/** The table of isovalues: sorted keys, each given by its distance from the one before. */
function isovaluesOf(section) {
    const columns = new Columns(section);
    const keys = columns.column64(columns.count());
    const sign = 1n << 63n;
    let key = 0n;
    for (let i = 0; i < keys.length; i++) {
        key = BigInt.asUintN(64, key + keys[i]);
        keys[i] = key & sign ? key & ~sign : BigInt.asUintN(64, ~key);
    }
    return new Float64Array(keys.buffer);
}

/**
 * The spectrum in the bytes of a file: its description, isovalues, first knot of each vertex
 * (one more than there are), ranks, positions (3 per knot, whole steps), normals (2 per knot,
 * -127 to 127), and triangles with vertices (3 per triangle), births, deaths and caps.
 */
function spectrumOf(bytes) {
    const sections = sectionsOf(bytes);
    const info = JSON.parse(new TextDecoder().decode(sections.INFO));
    const isovalues = isovaluesOf(sections.ISOV);
    const trajectories = ranksOf(sections.VERT);
    const triangles = trianglesOf(sections.TRIA, trajectories, isovalues.length);
    const places = placesOf(sections.POSN, sections.NRML, trajectories, isovalues, triangles);
    return { info, isovalues, ...trajectories, ...triangles, ...places };
}
