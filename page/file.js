// Reads a spectrum: sections as src/page/data.rs writes them, columns as FORMAT.md describes them. Omits the checks of
// src/file.rs, because the page contains data of the program.

/** Reads the numbers of a section. */
class Columns {
    constructor(bytes) {
        this.bytes = bytes;
        this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
        this.at = 0;
    }

    /** A count: a u64 that a number holds exactly. */
    count() {
        const count = Number(this.view.getBigUint64(this.at, true));
        this.at += 8;
        return count;
    }

    /** A column of n numbers: Uint8Array if each has one byte, Uint32Array if each has at most four, else Float64Array. */
    column(n) {
        const width = this.bytes[this.at++];
        const { bytes, at } = this;
        this.at += width * n;
        // No copy.
        if (width === 1) return bytes.subarray(at, at + n);
        const numbers = width <= 4 ? new Uint32Array(n) : new Float64Array(n);
        for (let plane = 0, unit = 1; plane < width; plane++, unit *= 256) {
            const start = at + plane * n;
            for (let i = 0; i < n; i++) numbers[i] += unit * bytes[start + i];
        }
        return numbers;
    }

    /** A column of n numbers of 64 bits. */
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

/** Decodes zigzag-coded numbers: Int32Array or Float64Array. */
function signed(numbers) {
    const all = new (numbers instanceof Float64Array ? Float64Array : Int32Array)(numbers.length);
    for (let i = 0; i < all.length; i++) {
        const x = numbers[i];
        all[i] = x % 2 ? -(x + 1) / 2 : x / 2;
    }
    return all;
}

/** The sections, each stored as a length and that many bytes. */
function sectionsOf(bytes) {
    const columns = new Columns(bytes);
    const sections = [];
    while (columns.at < bytes.length) {
        const n = columns.count();
        sections.push(bytes.subarray(columns.at, columns.at += n));
    }
    return sections;
}

/**
 * Readers of the columns of section POSN: the first samples of lattice vertices and their directions, the axis that each other vertex
 * faces, and the residuals of predicted positions by kind of knot.
 */
function residualsOf(section, { ranks, nMoving, nLattice }) {
    const columns = new CodedColumns(section);
    const n = [nMoving - nLattice, ranks.length - nMoving - nLattice];
    const three = (length) => Array.from({ length: 3 }, () => reader(columns.signedColumn(length)));
    const starts = three(nLattice);
    const direction = reader(columns.column(nLattice));
    const facing = reader(columns.column(n[FIRST]));
    return { starts, direction, facing, positions: n.map(three) };
}

/** A function that returns the next number of a column. */
function reader(column) {
    let i = 0;
    return () => column[i++];
}

/**
 * Reads n intervals from one rank to a later one; the twin of src/file/rank_intervals.rs. Returns a function from the first rank of the
 * next interval to its last.
 */
function intervalReader(columns, n) {
    const frequentEnds = Uint32Array.from(columns.column(columns.count()));
    const length = reader(columns.column(columns.count()));
    const nextCode = reader(columns.column(n));
    for (let i = 1; i < frequentEnds.length; i++) frequentEnds[i] += frequentEnds[i - 1];
    return (from) => {
        const code = nextCode();
        if (code === 0) return from + 1 + length();
        let [low, high] = [0, frequentEnds.length];
        while (low < high) {
            const middle = (low + high) >>> 1;
            if (frequentEnds[middle] <= from) low = middle + 1;
            else high = middle;
        }
        return frequentEnds[low + code - 1];
    };
}

/** Reads the numbers of a section of coded columns. */
class CodedColumns extends Decoder {
    /** A count. */
    count() {
        return this.bits(40);
    }

    /** As Columns.column. */
    column(n) {
        const width = this.bits(4);
        const Numbers = width === 1 ? Uint8Array : width <= 4 ? Uint32Array : Float64Array;
        return this.row(new Numbers(n));
    }

    /** A column of zigzag-coded numbers. */
    signedColumn(n) {
        return signed(this.column(n));
    }
}

/** The next table of isovalues: sorted integer keys of doubles, stored as differences. */
function isovaluesOf(columns) {
    const keys = columns.column64(columns.count());
    const sign = 1n << 63n;
    let key = 0n;
    for (let i = 0; i < keys.length; i++) {
        key = BigInt.asUintN(64, key + keys[i]);
        keys[i] = key & sign ? key & ~sign : BigInt.asUintN(64, ~key);
    }
    return new Float64Array(keys.buffer);
}

/** The codes of a second field, one byte per knot; the twin of src/page/field.rs. */
function valuesOf(section, { firstKnot, ranks, nMoving }) {
    const values = new Uint8Array(ranks.length);
    let [first, further, before] = [0, nMoving, 0];
    for (let v = 0; v + 1 < firstKnot.length; v++) {
        for (let knot = firstKnot[v]; knot < firstKnot[v + 1]; knot++) {
            if (knot === firstKnot[v]) before = values[knot] = before + section[first++];
            else values[knot] = values[knot - 1] + section[further++];
        }
        before &= 255;
    }
    return values;
}

/**
 * Decodes a spectrum: its description `info`, isovalues, the first knot of each vertex (and the number of knots), ranks and
 * positions of knots (3 per knot, whole steps), the triangles' vertices (3 per triangle), births, deaths and caps, and the codes
 * of a second field.
 */
function spectrumOf(bytes, { step }) {
    const [infoSection, isovalueSection, rankSection, triangleSection, positionSection, valueSection] = sectionsOf(bytes);
    const isovalues = isovaluesOf(new Columns(isovalueSection));
    const trajectories = ranksOf(rankSection);
    const triangles = trianglesOf(triangleSection, trajectories, isovalues.length);
    const info = JSON.parse(new TextDecoder().decode(infoSection));
    const residuals = residualsOf(positionSection, trajectories);
    const samples = new Samples(info.volume, 1 / step);
    const positions = positionsOf(residuals, samples, trajectories, isovalues, triangles);
    const values = valueSection && valuesOf(valueSection, trajectories);
    return { info, isovalues, ...trajectories, ...triangles, positions, values };
}
