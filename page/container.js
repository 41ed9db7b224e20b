// The spectrum file as a container: header, tables, and the tree of chunks. FORMAT.md, "File, chunks and tables"; the twin of
// src/file/container.rs, src/file/section.rs, src/file/header.rs and src/file/tree.rs.

/** The first bytes of a file: the magic, the version, and their checksum. */
const HEADER = [0x89, 0x49, 0x53, 0x50, 13, 10, 26, 10, 1, 0, 0, 0];
const FILE_HEADER = 16;
const SECTION_HEADER = 28;
/** Bytes after the tables, and the last of them. */
const FOOTER = 16;
const END = "ISPE";

/** The largest quantum of positions, voxels, the smallest, and how many of them a tolerance has at least: src/spectrum/quantise.rs. */
const [COARSEST, FINEST, PER_TOLERANCE] = [1 / 32, 1 / 1024, 12];

const CRC_TABLE = Int32Array.from({ length: 256 }, (_, i) => {
    for (let k = 0; k < 8; k++) i = i & 1 ? (i >>> 1) ^ 0xedb88320 : i >>> 1;
    return i;
});

/** The CRC-32 of parts that follow one another. */
function crc32Of(...parts) {
    let crc = -1;
    for (const bytes of parts) for (let i = 0; i < bytes.length; i++) crc = CRC_TABLE[(crc ^ bytes[i]) & 255] ^ (crc >>> 8);
    return ~crc >>> 0;
}

const viewOf = ({ buffer, byteOffset, byteLength }) => new DataView(buffer, byteOffset, byteLength);
const textOf = (bytes) => String.fromCharCode(...bytes);

/** Checks the header of a file. */
function checkHeader(bytes) {
    const isRight = HEADER.every((byte, i) => bytes[i] === byte) && viewOf(bytes).getUint32(12, true) === crc32Of(bytes.subarray(0, 12));
    if (!isRight) throw new Error("not a spectrum file that this page can read");
}

/** Splits the section `tag` off bytes: its packing, checksum and stored bytes, and the bytes after it. */
function sectionIn(bytes, tag) {
    const view = viewOf(bytes);
    if (bytes.length < SECTION_HEADER || textOf(bytes.subarray(0, 4)) !== tag) throw new Error(`section ${tag} is missing`);
    const end = SECTION_HEADER + Number(view.getBigUint64(8, true));
    const stored = bytes.subarray(SECTION_HEADER, end);
    const crc = view.getUint32(24, true);
    if (end > bytes.length || crc32Of(bytes.subarray(0, 24), stored) !== crc) {
        throw new Error(`section ${tag} is damaged: its checksum is wrong`);
    }
    return { packing: view.getUint32(4, true), crc, stored, rest: bytes.subarray(end) };
}

/** The content of a table. */
async function contentOf({ packing, stored }) {
    if (packing === 0) return stored;
    const stream = new Blob([stored]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The quantum of positions for a tolerance; the twin of `quantum` in src/spectrum/quantise.rs. */
function quantumOf(tolerance) {
    let quantum = COARSEST;
    while (quantum > FINEST && quantum * PER_TOLERANCE > tolerance) quantum *= 0.5;
    return quantum;
}

/**
 * The chunks in pre-order, from section INDX of a file whose trees have so many ranks: each with the number of its tree, its span of ranks, its pivot
 * (NONE without one), the number of the first chunk that is not below it, its first byte in the file, bytes and checksum.
 */
function chunksOf(content, counts) {
    const columns = new Columns(content);
    const n = columns.count();
    // Vertices, knots and triangles are counted for the sizes of a spectrum in memory only.
    const [pivots, , , , bytes, crcs] = Array.from({ length: 6 }, () => columns.column(n));
    const chunks = [];
    let from = FILE_HEADER;
    const take = (tree, span) => {
        const number = chunks.length;
        const pivot = pivots[number] - 1;
        const chunk = { number, tree, span, pivot, from, bytes: bytes[number], crc: crcs[number] };
        from += bytes[number];
        chunks.push(chunk);
        if (pivot >= 0) {
            take(tree, [span[0], pivot + 1]);
            take(tree, [pivot + 1, span[1]]);
        }
        chunk.end = chunks.length;
    };
    counts.forEach((nRanks, tree) => take(tree, [0, nRanks]));
    return chunks;
}
