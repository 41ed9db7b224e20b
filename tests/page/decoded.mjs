// Decodes the spectra in a page, and the chunks of a spectrum file, with the scripts of the page.

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { inflateRawSync } from "node:zlib";
import { folder } from "./browser.mjs";

const SCRIPTS = ["unpack", "coder", "file", "connectivity", "samples", "trajectories", "active", "normals", "surface", "mesh", "container", "chunk"];
const text = SCRIPTS.map((name) => readFileSync(new URL(`../../page/${name}.js`, import.meta.url), "utf8"));

const NAMES = ["bytesOfBase64", "spectrumOf", "ActiveSet", "Query", "sectionIn", "contentOf", "Columns", "isovaluesOf", "chunksOf", "quantumOf",
    "Samples", "decodedChunk", "joined", "crc32Of"];
const scripts = new Function(`${text.join("\n")}\nreturn { ${NAMES.join(", ")} };`)();
export const { bytesOfBase64, spectrumOf, ActiveSet, Query } = scripts;

/** The description, the spectrum and the first range of a page. */
export function decodedPage(name = "page.html") {
    const page = readFileSync(join(folder, name), "utf8");
    const content = (id) => new RegExp(`id="${id}">([^<]*)</script>`).exec(page)[1];
    const about = JSON.parse(content("about"));
    const spectrum = (id) => spectrumOf(new Uint8Array(inflateRawSync(bytesOfBase64(content(id)))), about);
    return { about, spectrum: spectrum("data"), first: content("first") ? spectrum("first") : null };
}

/** The tables of a spectrum file: its isovalues, chunks and the size of a quantum; and a function that decodes all chunks. */
export async function spectrumFile(name) {
    const bytes = new Uint8Array(readFileSync(join(folder, name)));
    const view = new DataView(bytes.buffer, bytes.byteOffset);
    let rest = bytes.subarray(Number(view.getBigUint64(bytes.length - 16, true)));
    const tables = {};
    for (const tag of ["INFO", "EVNT", "ISOV", "COLL", "INDX"]) {
        const section = scripts.sectionIn(rest, tag);
        tables[tag] = await scripts.contentOf(section);
        rest = section.rest;
    }
    const { tolerance, volume } = JSON.parse(new TextDecoder().decode(tables.INFO));
    const isovalues = scripts.isovaluesOf(new scripts.Columns(tables.ISOV));
    const chunks = scripts.chunksOf(tables.INDX, [isovalues.length]);
    const quantum = scripts.quantumOf(tolerance);
    const samples = new scripts.Samples(volume, 1 / quantum);
    const decode = () => {
        const decoded = [];
        for (const chunk of chunks) {
            const stored = bytes.subarray(chunk.from, chunk.from + chunk.bytes);
            if (scripts.crc32Of(stored) !== chunk.crc) throw new Error(`chunk ${chunk.number}`);
            const above = decoded.filter(({ number }) => chunk.number < chunks[number].end);
            decoded.push(scripts.decodedChunk(stored, chunk, above, { isovalues, samples }));
        }
        return scripts.joined(decoded);
    };
    return { isovalues, chunks, quantum, decode };
}
