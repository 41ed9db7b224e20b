// Input by mouse, touch and keys, through the events of the browser.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { address, expected, folder, launch, open, pixels, ready, reopen, settled, show, state, watched } from "./browser.mjs";
import { countComponents, parsePly } from "./meshes.mjs";
import { difference } from "./pixels.mjs";

const [low, high] = expected.range;
const at = (share) => low + share * (high - low);

/** Asserts that the isovalue is as expected, to a step of the slider. */
async function assertIsovalue(page, isovalue, name) {
    await settled(page);
    const found = (await state(page)).isovalue;
    assert.ok(Math.abs(found - isovalue) <= 1.01e-4 * (high - low), `${name}: ${found}, expected ${isovalue}`);
}

describe("inputs", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("the slider follows the mouse and the keys and has a text for screen readers", async () => {
        const { page, close } = await watched(browser);
        await open(page, { isovalue: String(at(0.5)) });
        const slider = page.locator("#slider");
        const box = await slider.boundingBox();
        await page.mouse.click(box.x + 8 + 0.25 * (box.width - 16), box.y + box.height / 2);
        await settled(page);
        const { isovalue } = await state(page);
        assert.ok(Math.abs(isovalue - at(0.25)) < 0.01 * (high - low), `${isovalue}`);
        await slider.focus();
        await page.keyboard.press("ArrowRight");
        await assertIsovalue(page, isovalue + (high - low) / 200, "a step");
        await page.keyboard.press("Shift+ArrowLeft");
        await assertIsovalue(page, isovalue + (high - low) * (1 / 200 - 1 / 4000), "a fine step");
        await page.keyboard.press("Home");
        await assertIsovalue(page, low, "Home");
        await page.keyboard.press("End");
        await assertIsovalue(page, high, "End");
        const text = await slider.getAttribute("aria-valuetext");
        assert.match(text, /^isovalue [-\d.e]+, 100 % of the range$/);
        await close();
    });

    test("typed isovalues are numbers, percentages or percentiles; others are refused with a reason", async () => {
        const { page, close } = await watched(browser);
        await open(page);
        const typed = page.locator("#isovalue");
        await typed.fill("25%");
        await typed.press("Enter");
        await assertIsovalue(page, at(0.25), "25%");
        const digits = String(at(0.6));
        await typed.fill(digits);
        await typed.press("Enter");
        await settled(page);
        assert.equal((await state(page)).isovalue, Number(digits), "all digits count");
        await typed.fill("p90");
        await typed.press("Enter");
        await settled(page);
        // The percentiles of the page include p90, so it is exact.
        assert.equal((await state(page)).isovalue, expected.p90);
        for (const [text, isovalue] of [["top:10%", expected.p90], ["1 sigma", expected.sigma]]) {
            await typed.fill(text);
            await typed.press("Enter");
            await settled(page);
            assert.equal((await state(page)).isovalue, isovalue, text);
        }
        await typed.fill(digits);
        await typed.press("Enter");
        await settled(page);
        for (const [wrong, reason] of [["half", /expected a number/], ["1e9", /outside the range/], ["120%", /outside/],
            ["p101", /p0 to p100/], ["p9%", /expected a number, 50%/], ["top:5", /expected a number/], ["99sigma", /outside/]]) {
            await typed.fill(wrong);
            await typed.press("Enter");
            assert.match(await page.locator("#message").textContent(), reason);
            assert.equal(await typed.getAttribute("aria-invalid"), "true");
            assert.equal((await state(page)).isovalue, Number(digits));
        }
        await typed.press("Escape");
        // Keys typed into the field are text.
        await typed.fill("");
        await typed.pressSequentially("w");
        assert.equal((await state(page)).wireframe, false);
        await close();
    });

    test("the first picture is drawn before the other isovalues are loaded", async () => {
        const { page, close } = await watched(browser);
        // A worker that answers on request, with an error, so that the page decodes the spectrum itself.
        await page.addInitScript(() => {
            window.Worker = class {
                postMessage() { window.answer = (answer) => this.onmessage({ data: answer }); }
                terminate() {}
            };
        });
        await page.goto(address({}));
        await page.waitForFunction(() => window.isospectrum?.getState().nPictures > 0);
        const first = await state(page);
        assert.ok(!first.isWhole && first.nTriangles > 0);
        await page.getByText(/Isovalues .* to .* are loaded; loading the others/).waitFor();
        const [low, high] = await page.evaluate(() => JSON.parse(document.getElementById("about").textContent).first);
        // The isovalue moves within the first range and stops at its end.
        const seen = [];
        for (const c of [0.9 * low + 0.1 * first.isovalue, high, at(0.75)]) {
            await page.evaluate((isovalue) => window.isospectrum.setIsovalue(isovalue), c);
            await settled(page);
            seen.push(await pixels(page));
        }
        assert.ok(high < at(0.75) && difference(seen[0], seen[1]).share > 0.001, "within the first range it moves");
        assert.equal(difference(seen[1], seen[2]).share, 0, "at the end of the first range it stops");
        await page.evaluate(() => window.answer({ error: "out of memory" }));
        await ready(page);
        await settled(page);
        const whole = await state(page);
        assert.ok(whole.isWhole && whole.isovalue === at(0.75));
        assert.ok(difference(seen[2], await pixels(page)).share > 0.001);
        await page.locator("#loading").waitFor({ state: "hidden" });
        await close();
    });

    test("many inputs give few pictures, and the last input counts", async () => {
        const { page, close } = await watched(browser);
        await open(page);
        await settled(page);
        const before = (await state(page)).nPictures;
        // Eighty inputs in eight bursts, faster than any picture.
        const n = await page.evaluate(async () => {
            const slider = document.getElementById("slider");
            for (let i = 0; i < 80; i++) {
                slider.value = 2000 + 50 * i;
                slider.dispatchEvent(new Event("input"));
                if (i % 10 === 9) await new Promise((resolve) => setTimeout(resolve, 4));
            }
            return Number(slider.value);
        });
        await assertIsovalue(page, at(n / 10000), "the last input");
        const drawn = (await state(page)).nPictures - before;
        assert.ok(drawn >= 1 && drawn <= 12, `${drawn} pictures for 80 inputs`);
        await close();
    });

    test("the mouse rotates, moves, zooms, changes the isovalue and recentres", async () => {
        const { page, close } = await watched(browser);
        await open(page, { isovalue: String(at(0.5)), view: "35,22,1" });
        const box = await page.locator("#canvas").boundingBox();
        const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
        const drag = async (button) => {
            await page.mouse.move(x, y);
            await page.mouse.down({ button });
            await page.mouse.move(x + 50, y + 20, { steps: 4 });
            await page.mouse.up({ button });
            await settled(page);
            return (await state(page)).view;
        };
        const rotated = await drag("left");
        assert.deepEqual([rotated.azimuth, rotated.elevation].map(Math.round), [15, 30]);
        assert.deepEqual(rotated.target, [0, 0, 0]);
        const moved = await drag("middle");
        assert.ok(Math.hypot(...moved.target) > 1);
        const again = await drag("right");
        assert.ok(Math.hypot(...again.target) > 1.5 * Math.hypot(...moved.target));
        await page.mouse.move(x, y);
        await page.keyboard.down("Shift");
        await page.mouse.wheel(0, -100);
        await page.keyboard.up("Shift");
        await assertIsovalue(page, at(0.5) + (high - low) / 200, "the wheel with Shift");
        await page.mouse.wheel(0, 200);
        await settled(page);
        assert.ok(Math.abs((await state(page)).view.distance - Math.exp(0.5)) < 1e-9);
        await page.keyboard.press("r");
        await settled(page);
        const { azimuth, elevation, distance, target } = (await state(page)).view;
        assert.deepEqual([azimuth, elevation], [35, 22]);
        // The torus is in the middle of its volume and does not fill it.
        assert.ok(distance > 0.5 && distance < 1, `distance ${distance}`);
        // The middle of the picture, in perspective, is near the middle of the torus.
        assert.ok(Math.hypot(...target) < 2, `${target}`);
        // A little inside the leftmost point of the surface in the middle row of the picture.
        const column = await page.evaluate(async () => {
            const { width, height, pixels } = await window.isospectrum.pixels();
            const row = 4 * width * Math.floor(height / 2);
            let i = 0;
            while (pixels[row + 4 * i] > 250) i++;
            return (i + 12) / width;
        });
        await page.mouse.dblclick(box.x + column * box.width, y);
        await settled(page);
        assert.ok(Math.hypot(...(await state(page)).view.target) > 0.5, "a point of the surface");
        await page.mouse.dblclick(box.x + 5, box.y + 5);
        await settled(page);
        assert.deepEqual((await state(page)).view.target, [0, 0, 0], "outside the surface");
        await close();
    });

    test("one finger rotates, two move and pinch", async () => {
        const { page, context, close } = await watched(browser, {
            viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2,
        });
        await open(page, { view: "35,22,1" });
        const { view } = await state(page);
        const session = await context.newCDPSession(page);
        const box = await page.locator("#canvas").boundingBox();
        const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
        const touch = (type, points) => session.send("Input.dispatchTouchEvent", {
            type, touchPoints: points.map(([dx, dy], id) => ({ x: x + dx, y: y + dy, id })),
        });
        await touch("touchStart", [[0, 0]]);
        await touch("touchMove", [[20, 10]]);
        await touch("touchMove", [[40, 20]]);
        await touch("touchEnd", []);
        await settled(page);
        const rotated = (await state(page)).view;
        assert.ok(Math.abs(rotated.azimuth - (view.azimuth - 16)) < 1, `${rotated.azimuth}`);
        assert.ok(rotated.elevation > view.elevation);
        await touch("touchStart", [[-30, 0], [30, 0]]);
        await touch("touchMove", [[-60, 30], [60, 30]]);
        await touch("touchMove", [[-60, 40], [60, 40]]);
        await touch("touchEnd", []);
        await settled(page);
        const pinched = (await state(page)).view;
        assert.ok(Math.abs(pinched.distance - 0.5) < 0.02, `${pinched.distance}`);
        assert.ok(Math.hypot(...pinched.target) > 0.5);
        assert.equal(pinched.azimuth, rotated.azimuth);
        const width = await page.evaluate(() => document.documentElement.scrollWidth);
        assert.ok(width <= 390, `the page is ${width} wide`);
        await close();
    });

    test("keys play, show help and triangles, and save a picture", async () => {
        const { page, close } = await watched(browser);
        await open(page, { isovalue: String(at(0.1)) });
        await page.locator("#canvas").focus();
        await page.keyboard.press(" ");
        await page.waitForFunction((c) => window.isospectrum.getState().isovalue > c, at(0.15));
        await page.keyboard.press(" ");
        assert.equal((await state(page)).playing, false);
        await settled(page);
        await page.keyboard.press("w");
        assert.equal((await state(page)).wireframe, true);
        await page.keyboard.press("h");
        assert.ok(await page.locator("#help").isVisible());
        await page.keyboard.press("h");
        assert.ok(await page.locator("#help").isHidden());
        const download = page.waitForEvent("download");
        await page.keyboard.press("s");
        assert.match((await download).suggestedFilename(), /\.png$/);
        await close();
    });

    test("with reduced motion a sweep goes in steps", async () => {
        const { page, close } = await watched(browser, { reducedMotion: "reduce" });
        await open(page, { isovalue: String(low) });
        await page.locator("#play").click();
        await page.waitForFunction((c) => window.isospectrum.getState().isovalue > c, at(0.06));
        const steps = ((await state(page)).isovalue - low) / (high - low) * 24;
        assert.ok(Math.abs(steps - Math.round(steps)) < 1e-6, `${steps} steps`);
        await close();
    });

    test("marked isovalues are buttons and lines; without marks some are suggested", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        const buttons = page.locator("#isovalue-buttons button");
        assert.match(await page.locator("#isovalue-buttons").textContent(), /^Isovalues/);
        assert.equal(await buttons.count(), 2);
        await buttons.nth(0).click();
        await settled(page);
        assert.equal((await state(page)).isovalue, expected.p90);
        assert.match(await buttons.nth(0).textContent(), /^thin \(/);
        const lines = await page.locator("#plot .named").getAttribute("d");
        assert.equal(lines.match(/M/g).length, 2);
        await close();
        const other = await watched(browser);
        await open(other.page, { renderer: "webgl2" }, "ball.html");
        assert.match(await other.page.locator("#isovalue-buttons").textContent(), /^Suggested.*top:1% \(/);
        await other.close();
    });

    test("axes and a scale bar are drawn, distances are measured, points and curves have values", async () => {
        const { page, close } = await watched(browser, { viewport: { width: 720, height: 640 } });
        // A ball of 3.5 voxels around (28, 29, 12).
        await open(page, { isovalue: "150", view: "0,0,0.2,8.5,9.5,-7.5", renderer: "webgl2" }, "ball.html");
        await page.locator("#canvas").focus();
        assert.ok(await page.locator("#overlay").isHidden());
        await page.keyboard.press("g");
        await settled(page);
        assert.ok(await page.locator("#overlay").isVisible());
        assert.deepEqual(await page.locator("#overlay text").allTextContents().then((all) => all.slice(0, 3).sort()), ["x", "y", "z"]);
        const label = Number(await page.locator("#overlay text.scale").textContent());
        const bar = await page.locator("#overlay path.scale").getAttribute("d");
        const [, start, end] = /^M([\d.]+),.*H([\d.]+)M/.exec(bar).map(Number);
        const perPixel = label / (end - start);
        const box = await page.locator("#canvas").boundingBox();
        const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
        await page.locator("#measure summary").click();
        await page.locator("#pick-measure").click();
        // The group is below the picture.
        await page.evaluate(() => scrollTo(0, 0));
        const offset = 1.75 / perPixel;
        for (const side of [-1, 1]) {
            await page.mouse.click(x + side * offset, y);
            await settled(page);
        }
        const [a, b] = (await state(page)).measuredPoints;
        for (const p of [a, b]) {
            const radius = Math.hypot(p[0] - 28, p[1] - 29, p[2] - 12);
            // 8-bit samples of a cone: a ball to within the tolerance of 0.1 voxel and what rounding moves it.
            assert.ok(Math.abs(radius - 3.5) < 0.15, `${radius}`);
        }
        const distance = Number(/^Distance ([\d.]+) voxels$/.exec(await page.locator("#message").textContent())[1]);
        assert.ok(Math.abs(distance - Math.hypot(...a.map((p, i) => p - b[i]))) < 1e-3 * distance);
        // The bar is at the distance of the middle of the ball; the points are nearer by their x, which is towards the eye, so
        // lengths in pixels shrink in proportion. Tolerance: a pixel for each click, a tenth for each end of the bar.
        const eye = (perPixel * box.height) / (2 * Math.tan(Math.PI / 12));
        const wanted = 3.5 * (1 - (0.5 * (a[0] + b[0]) - 28) / eye);
        assert.ok(Math.abs(distance - wanted) < 2.2 * perPixel + 0.01 * wanted, `${distance}, expected ${wanted}`);
        await page.mouse.move(x, y);
        await page.waitForFunction(() => /^x, y, z: [-\d., ]+; value 150/.test(document.getElementById("events").textContent));
        const plot = await page.locator("#plot").boundingBox();
        await page.mouse.move(plot.x + plot.width / 2, plot.y + 10);
        const values = await page.locator("#guide span").allTextContents();
        assert.deepEqual(values.slice(-2), ["1", "2"], "components and Euler characteristic");
        assert.ok(values.slice(-4, -2).every((text) => Number(text.replaceAll(",", "")) > 0), `${values}: area and volume`);
        await page.mouse.move(5, 5);
        assert.ok(await page.locator("#guide").isHidden());
        assert.match(await page.locator("#events").textContent(), /event/);
        await close();
    });

    test("an address restores the isovalue and the view", async () => {
        const { page, close } = await watched(browser);
        await open(page, { isovalue: String(at(0.3)), view: "120,-10,0.8,1,2,3" });
        await settled(page);
        const { isovalue, view } = await state(page);
        assert.equal(isovalue, at(0.3));
        assert.deepEqual(view, { azimuth: 120, elevation: -10, distance: 0.8, target: [1, 2, 3] });
        await page.keyboard.press("]");
        await settled(page);
        // The address is updated when the isovalue has been at rest for a while.
        await page.waitForFunction((least) => {
            const inAddress = Number(new URLSearchParams(location.hash.slice(1)).get("isovalue"));
            return Math.abs(inAddress - window.isospectrum.getState().isovalue) < least;
        }, 1e-6 * (high - low));
        assert.match(page.url(), /#isovalue=[-\d.e]+&view=120,-10,0.8,1,2,3$/);
        const shown = await state(page);
        await reopen(page);
        const again = await state(page);
        assert.ok(Math.abs(again.isovalue - shown.isovalue) < 1e-6 * (high - low));
        assert.deepEqual(again.view, shown.view);
        // The event of a changed address can come after the next frame.
        await page.evaluate((c) => new Promise((resolve) => {
            window.addEventListener("hashchange", resolve, { once: true });
            location.hash = `#isovalue=${c}`;
        }), at(0.7));
        await assertIsovalue(page, at(0.7), "a changed address");
        await close();
    });

    test("counts are those of the mesh and change at events; events are those of the spectrum", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        const text = await page.locator("#events").textContent();
        const [, nEvents, nMarks] = /^([\d,]+) events? at ([\d,]+) isovalues?$/.exec(text).map((n) => Number(n.replaceAll(",", "")));
        assert.equal(nEvents, expected.n_events);
        assert.equal(nMarks, new Set(expected.events).size);
        const drawn = await page.locator("#plot .event.faint").getAttribute("d");
        const marks = [...drawn.matchAll(/M([\d.]+),/g)].map(([, x]) => Number(x));
        const column = (c) => Number(((1000 * (c - low)) / (high - low)).toFixed(1));
        assert.deepEqual(new Set(marks), new Set(expected.events.map(column)));
        for (const name of ["components", "euler"]) {
            const path = await page.locator(`#plot path.${name}`).getAttribute("d");
            assert.match(path, /^M0,[\d.]+(H[\d.]+V[\d.]+)*H1000$/, "steps only");
            const steps = [...path.matchAll(/H([\d.]+)V/g)].map(([, x]) => Number(x));
            assert.ok(steps.length > 0, name);
            // Coordinates are written with one decimal.
            for (const x of steps) assert.ok(marks.some((mark) => Math.abs(mark - x) <= 0.051), `a step of ${name} at ${x}`);
        }
        for (const [i, isovalue] of expected.isovalues.entries()) {
            await show(page, isovalue);
            await page.waitForFunction(() => document.getElementById("euler-value").textContent !== "…");
            const shown = (name) => page.locator(`#${name}-value`).textContent().then((text) => Number(text.replaceAll(",", "")));
            const { positions, triangles } = parsePly(readFileSync(join(folder, `extracted-${i}.ply`)));
            assert.equal(await shown("triangles"), triangles.length / 3);
            assert.equal(await shown("euler"), positions.length / 3 - triangles.length / 6);
            assert.equal(await shown("components"), countComponents(triangles));
        }
        await close();
    });

    test("the surfaces of all isovalues fit the first picture and fill it, and that of one isovalue if wanted", async () => {
        const { page, close } = await watched(browser, { viewport: { width: 700, height: 700 } });
        await open(page, { renderer: "webgl2" }, "ball.html");
        // The share of the picture's height that the surface takes, and whether it touches the border.
        const filled = async () => {
            const { width, height, pixels: bytes } = await pixels(page);
            let [first, last, isCut] = [height, -1, false];
            for (let i = 0; i < width * height; i++) {
                if (bytes[4 * i] > 245) continue;
                const y = Math.floor(i / width);
                [first, last] = [Math.min(first, y), Math.max(last, y)];
                isCut ||= y === 0 || y === height - 1 || i % width === 0 || i % width === width - 1;
            }
            return [(last + 1 - first) / height, isCut];
        };
        for (const isovalue of [60, 130, 199]) {
            await show(page, isovalue);
            const [share, isCut] = await filled();
            assert.ok(!isCut, `at ${isovalue}`);
            assert.ok(isovalue > 60 || share > 0.85, `${share} at ${isovalue}`);
        }
        assert.ok((await filled())[0] < 0.5);
        await page.keyboard.press("z");
        await settled(page);
        assert.ok((await filled())[0] > 0.85, "fit now");
        await page.locator("#fit-all").click();
        await settled(page);
        assert.ok((await filled())[0] < 0.5, "fit all");
        await close();
    });

    test("figures are known while the isovalue moves, and events say what they are and where", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2", isovalue: String(at(0.1)) });
        const moving = await page.evaluate(async (to) => {
            window.isospectrum.setIsovalue(to);
            await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
            return [...document.querySelectorAll("#measures dd")].map((dd) => dd.textContent);
        }, at(0.9));
        assert.ok(moving.every((text) => /^[\d.,-]+$/.test(text)), `${moving}`);
        assert.deepEqual(moving.slice(2, 4), ["1", "0"], "components and Euler characteristic of a torus");
        const words = /^[-\d.]+: (a|two) (cavity|part|handle|surfaces?) \w+ at [-\d.]+, [-\d.]+, [-\d.]+(; \d+ more)?$/;
        const list = await page.locator("#event-list option").allTextContents();
        assert.equal(list.length, new Set(expected.events).size);
        for (const text of list) assert.match(text, words);
        await page.locator("#event-list").selectOption({ index: list.length - 1 });
        await settled(page);
        assert.equal((await state(page)).isovalue, Math.max(...expected.events));
        assert.equal(await page.locator("#events").textContent(), list.at(-1));
        assert.ok(await page.locator("#overlay circle.event").count() > 0, "the place is marked in the picture");
        await close();
    });

    test("a wrong isovalue in the address, an empty picture and a link to a file are explained", async () => {
        const { page, close } = await watched(browser, { permissions: ["clipboard-write"] });
        await open(page, { renderer: "webgl2", isovalue: "1e9" });
        assert.match(await page.locator("#message").textContent(), /^isovalue=1e9 in the address: outside the range/);
        await page.locator("#min-volume").fill("1e9");
        await page.keyboard.press("Enter");
        await settled(page);
        assert.match(await page.locator("#empty").textContent(), /^No component is shown/);
        await page.locator("#show-all").click();
        await settled(page);
        assert.ok(await page.locator("#empty").isHidden());
        // At the highest value nothing is above the isovalue.
        await page.goto("about:blank");
        await open(page, { renderer: "webgl2" }, "noise.html");
        await show(page, (await state(page)).high);
        assert.equal((await state(page)).nTriangles, 0);
        assert.equal(await page.locator("#empty").textContent(), "No surface at this isovalue.");
        assert.deepEqual(await page.locator("#measures dd").allTextContents(), ["0", "0", "0", "0", "0"]);
        await page.locator("#copy-embed").click();
        await page.waitForFunction(() => /file on this computer/.test(document.getElementById("message").textContent));
        await close();
    });

    test("groups of controls stay as the reader left them", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        await page.locator("#components summary").click();
        await page.locator("#look summary").click();
        await page.waitForFunction(() => JSON.parse(localStorage.getItem("isospectrum")).look);
        await reopen(page);
        assert.deepEqual(await page.locator("#side > details").evaluateAll((all) => all.filter((d) => d.open).map((d) => d.id)), ["isovalues", "slice", "look", "share"]);
        await close();
    });

    test("a click on the curves goes to its isovalue, or to a near event", async () => {
        const { page, close } = await watched(browser);
        await open(page);
        const box = await page.locator("#plot").boundingBox();
        const point = (isovalue) => box.x + (box.width * (isovalue - low)) / (high - low);
        await page.mouse.click(point(at(0.4)), box.y + 10);
        await settled(page);
        assert.ok(Math.abs((await state(page)).isovalue - at(0.4)) < 0.01 * (high - low));
        await page.mouse.click(point(expected.event) + 2, box.y + box.height - 3);
        await settled(page);
        assert.equal((await state(page)).isovalue, expected.event);
        await close();
    });
});
