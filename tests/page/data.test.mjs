// The spectrum in the page, decoded by the page's own scripts, against the same spectrum as
// `isospectrum convert` wrote it.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { inflateRawSync } from "node:zlib";
import { expected, folder } from "./browser.mjs";

/**
 * How far 90 of 100 normals may be from those of the spectrum, radians: they are those of the page's mesh. Its vertices are
 * rounded by up to 0.05 voxel along the surface and 0.013 across, and this torus has triangles of half a voxel.
 */
const LARGEST_TURN = 0.07;

/** The same where vertices are rounded sixteen times less. */
const LARGEST_FINE_TURN = LARGEST_TURN / 16;

/** What sums of doubles around 100 are off by, in voxels: half a step is no power of two. */
const ROUNDING = 1e-12;

/** The page's way from bytes to a spectrum. */
function decoder() {
    const scripts = ["letters", "file", "connectivity", "samples", "trajectories", "normals", "active", "mesh"];
    const text = scripts.map((name) => readFileSync(new URL(`../../page/${name}.js`, import.meta.url), "utf8"));
    return new Function(`${text.join("\n")}\nreturn { bytesOfLetters, spectrumOf, decodedNormal, ActiveSet, Query };`)();
}

function embedded(name = "page.html") {
    const page = readFileSync(join(folder, name), "utf8");
    const content = (id) => new RegExp(`id="${id}">([^<]*)</script>`).exec(page)[1];
    const about = JSON.parse(content("about"));
    const spectrum = (id) => {
        const { bytesOfLetters, spectrumOf } = decoder();
        const bytes = new Uint8Array(inflateRawSync(bytesOfLetters(content(id))));
        return spectrumOf(bytes, about);
    };
    return { about, spectrum: spectrum("data"), first: spectrum("first") };
}

/** The layout of the thesis: FORMAT.md. */
function thesis() {
    const bytes = readFileSync(join(folder, "s.thesis"));
    let at = 0;
    const u32 = () => bytes.readUInt32LE((at += 4) - 4);
    const f32 = () => bytes.readFloatLE((at += 4) - 4);
    const knots = [];
    const counts = Array.from({ length: u32() }, () => {
        const count = u32();
        for (let i = 0; i < count; i++) knots.push(Array.from({ length: 7 }, f32));
        return count;
    });
    const triangles = Array.from({ length: u32() }, () => [f32(), f32(), u32(), u32(), u32()]);
    return { counts, knots, triangles };
}

test("the page holds every knot and every triangle, rounded to its step", () => {
    const { about, spectrum } = embedded();
    const { counts, knots, triangles } = thesis();
    assert.equal(about.step, expected.step);
    const { firstKnot, ranks, isovalues, positions } = spectrum;
    const aside = [];
    assert.deepEqual(Array.from(firstKnot).slice(1).map((end, v) => end - firstKnot[v]), counts);
    const f32 = Math.fround;
    knots.forEach(([x, y, z, nx, ny, nz, isovalue], knot) => {
        assert.equal(f32(isovalues[ranks[knot]]), isovalue);
        const off = [x, y, z].map((place, axis) => about.step * positions[3 * knot + axis] - place);
        // Along two axes to whole multiples of several steps, along the third back into the tangent plane.
        const most = (about.along + 0.5) * about.step + ROUNDING;
        assert.ok(off.every((miss) => Math.abs(miss) <= most), `knot ${knot} is off by ${off}`);
        const miss = off.map(Math.abs).sort();
        assert.ok(miss[1] <= (about.along / 2) * about.step + ROUNDING, `knot ${knot} is off by ${off}`);
        aside.push(Math.abs(off[0] * nx + off[1] * ny + off[2] * nz));
    });
    // Half a step, but more where the normal has turned away from the axis that the vertex faces.
    aside.sort((a, b) => a - b);
    assert.ok(aside.at(-1) <= 3 * about.step, `a knot is ${aside.at(-1)} off the surface`);
    assert.ok(aside[Math.floor(0.99 * aside.length)] <= 0.51 * about.step);
    assert.equal(spectrum.births.length, triangles.length);
    triangles.forEach(([birth, death, ...vertices], t) => {
        assert.deepEqual(Array.from(spectrum.vertices.subarray(3 * t, 3 * t + 3)), vertices);
        assert.equal(f32(isovalues[spectrum.births[t]]), birth);
        assert.equal(f32(isovalues[spectrum.deaths[t]]), death);
    });
});

test("normals are those of the mesh at every knot, as the program finds them", () => {
    const { decodedNormal } = decoder();
    const { knots } = thesis();
    for (const [name, largest] of [["page.html", LARGEST_TURN], ["fine.html", LARGEST_FINE_TURN]]) {
        const { normals } = embedded(name).spectrum;
        const turns = knots.map(([, , , x, y, z], knot) => {
            const [u, v, w] = decodedNormal(normals[2 * knot], normals[2 * knot + 1]);
            return Math.hypot(u - x, v - y, w - z);
        });
        turns.sort((a, b) => a - b);
        const most = turns[Math.floor(0.9 * turns.length)];
        assert.ok(most <= largest, `${name}: 90 of 100 normals are off by up to ${most}`);
    }
});

test("the mesh that is seen first is that of the whole at its isovalue", () => {
    const { about, spectrum, first } = embedded();
    const { Query } = decoder();
    const [whole, alone] = [spectrum, first].map((s) => {
        const query = new Query(s, about.step);
        query.moveTo(about.isovalue);
        return query.mesh(false, true);
    });
    assert.equal(alone.triangles.length, whole.triangles.length);
    assert.equal(alone.positions.length, whole.positions.length);
    // Vertices are numbered anew, so axis by axis; both are rounded.
    const along = ({ positions }, axis) => positions.filter((_, i) => i % 3 === axis).sort();
    for (let axis = 0; axis < 3; axis++) {
        const wanted = along(whole, axis);
        along(alone, axis).forEach((x, i) => {
            assert.ok(Math.abs(x - wanted[i]) <= (about.along + 1) * about.step, `${x}, expected ${wanted[i]}`);
        });
    }
});

test("active triangles are those whose lifetime contains the rank, after moves of any size", () => {
    const { spectrum } = embedded();
    const { births, deaths, isovalues } = spectrum;
    const active = new (decoder().ActiveSet)(spectrum);
    const n = isovalues.length;
    // Small steps up and down, jumps, and both ends.
    let rank = Math.floor(n / 2);
    const steps = [1, 2, -1, -3, 5, 0, 40, -25];
    const visited = [0, n - 1, Math.floor(n / 3)];
    for (let i = 0; i < 200; i++) {
        rank = Math.min(Math.max(rank + steps[i % steps.length], 0), n - 1);
        visited.push(i % 50 === 49 ? (i * 7919) % n : rank);
    }
    for (const at of visited) {
        active.moveTo(at);
        const listed = Array.from(active.list.subarray(0, active.length)).sort((a, b) => a - b);
        const wanted = [];
        births.forEach((birth, t) => { if (birth <= at && at < deaths[t]) wanted.push(t); });
        assert.deepEqual(listed, wanted, `rank ${at}`);
    }
});
