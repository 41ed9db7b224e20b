// A static server of one folder that answers range requests, as any for a linked page must; the servers of node have none.

import { existsSync, readFileSync } from "node:fs";
import { createServer } from "node:http";
import { basename, join } from "node:path";

/**
 * Serves the files of a folder. `requests` lists the name, range, status and bytes of each answer in order. `changed(name, bytes)` may return other bytes
 * for a file, `hasRanges` says whether ranges are answered, and answers wait for `pause` to resolve.
 */
export async function serve(folder) {
    const site = { requests: [], hasRanges: true, changed: (_, bytes) => bytes, pause: null };
    const server = createServer(async (request, response) => {
        const name = basename(new URL(request.url, "http://localhost").pathname);
        const path = join(folder, name);
        const asked = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? "");
        if (asked) await site.pause;
        const send = (status, bytes, headers = {}) => {
            site.requests.push({ name, range: request.headers.range, status, bytes: bytes.length });
            const type = name.endsWith(".html") ? "text/html" : "application/octet-stream";
            response.writeHead(status, { "Content-Type": type, "Access-Control-Allow-Origin": "*", ...headers });
            response.end(bytes);
        };
        if (!existsSync(path)) return send(404, "");
        const whole = site.changed(name, readFileSync(path));
        if (!asked || !site.hasRanges) return send(200, whole);
        const [from, last] = [Number(asked[1]), Math.min(Number(asked[2]), whole.length - 1)];
        if (from > last) return send(416, "", { "Content-Range": `bytes */${whole.length}` });
        return send(206, whole.subarray(from, last + 1), { "Content-Range": `bytes ${from}-${last}/${whole.length}` });
    });
    await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
    return Object.assign(site, { origin: `http://127.0.0.1:${server.address().port}`, close: () => server.close() });
}
