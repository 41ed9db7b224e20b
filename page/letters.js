// What the page holds, as bytes: letters to bytes to what was compressed. The twin of
// src/page/letters.rs.

/** Codes below 128 that are no letters: the parser of pages changes or ends at them, or files sent as
 * text may lose them. */
const NO_LETTERS = [0, 10, 13, 26, 27, 60];
const N_LETTERS = 128 - NO_LETTERS.length;
/** Pairs of letters whose low 13 bits are below this hold 14 bits, others 13. */
const LONG_PAIRS = N_LETTERS * N_LETTERS - 8192;

/** The bytes of a text of letters. */
function bytesOfLetters(text) {
    const values = new Uint8Array(128);
    for (let code = 0, n = 0; code < 128; code++) if (!NO_LETTERS.includes(code)) values[code] = n++;
    const bytes = new Uint8Array(Math.floor((text.length * 7) / 8) + 1);
    let length = 0;
    let queue = 0;
    let nBits = 0;
    for (let i = 0; i < text.length; i += 2) {
        const isPair = i + 1 < text.length;
        const second = isPair ? values[text.charCodeAt(i + 1)] : 0;
        const pair = values[text.charCodeAt(i)] + N_LETTERS * second;
        queue |= pair << nBits;
        nBits += isPair ? ((pair & 8191) < LONG_PAIRS ? 14 : 13) : 6;
        while (nBits >= 8) {
            bytes[length++] = queue;
            queue >>>= 8;
            nBits -= 8;
        }
    }
    return bytes.subarray(0, length);
}

/** What a raw deflate stream unpacks to. */
async function inflated(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}
