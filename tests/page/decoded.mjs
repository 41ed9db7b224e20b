// Decodes the spectra in a page with the scripts of the page.

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { inflateRawSync } from "node:zlib";
import { folder } from "./browser.mjs";

const SCRIPTS = ["unpack", "file", "coder", "connectivity", "samples", "trajectories", "active", "normals", "surface", "mesh"];
const text = SCRIPTS.map((name) => readFileSync(new URL(`../../page/${name}.js`, import.meta.url), "utf8"));

export const { bytesOfBase64, spectrumOf, ActiveSet, Query } = new Function(
    `${text.join("\n")}\nreturn { bytesOfBase64, spectrumOf, ActiveSet, Query };`,
)();

/** The description, the spectrum and the first range of a page. */
export function decodedPage(name = "page.html") {
    const page = readFileSync(join(folder, name), "utf8");
    const content = (id) => new RegExp(`id="${id}">([^<]*)</script>`).exec(page)[1];
    const about = JSON.parse(content("about"));
    const spectrum = (id) => spectrumOf(new Uint8Array(inflateRawSync(bytesOfBase64(content(id)))), about);
    return { about, spectrum: spectrum("data"), first: content("first") ? spectrum("first") : null };
}
