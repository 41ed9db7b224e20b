// Opens the page in headless Chromium and watches that it stays quiet: no error on its console, no
// request that leaves it.
//
// The folder $ISOSPECTRUM_PAGE holds page.html and what tests/page.rs puts beside it.

import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

export const folder = process.env.ISOSPECTRUM_PAGE;
export const expected = JSON.parse(readFileSync(join(folder, "expected.json"), "utf8"));

/** WebGPU and WebGL2 on SwiftShader, which needs no graphics card; nothing that asks the network. */
const FLAGS = [
    "--enable-unsafe-webgpu",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-angle=swiftshader",
    "--no-sandbox",
    "--no-first-run",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
];

const PLACES = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

export function launch() {
    const executablePath = PLACES.find((place) => place && existsSync(place));
    assert.ok(executablePath, "no chromium: apt-get install chromium, or say where in $CHROMIUM");
    return chromium.launch({ executablePath, headless: true, args: FLAGS });
}

/** The address of the page with what follows the hash. */
export function address(hash, name = "page.html") {
    return `${pathToFileURL(join(folder, name))}#${new URLSearchParams(hash)}`;
}

/**
 * A page of a fresh context, watched. `complaints` collects what it should not do; close() asserts
 * that there was nothing.
 */
export async function watched(browser, options = {}) {
    const context = await browser.newContext({ viewport: { width: 1000, height: 800 }, ...options });
    const page = await context.newPage();
    const complaints = [];
    page.on("console", (message) => {
        if (message.type() === "error") complaints.push(`console: ${message.text()}`);
    });
    page.on("pageerror", (error) => complaints.push(`error: ${error.message}`));
    page.on("request", (request) => {
        const url = request.url();
        const isOwn = url.startsWith(String(pathToFileURL(folder))) && url.includes(".html");
        if (!isOwn && !/^(data|blob):/.test(url)) complaints.push(`request: ${url}`);
    });
    const close = async () => {
        await context.close();
        assert.deepEqual(complaints, []);
    };
    return { page, context, complaints, close };
}

/** Opens the page and waits for its first picture. */
export async function open(page, hash = {}, name) {
    await page.goto(address(hash, name));
    await page.waitForFunction(() => document.documentElement.dataset.ready, null, { timeout: 60_000 });
}

/** What the page says of itself. */
export function state(page) {
    return page.evaluate(() => window.isospectrum.getState());
}

/** Waits until the page has drawn what was asked of it. */
export async function settled(page) {
    // Inputs arrive before the next frame.
    await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(resolve)));
    await page.waitForFunction(() => !window.isospectrum.getState().isPending);
}

/** Sets the isovalue and waits for the picture. */
export async function show(page, isovalue) {
    await page.evaluate((c) => window.isospectrum.setIsovalue(c), isovalue);
    await settled(page);
}

/** The picture that the page reads back. */
export async function pixels(page) {
    const { width, height, text } = await page.evaluate(async () => {
        const picture = await window.isospectrum.pixels();
        let letters = "";
        for (const byte of picture.pixels) letters += String.fromCharCode(byte);
        return { ...picture, pixels: null, text: btoa(letters) };
    });
    return { width, height, pixels: Buffer.from(text, "base64") };
}

/** Gives the page's picture the size of the native ones: whole pixels, so that the screen shows what was drawn. */
export async function sizeAsNative(page) {
    const { width, height } = expected;
    const style = `position: fixed; left: 0; top: 0; width: ${width}px; height: ${height}px; z-index: 1`;
    await page.locator("#stage").evaluate((stage, text) => { stage.style.cssText = text; }, style);
    // The cube lies over the picture.
    await page.locator("#cube").evaluate((cube) => { cube.style.display = "none"; });
}

/** Opens the page anew at the address that it has by now. */
export async function reopen(page) {
    const url = page.url();
    await page.goto("about:blank");
    await page.goto(url);
    await page.waitForFunction(() => document.documentElement.dataset.ready);
    await settled(page);
}
