// Accessibility: axe-core finds nothing, and keys reach every view.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { after, before, describe, test } from "node:test";
import { expected, launch, open, openLook, settled, state, watched } from "./browser.mjs";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** The violations that axe-core finds, one per line. */
async function violations(page) {
    return page.evaluate(async () => {
        const { violations: found } = await window.axe.run(document, {
            runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
        });
        return found.flatMap(({ id, nodes }) => nodes.map((n) => `${id}: ${n.target} ${n.failureSummary}`));
    });
}

/** The contrast of two computed CSS colours (WCAG 2.2). */
function contrast(a, b) {
    const luminance = (color) => {
        const [r, g, blue] = color.match(/[\d.]+/g).slice(0, 3).map((x) => x / 255)
            .map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
        return 0.2126 * r + 0.7152 * g + 0.0722 * blue;
    };
    const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
    return (high + 0.05) / (low + 0.05);
}

describe("access", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("axe-core finds nothing, light and dark, wide and narrow, with and without help", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" }, "slice.html");
        assert.ok(await page.locator("#slice-image").isVisible());
        await page.evaluate(AXE);
        for (const colorScheme of ["light", "dark"]) {
            await page.emulateMedia({ colorScheme });
            for (const viewport of [{ width: 1280, height: 800 }, { width: 390, height: 844 }, { width: 844, height: 390 }]) {
                await page.setViewportSize(viewport);
                await settled(page);
                const name = `${colorScheme} ${viewport.width}`;
                assert.deepEqual(await violations(page), [], name);
                await page.keyboard.press("h");
                assert.ok(await page.locator("#help").isVisible());
                assert.deepEqual(await violations(page), [], `${name}, help`);
                await page.keyboard.press("h");
            }
        }
        await close();
    });

    test("what scrolls inside the page shows it at its edges, at every size, light and dark", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" }, "slice.html");
        /** Elements that have more than they show, but for lists, with the marks at their edges. */
        const scrolling = () => page.evaluate(() => [...document.querySelectorAll("body *")]
            .filter((e) => /auto|scroll/.test(getComputedStyle(e).overflowY) && e.scrollHeight > e.clientHeight + 1 && e.clientHeight > 0)
            .map((e) => [e.id, ...["::before", "::after"].map((edge) => getComputedStyle(e, edge).content)]));
        const scrollTo = async (id, top) => {
            await page.locator(id).evaluate((e, to) => { e.scrollTop = to; }, top);
            await settled(page);
        };
        const seen = new Set();
        for (const colorScheme of ["light", "dark"]) {
            await page.emulateMedia({ colorScheme });
            for (const [width, height] of [[1440, 900], [1366, 657], [1024, 768], [390, 844], [844, 390]]) {
                await page.setViewportSize({ width, height });
                await settled(page);
                await page.keyboard.press("h");
                await settled(page);
                assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), `${width}: the page is too wide`);
                for (const [id] of await scrolling()) {
                    seen.add(id);
                    // A list of a fixed height shows half of a row, and how many there are.
                    if (id === "event-list") continue;
                    for (const [top, edges] of [[0, ["none", '"▾"']], [40, ['"▴"', '"▾"']], [1e5, ['"▴"', "none"]]]) {
                        await scrollTo(`#${id}`, top);
                        assert.deepEqual((await scrolling()).find(([each]) => each === id).slice(1), edges, `${id} at ${top} of ${width}x${height}`);
                    }
                    await scrollTo(`#${id}`, 0);
                }
                await page.keyboard.press("h");
            }
        }
        assert.deepEqual([...seen].filter((id) => id !== "event-list").sort(), ["help", "side"]);
        assert.match(await page.locator("#event-count").textContent(), /^\(\d+ isovalues\)$/);
        // The marks take no room: what is below the last group stays where it is.
        await page.setViewportSize({ width: 1366, height: 657 });
        await settled(page);
        const height = () => page.locator("#side").evaluate((e) => e.scrollHeight);
        const before = await height();
        await scrollTo("#side", 1e5);
        assert.equal(await height(), before);
        await close();
    });

    test("where controls are below the picture it stays in sight, and dialogs fit the screen", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" }, "slice.html");
        for (const [width, height] of [[1024, 768], [390, 844]]) {
            await page.setViewportSize({ width, height });
            await settled(page);
            await page.locator("#transparent").scrollIntoViewIfNeeded();
            await page.evaluate(() => window.scrollTo(0, document.body.scrollHeight));
            await settled(page);
            assert.ok(await page.evaluate(() => window.scrollY) > 100, `${width}: nothing to scroll`);
            const box = await page.locator("#canvas").boundingBox();
            assert.ok(box.y >= 0 && box.y + box.height < 0.6 * height, `${width}: the picture is at ${box.y}`);
            const last = await page.locator("#transparent").boundingBox();
            assert.ok(last.y > box.y + box.height && last.y < height, "controls are below it");
            await page.evaluate(() => document.getElementById("copied").showModal());
            const [dialog, field] = await Promise.all(["#copied", "#copied-text"].map((id) => page.locator(id).boundingBox()));
            assert.ok(dialog.x >= 0 && dialog.x + dialog.width <= width && field.x + field.width < dialog.x + dialog.width, `${width}: ${JSON.stringify([dialog, field])}`);
            await page.evaluate(() => document.getElementById("copied").close());
        }
        await close();
    });

    test("the borders of controls have contrast, light and dark", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        for (const colorScheme of ["light", "dark"]) {
            await page.emulateMedia({ colorScheme });
            const borders = await page.evaluate(() => {
                const background = getComputedStyle(document.body).backgroundColor;
                const controls = [...document.querySelectorAll("button:enabled, select, input[type=text]")];
                return controls.map((c) => [getComputedStyle(c).borderTopColor, background, c.id]);
            });
            for (const [border, background, id] of borders) {
                const found = contrast(border, background);
                assert.ok(found >= 3, `${colorScheme}: ${id} ${found.toFixed(2)}`);
            }
        }
        await close();
    });

    test("keys rotate, move, zoom and go to events", async () => {
        const { page, close } = await watched(browser);
        await open(page, { view: "35,22,1", isovalue: String(expected.range[0]) });
        await page.locator("#canvas").focus();
        const press = async (key) => {
            await page.keyboard.press(key);
            await settled(page);
            return (await state(page));
        };
        assert.equal((await press("ArrowRight")).view.azimuth, 40);
        assert.equal((await press("ArrowUp")).view.elevation, 27);
        assert.equal((await press("ArrowLeft")).view.azimuth, 35);
        assert.equal((await press("ArrowDown")).view.elevation, 22);
        assert.equal((await state(page)).isovalue, expected.range[0]);
        // Wherever the focus is, but on a slider.
        await page.locator("#play").focus();
        assert.equal((await press("ArrowRight")).view.azimuth, 40);
        await page.locator("#slider").focus();
        assert.ok((await press("ArrowRight")).isovalue > expected.range[0]);
        assert.equal((await press("Home")).isovalue, expected.range[0]);
        await openLook(page);
        await page.locator("#opacity").focus();
        assert.ok(Math.abs((await press("ArrowLeft")).opacity - 0.95) < 1e-9);
        assert.deepEqual([(await state(page)).view.azimuth, (await state(page)).isovalue], [40, expected.range[0]]);
        await page.locator("#measure summary").focus();
        await press("Space");
        assert.ok(await page.locator("#pick-measure").isVisible());
        assert.equal((await state(page)).playing, false);
        await press("m");
        assert.equal(await page.locator("#pick-measure").getAttribute("aria-pressed"), "true");
        await press("m");
        await page.locator("#canvas").focus();
        assert.equal((await press("ArrowLeft")).view.azimuth, 35);
        const moved = (await press("Shift+ArrowRight")).view;
        assert.ok(Math.hypot(...moved.target) > 0.5 && moved.azimuth === 35);
        const back = (await press("Shift+ArrowLeft")).view;
        assert.ok(Math.hypot(...back.target) < 1e-6);
        assert.ok(Math.abs((await press("+")).view.distance - 1 / 1.15) < 1e-9);
        assert.ok(Math.abs((await press("-")).view.distance - 1) < 1e-9);
        const events = [...new Set(expected.events)].sort((a, b) => a - b).filter((c) => c > expected.range[0]);
        assert.equal((await press("n")).isovalue, events[0]);
        assert.equal((await press("n")).isovalue, events[1]);
        assert.equal((await press("p")).isovalue, events[0]);
        const step = (expected.range[1] - expected.range[0]) / 200;
        assert.ok(Math.abs((await press("]")).isovalue - events[0] - step) < 1e-9 * step + 1e-12);
        await page.locator("#next").click();
        await settled(page);
        assert.ok(events.includes((await state(page)).isovalue));
        await close();
    });

    test("in forced colours the slider and the legends are seen", async () => {
        const { page, close } = await watched(browser, { forcedColors: "active" });
        await open(page, { renderer: "webgl2", color: "component" });
        const colors = await page.evaluate(() => {
            const of = (selector, pseudo) => getComputedStyle(document.querySelector(selector), pseudo);
            return [of("#slider").getPropertyValue("--track"), of("dt.area", "::before").backgroundColor, of("#legend > div").backgroundImage, of("body").backgroundColor];
        });
        assert.equal(colors[0], "GrayText");
        assert.notEqual(colors[1], colors[3], "a swatch");
        assert.match(colors[2], /gradient/);
        await close();
    });

    test("messages have contrast, light and dark", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        for (const colorScheme of ["light", "dark"]) {
            await page.emulateMedia({ colorScheme });
            const [message, background] = await page.evaluate(() => [document.getElementById("message"), document.body].map((e, i) => getComputedStyle(e)[i ? "backgroundColor" : "color"]));
            assert.ok(contrast(message, background) >= 4.5, colorScheme);
        }
        await close();
    });

    test("the plot is one node to a screen reader, however many events there are", async () => {
        const { page, context, close } = await watched(browser);
        await open(page, { renderer: "webgl2" }, "noise.html");
        const text = await page.locator("#events").textContent();
        assert.ok(Number(/^[\d,]+/.exec(text)[0].replaceAll(",", "")) > 100, text);
        assert.ok(await page.locator("#plot *").count() <= 12);
        const session = await context.newCDPSession(page);
        const { nodes } = await session.send("Accessibility.getFullAXTree");
        const plot = nodes.find((n) => !n.ignored && /Euler characteristic over/.test(n.name?.value ?? ""));
        const byId = new Map(nodes.map((n) => [n.nodeId, n]));
        const below = (n) => (n.childIds ?? []).map((id) => byId.get(id))
            .flatMap((child) => (child ? [...(child.ignored ? [] : [child]), ...below(child)] : []));
        assert.ok(below(plot).length <= 1, `${below(plot).length} nodes in the plot`);
        await close();
    });
});
