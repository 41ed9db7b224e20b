// A page that is linked to a spectrum file, from a static server with range requests (server.mjs).

import assert from "node:assert/strict";
import { readFileSync, statSync } from "node:fs";
import { join } from "node:path";
import { after, before, beforeEach, test } from "node:test";
import { VIEWPORT, address, expected, folder, launch, pixels, ready, settled, state } from "./browser.mjs";
import { spectrumFile } from "./decoded.mjs";
import { assertClosedManifold, assertSameMesh, parsePly } from "./meshes.mjs";
import { assertSimilar } from "./pixels.mjs";
import { serve } from "./server.mjs";

const FILE = "large.isp";
const HASH = "#view=35,22,1&renderer=webgl2";

const { isovalues: meshes } = expected.linked;
const { chunks } = await spectrumFile(FILE);
/** The end of the chunks in the file. */
const END = chunks.at(-1).from + chunks.at(-1).bytes;
const nBytes = statSync(join(folder, FILE)).size;
let browser, site;

before(async () => {
    browser = await launch();
    site = await serve(folder);
});

after(async () => {
    await browser.close();
    site.close();
});

beforeEach(() => Object.assign(site, { requests: [], hasRanges: true, changed: (_, bytes) => bytes, pause: null }));

/** Opens a page and waits until it is ready. */
async function opened(url = `${site.origin}/linked.html${HASH}`) {
    const context = await browser.newContext({ viewport: VIEWPORT, acceptDownloads: true });
    const page = await context.newPage();
    const complaints = [];
    page.on("pageerror", (error) => complaints.push(error.message));
    page.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });
    page.on("request", (request) => {
        if (!/^(data|blob|file):/.test(request.url()) && !request.url().startsWith(`${site.origin}/`)) complaints.push(request.url());
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

/** What was fetched of the file since the requests so far. */
function fetched(before = 0) {
    const requests = site.requests.slice(before).filter(({ name }) => name === FILE);
    return { n: requests.length, bytes: requests.reduce((sum, { bytes }) => sum + bytes, 0), requests };
}

/** The mesh that the page saves. */
async function saved(page) {
    const started = page.waitForEvent("download");
    await page.locator("[data-format=ply]").click();
    return parsePly(readFileSync(await (await started).path()));
}

test("only what is shown is fetched, at both ends too, and it looks as in a page of one file", async () => {
    const { page, context, complaints } = await opened();
    const whole = await opened(`${address({}, "unlinked.html").split("#")[0]}${HASH}`);
    const { low, high } = await state(page);
    // The tables: INFO, then ISOV to the end.
    assert.deepEqual(fetched().requests.map(({ status }) => status), [206, 206]);
    const tables = fetched().bytes;
    for (const share of [0.5, 0, 0.97, 0.2, 0.7, 1]) {
        const isovalue = low * (1 - share) + high * share;
        const before = site.requests.length;
        const [found, all] = [await shown(page, isovalue), await shown(whole.page, isovalue)];
        assert.equal(found.isovalue, isovalue);
        assert.equal(found.nTriangles, all.nTriangles, `${share}`);
        // Positions of a page are rounded more.
        assertSimilar(await pixels(page), await pixels(whole.page), { mean: 0.5, share: 0.004 }, `linked, ${share}`);
        const { n, bytes } = fetched(before);
        console.log(`linked: at ${share}: ${n} requests, ${bytes} bytes`);
        assert.ok(n < chunks.length && bytes < 0.7 * nBytes, `${n} requests, ${bytes} bytes`);
    }
    const { n, bytes, requests } = fetched();
    console.log(`linked: file of ${nBytes} bytes in ${chunks.length} chunks; ${tables} bytes of tables; ${n} requests, ${bytes} bytes in all; page ${site.requests[0].bytes} bytes`);
    assert.ok(requests.every(({ status }) => status === 206));
    // The chunks of the last isovalues are kept.
    const before = site.requests.length;
    await shown(page, low * 0.3 + high * 0.7);
    await shown(page, low * 0.8 + high * 0.2);
    assert.equal(site.requests.length, before);
    assert.deepEqual([...complaints, ...whole.complaints], []);
    await context.close();
    await whole.context.close();
});

test("meshes are those that extract writes", async () => {
    const { page, context, complaints } = await opened();
    for (const [i, isovalue] of meshes.entries()) {
        await shown(page, isovalue);
        const mesh = await saved(page);
        assertClosedManifold(mesh);
        assertSameMesh(mesh, parsePly(readFileSync(join(folder, `linked-${i}.ply`))));
    }
    assert.deepEqual(complaints, []);
    await context.close();
});

test("a page that is linked to a file of bricks has the meshes that extract writes", async () => {
    const { page, context, complaints } = await opened(`${site.origin}/linked-bricks.html${HASH}`);
    for (const [i, isovalue] of expected.bricks.isovalues.entries()) {
        await shown(page, isovalue);
        const mesh = await saved(page);
        assertClosedManifold(mesh);
        assertSameMesh(mesh, parsePly(readFileSync(join(folder, `bricks-${i}.ply`))));
    }
    assert.deepEqual(complaints, []);
    await context.close();
});

test("until an isovalue is loaded the nearest one is shown, and what is no longer wanted is not waited for", async () => {
    const { page, context, complaints } = await opened();
    const { low, high } = await state(page);
    let release;
    site.pause = new Promise((resolve) => { release = resolve; });
    await page.evaluate((c) => window.isospectrum.setIsovalue(c), high);
    await settled(page);
    const waiting = await state(page);
    assert.ok(!waiting.isWhole && waiting.isovalue < high && waiting.nTriangles > 0);
    assert.match(await page.locator("#loading").textContent(), /loading the others/);
    // The reader moves on, back and forth.
    for (const c of [low, high, low]) {
        await page.evaluate((isovalue) => window.isospectrum.setIsovalue(isovalue), c);
        await settled(page);
    }
    release();
    assert.equal((await shown(page, low)).isovalue, low);
    assert.ok(await page.locator("#loading").isHidden());
    assert.deepEqual(complaints, []);
    await context.close();
});

/** The number of green pixels of the picture. */
async function nGreen(page) {
    const { pixels: values } = await pixels(page);
    let n = 0;
    for (let i = 0; i < values.length; i += 4) if (values[i + 1] > 1.5 * Math.max(values[i], values[i + 2], 20)) n++;
    return n;
}

test("play goes through all isovalues, and a further isosurface stays", async () => {
    const { page, context, complaints } = await opened();
    const { low, high } = await state(page);
    const at = (share) => low * (1 - share) + high * share;
    await shown(page, at(0.4));
    assert.equal(await nGreen(page), 0);
    await context.close();
    const other = await opened(`${site.origin}/linked.html${HASH}&isovalue=${at(0.4)}&also=${at(0.05)},00ff00,1`);
    await shown(other.page, at(0.4));
    // It is around that of the slider; the chunks of both are loaded together.
    let n = 0;
    for (const until = Date.now() + 60_000; n === 0 && Date.now() < until; await other.page.waitForTimeout(50)) n = await nGreen(other.page);
    assert.ok(n > 100, `${n} green pixels`);
    await other.page.locator("#play").click();
    const visited = new Set();
    for (const until = Date.now() + 60_000; !visited.has(9); await other.page.waitForTimeout(50)) {
        assert.ok(Date.now() < until, `only ${[...visited]}`);
        visited.add(Math.floor((10 * ((await state(other.page)).isovalue - low)) / (high - low)));
    }
    assert.deepEqual([5, 6, 7, 8].filter((tenth) => !visited.has(tenth)), []);
    await other.page.locator("#play").click();
    await shown(other.page, at(0.1));
    assert.ok(await nGreen(other.page) > 100);
    assert.deepEqual([...complaints, ...other.complaints], []);
    await other.context.close();
});

test("a film waits for the isovalues of its pictures", async () => {
    const { page, context, complaints } = await opened();
    await page.locator("#speed").selectOption("4");
    const [download] = await Promise.all([page.waitForEvent("download", { timeout: 120_000 }), page.locator("#film").click()]);
    assert.match(download.suggestedFilename(), /-sweep\.webm$/);
    // Every chunk was wanted by some picture.
    const starts = new Set(fetched().requests.map(({ range }) => Number(/bytes=(\d+)-/.exec(range)[1])));
    assert.deepEqual(chunks.filter(({ from }, i) => !starts.has(i === 0 ? 0 : from)), []);
    assert.deepEqual(complaints, []);
    await context.close();
});

/** Shows an isovalue at an end of the range that cannot be loaded, and asserts that the reason is shown and the picture stays. */
async function assertReported(page, reason, share = 1) {
    const { low, high } = await state(page);
    await page.evaluate((c) => window.isospectrum.setIsovalue(c), low * (1 - share) + high * share);
    // Not the text from before this isovalue was set.
    await page.waitForFunction((text) => {
        const element = document.getElementById("loading");
        return !window.isospectrum.getState().isPending && !element.hidden && element.textContent.includes(text);
    }, reason);
    const after = await state(page);
    assert.ok(!after.isWhole && after.nTriangles > 0);
    const text = await page.locator("#loading").textContent();
    assert.match(text, /^Other isovalues cannot be loaded: large\.isp: [^\n]+\.$/);
    return after;
}

test("a server without range requests is reported, and the first picture stays", async () => {
    site.hasRanges = false;
    const { page, context } = await opened();
    // At once, before any isovalue is asked for.
    assert.match(await page.locator("#loading").textContent(), /the server does not answer range requests/);
    assert.ok(await page.locator("#loading").isVisible());
    const { isovalue } = await assertReported(page, "status 200, expected 206");
    // The next attempt succeeds.
    site.hasRanges = true;
    await shown(page, isovalue);
    const { high } = await state(page);
    assert.equal((await shown(page, high)).isovalue, high);
    await context.close();
});

test("a damaged chunk is reported; other isovalues are shown", async () => {
    // A byte of the last chunk, which only the highest isovalues need.
    const at = END - 1000;
    site.changed = (name, bytes) => {
        if (name === FILE) bytes[at] ^= 1;
        return bytes;
    };
    const { page, context } = await opened();
    await assertReported(page, `chunk ${chunks.length - 1} is damaged, or of another file: its checksum is wrong`);
    const { low } = await state(page);
    assert.equal((await shown(page, low)).isovalue, low);
    assert.ok(await page.locator("#loading").isHidden());
    await context.close();
});

test("a damaged table, another file in its place, a shorter one and none are reported", async () => {
    const original = readFileSync(join(folder, FILE));
    const other = readFileSync(join(folder, "noise.isp"));
    const flipped = (at) => () => {
        const bytes = Buffer.from(original);
        bytes[at] ^= 1;
        return bytes;
    };
    const resized = Buffer.concat([original.subarray(0, nBytes - 100), other.subarray(0, 60), original.subarray(nBytes - 40)]);
    for (const [changed, reason] of [
        [() => other, "not the file of this page"],
        [() => original.subarray(0, nBytes - 1), "not the file of this page"],
        [() => resized, "is damaged: its checksum is wrong"],
        [flipped(END + 200), "section INFO is damaged: its checksum is wrong"],
        [flipped(nBytes - 60), "section INDX is damaged: its checksum is wrong"],
        // Part of the header, which is read with the first chunk.
        [flipped(9), "not a spectrum file that this page can read"],
    ]) {
        site.changed = (name, bytes) => (name === FILE ? changed() : bytes);
        const { page, context } = await opened();
        await assertReported(page, reason);
        await context.close();
    }
    // The file is replaced while the page is open.
    site.changed = (_, bytes) => bytes;
    const open = await opened();
    site.changed = (name, bytes) => (name === FILE ? other : bytes);
    await assertReported(open.page, "or of another file", 0);
    await open.context.close();
    site.changed = (_, bytes) => bytes;
    const { page, context } = await opened(`${site.origin}/lost.html${HASH}`);
    assert.match(await page.locator("#loading").textContent(), /lost\.isp: status 404, expected 206\.$/);
    await context.close();
});

test("a page without isovalues of its own starts with those of the file, or says why not", async () => {
    const { page, context, complaints } = await opened(`${site.origin}/top.html${HASH}`);
    const { isovalue, low, high } = await state(page);
    assert.equal(isovalue, high);
    assert.ok((await shown(page, low)).nTriangles > 0);
    assert.deepEqual(complaints, []);
    site.hasRanges = false;
    await page.goto("about:blank");
    await page.goto(`${site.origin}/top.html${HASH}`);
    await page.waitForFunction(() => /cannot be shown: large\.isp: status 200/.test(document.getElementById("still-message").textContent));
    await context.close();
});

test("the page can send requests to its own server only, and one from a disk says what it needs", async () => {
    const { page, context } = await opened();
    const other = await serve(folder);
    const answer = (to) => page.evaluate((url) => fetch(url).then(() => "there", () => "refused"), to);
    assert.equal(await answer(`${site.origin}/${FILE}`), "there");
    assert.equal(await answer(`${other.origin}/${FILE}`), "refused");
    const policy = await page.locator("meta[http-equiv=Content-Security-Policy]").getAttribute("content");
    assert.ok(policy.includes("connect-src 'self';") && policy.includes("default-src 'none'"));
    other.close();
    await context.close();
    const local = await browser.newContext({ viewport: VIEWPORT });
    const disk = await local.newPage();
    await disk.goto(address({ renderer: "webgl2" }, "linked.html"));
    await ready(disk);
    assert.match(await disk.locator("#loading").textContent(), /it needs a server\.$/);
    await local.close();
});
