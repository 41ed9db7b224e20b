// Reads the packed data of the page: base64 of a raw deflate stream, as src/page/data.rs writes it.

/** The bytes of a base64 text. */
function bytesOfBase64(text) {
    // 2025 and later.
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const characters = atob(text);
    const bytes = new Uint8Array(characters.length);
    for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
    return bytes;
}

/** Inflates a raw deflate stream. */
async function inflated(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}
