// A page in several files, from a static server.

import assert from "node:assert/strict";
import { existsSync, readFileSync, readdirSync, statSync } from "node:fs";
import { createServer } from "node:http";
import { basename, join } from "node:path";
import { after, before, test } from "node:test";
import { VIEWPORT, address, folder, launch, pixels, ready, settled, state } from "./browser.mjs";
import { assertSimilar } from "./pixels.mjs";

const site = join(folder, "split");
let browser, server, origin, requested;

/** Serves the files of the folder; `requested` lists their names in order. */
before(async () => {
    browser = await launch();
    server = createServer((request, response) => {
        const name = basename(new URL(request.url, "http://localhost").pathname) || "index.html";
        requested.push(name);
        const path = join(site, name);
        response.writeHead(existsSync(path) ? 200 : 404, { "Content-Type": name.endsWith(".html") ? "text/html" : "application/octet-stream" });
        response.end(existsSync(path) ? readFileSync(path) : "");
    });
    await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
    origin = `http://127.0.0.1:${server.address().port}`;
});

after(async () => {
    await browser.close();
    server.close();
});

/** Opens a page and waits until it is ready. */
async function opened(url) {
    requested = [];
    const context = await browser.newContext({ viewport: VIEWPORT });
    const page = await context.newPage();
    const complaints = [];
    page.on("pageerror", (error) => complaints.push(error.message));
    page.on("request", (request) => {
        if (!/^(data|blob|file):/.test(request.url()) && !request.url().startsWith(`${origin}/`)) complaints.push(request.url());
    });
    await page.goto(url);
    await ready(page);
    return { page, context, complaints };
}

/** Sets the isovalue and waits until it is loaded and drawn. */
async function shown(page, isovalue) {
    await page.evaluate((c) => window.isospectrum.setIsovalue(c), isovalue);
    await page.waitForFunction(() => {
        const { isWhole, isPending } = window.isospectrum.getState();
        return isWhole && !isPending;
    }, null, { timeout: 60_000 });
    await settled(page);
    return state(page);
}

const names = readdirSync(site).filter((name) => name.endsWith(".bin"));
const size = (name) => statSync(join(site, name)).size;

test("only what is shown is fetched, and it looks as in a page of one file", async () => {
    assert.ok(names.length >= 4, `${names.length} files`);
    const hash = "#view=35,22,1&renderer=webgl2";
    const { page, context, complaints } = await opened(`${origin}/${hash}`);
    const whole = await opened(`${address({}, "unsplit.html").split("#")[0]}${hash}`);
    requested = [];
    const { low, high } = await state(page);
    for (const share of [0.5, 0.2, 0.7, 0.95, 0.05, 0.6]) {
        const isovalue = low + share * (high - low);
        const before = requested.length;
        const [found, expected] = [await shown(page, isovalue), await shown(whole.page, isovalue)];
        assert.equal(found.isovalue, isovalue);
        assert.equal(found.nTriangles, expected.nTriangles, `${share}`);
        const pictures = [await pixels(page), await pixels(whole.page)];
        // Files are rounded separately, which changes single pixels of outlines.
        assertSimilar(pictures[0], pictures[1], { mean: 0.2, share: 0.002 }, `split, ${share}`);
        assert.ok(requested.length - before <= 1, requested.slice(before).join());
    }
    const read = requested.reduce((n, name) => n + size(name), 0);
    const all = names.reduce((n, name) => n + size(name), 0);
    const largest = Math.max(...names.map(size));
    console.log(`split: ${names.length} files of ${all} bytes, ${largest} at most for one isovalue; page ${size("index.html")} bytes`);
    assert.ok(read <= requested.length * largest && 3 * largest < all, `${read} of ${all} bytes`);
    // Files that were shown last are kept.
    const before = requested.length;
    await shown(page, low + 0.05 * (high - low));
    await shown(page, low + 0.6 * (high - low));
    assert.equal(requested.length, before);
    assert.deepEqual([...complaints, ...whole.complaints], []);
    await context.close();
    await whole.context.close();
});

test("the page can send requests to its own server only", async () => {
    const { page, context } = await opened(`${origin}/`);
    const other = createServer((_, response) => response.end("there"));
    await new Promise((resolve) => other.listen(0, "127.0.0.1", resolve));
    const url = `http://127.0.0.1:${other.address().port}/`;
    const answer = (to) => page.evaluate((u) => fetch(u).then(() => "there", () => "refused"), to);
    assert.equal(await answer(`${origin}/000.bin`), "there");
    assert.equal(await answer(url), "refused");
    const policy = await page.locator("meta[http-equiv=Content-Security-Policy]").getAttribute("content");
    assert.ok(policy.includes("connect-src 'self';") && policy.includes("default-src 'none'"));
    other.close();
    await context.close();
});

/** Shows an isovalue whose file is not answered as it should be, and asserts that the reason is shown and the picture stays. */
async function assertReported(page, reason) {
    const { low, high, isovalue } = await state(page);
    const distant = isovalue - low > high - isovalue ? low + 0.02 * (high - low) : high - 0.02 * (high - low);
    await page.evaluate((c) => window.isospectrum.setIsovalue(c), distant);
    await page.waitForFunction((text) => document.getElementById("loading").textContent.includes(text), reason);
    const after = await state(page);
    assert.ok(!after.isWhole && after.nTriangles > 0);
    return { isovalue, distant };
}

test("a file that cannot be loaded is reported, and the picture stays", async () => {
    const { page, context } = await opened(`${origin}/`);
    await page.route("**/*.bin", (route) => route.fulfill({ status: 404, body: "" }));
    const { isovalue, distant } = await assertReported(page, "cannot be loaded");
    // The next attempt succeeds.
    await page.unroute("**/*.bin");
    await shown(page, isovalue);
    await shown(page, distant);
    await context.close();
});

test("a file of another page is not shown but reported, and the picture stays", async () => {
    const { page, context } = await opened(`${origin}/`);
    const other = (name) => readFileSync(join(site, name === names[0] ? names[1] : names[0]));
    await page.route("**/*.bin", (route) => route.fulfill({ body: other(basename(route.request().url())) }));
    await assertReported(page, "not the file of this page");
    await context.close();
});
