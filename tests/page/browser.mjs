// Opens pages in headless Chromium and checks that they log no error and send no request.
//
// The folder $ISOSPECTRUM_PAGE has the pages and the expected values that tests/page/browser.rs writes.

import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

export const folder = process.env.ISOSPECTRUM_PAGE;
export const expected = JSON.parse(readFileSync(join(folder, "expected.json"), "utf8"));

/** WebGPU and WebGL2 on SwiftShader, which needs no graphics card; no background requests. */
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

/** The page is composed by the processor: in one queue with SwiftShader, a WebGL2 picture takes up to ten times as long. */
const WITHOUT_GPU_COMPOSITING = "--disable-gpu-compositing";

/** Chromium without windows is first: it takes a fifth of the time to open a context. */
const EXECUTABLES = [process.env.CHROMIUM, ...["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"]
    .map((name) => `/usr/bin/${name}`)];

/** Pixels in a page, few because a processor draws them. */
export const VIEWPORT = { width: 480, height: 560 };

/** Milliseconds until a page must be ready. */
const TIMEOUT = 60_000;

/** Starts the browser. Only on the screen of one with GPU compositing is there what WebGPU draws. */
export function launch({ hasGpuCompositing = false } = {}) {
    const executablePath = EXECUTABLES.find((path) => path && existsSync(path));
    assert.ok(executablePath, "no chromium: apt-get install chromium, or set $CHROMIUM to its path");
    const args = hasGpuCompositing ? FLAGS : [...FLAGS, WITHOUT_GPU_COMPOSITING];
    return chromium.launch({ executablePath, headless: true, args });
}

/** The address of a page with parameters after the hash. */
export function address(hash, name = "page.html") {
    return `${pathToFileURL(join(folder, name))}#${new URLSearchParams(hash)}`;
}

/** A page in a new context. close() asserts that there was no error in its console and no request that leaves the page. */
export async function watched(browser, options = {}) {
    const context = await browser.newContext({ viewport: VIEWPORT, ...options });
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

/** Waits until the whole spectrum of a page is loaded and drawn. */
export function ready(page) {
    return page.waitForFunction(() => document.documentElement.dataset.ready, null, { timeout: TIMEOUT });
}

/** Opens a page and waits until it is ready. */
export async function open(page, hash = {}, name) {
    await page.goto(address(hash, name));
    await ready(page);
}

/** Opens the group of controls "Look", which stays as the reader left it. */
export function openLook(page) {
    return page.locator("#look").evaluate((look) => { look.open = true; });
}

/** Changes the address of an open page, as a reader does who edits it, and waits for the picture. */
export async function setAddress(page, hash) {
    await page.evaluate((text) => new Promise((resolve) => {
        window.addEventListener("hashchange", resolve, { once: true });
        location.hash = text;
    }), String(new URLSearchParams(hash)));
    await settled(page);
}

/** Opens a page anew at its current address. */
export async function reopen(page) {
    const url = page.url();
    await page.goto("about:blank");
    await page.goto(url);
    await ready(page);
    await settled(page);
}

/** The state of a page. */
export function state(page) {
    return page.evaluate(() => window.isospectrum.getState());
}

/** Waits until a page has drawn its latest state. */
export async function settled(page) {
    // Input events are delivered before the next frame.
    await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(resolve)));
    await page.waitForFunction(() => !window.isospectrum.getState().isPending);
}

/** Sets the isovalue and waits for the picture. */
export async function show(page, isovalue) {
    await page.evaluate((c) => window.isospectrum.setIsovalue(c), isovalue);
    await settled(page);
}

/** The picture that a page draws and reads back. */
export async function pixels(page) {
    const { width, height, text } = await page.evaluate(async () => {
        const picture = await window.isospectrum.pixels();
        let characters = "";
        for (let i = 0; i < picture.pixels.length; i += 8192) {
            characters += String.fromCharCode(...picture.pixels.subarray(i, i + 8192));
        }
        return { ...picture, pixels: null, text: btoa(characters) };
    });
    return { width, height, pixels: Buffer.from(text, "base64") };
}

/** Gives the canvas the size of the native pictures, in whole pixels, so that the screen shows what was drawn. */
export async function setNativeSize(page) {
    const { width, height } = expected;
    await page.setViewportSize({ width, height });
    const style = `position: fixed; left: 0; top: 0; width: ${width}px; height: ${height}px; z-index: 1`;
    await page.locator("#stage").evaluate((stage, text) => { stage.style.cssText = text; }, style);
    // The cube would cover the picture.
    await page.locator("#cube").evaluate((cube) => { cube.style.display = "none"; });
}
