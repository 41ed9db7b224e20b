// The spectrum in the page, decoded with the page's scripts, compared with the same spectrum in the thesis's layout, which
// `isospectrum convert` wrote.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { expected, folder } from "./browser.mjs";
import { ActiveSet, Query, decodedPage, spectrumFile } from "./decoded.mjs";

/** The rounding error of sums of doubles around 100, voxels: half a step is no power of two. */
const ROUNDING = 1e-12;

/** Steps that a coordinate along the surface is a multiple of. */
const COARSE = 4;

/** The layout of the thesis: FORMAT.md. */
function thesis(name) {
    const bytes = readFileSync(join(folder, name));
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

test("the page has every knot and every triangle, rounded to its step", () => {
    const { about, spectrum } = decodedPage();
    const { counts, knots, triangles } = thesis("s.thesis");
    assert.equal(about.step, expected.step);
    const { firstKnot, ranks, isovalues, positions } = spectrum;
    const distances = [];
    assert.deepEqual(Array.from(firstKnot).slice(1).map((end, v) => end - firstKnot[v]), counts);
    const f32 = Math.fround;
    knots.forEach(([x, y, z, nx, ny, nz, isovalue], knot) => {
        assert.equal(f32(isovalues[ranks[knot]]), isovalue);
        const off = [x, y, z].map((place, axis) => about.step * positions[3 * knot + axis] - place);
        // Two coordinates are rounded to several steps; the third is moved back into the tangent plane, by up to as much.
        const bound = (COARSE + 0.5) * about.step + ROUNDING;
        assert.ok(off.every((error) => Math.abs(error) <= bound), `knot ${knot} is off by ${off}`);
        const errors = off.map(Math.abs).sort();
        assert.ok(errors[1] <= (COARSE / 2) * about.step + ROUNDING, `knot ${knot} is off by ${off}`);
        distances.push(Math.abs(off[0] * nx + off[1] * ny + off[2] * nz));
    });
    // Half a step; more if the normal has turned away from the axis that the vertex faces.
    distances.sort((a, b) => a - b);
    assert.ok(distances.at(-1) <= 3 * about.step, `a knot is ${distances.at(-1)} off the surface`);
    assert.ok(distances[Math.floor(0.99 * distances.length)] <= 0.51 * about.step);
    assert.equal(spectrum.births.length, triangles.length);
    triangles.forEach(([birth, death, ...vertices], t) => {
        assert.deepEqual(Array.from(spectrum.vertices.subarray(3 * t, 3 * t + 3)), vertices);
        assert.equal(f32(isovalues[spectrum.births[t]]), birth);
        assert.equal(f32(isovalues[spectrum.deaths[t]]), death);
    });
});

test("the chunks of a file have every knot and every triangle, exactly and in the order of the file", async () => {
    const { counts, knots, triangles } = thesis("large.thesis");
    const { isovalues, chunks, quantum, decode } = await spectrumFile("large.isp");
    // Chunks with and without a pivot, some of them several levels down.
    assert.ok(chunks.length >= 7 && chunks.filter(({ pivot }) => pivot >= 0).length >= 3, `${chunks.length} chunks`);
    const { firstKnot, ranks, positions, vertices, births, deaths } = decode();
    assert.deepEqual(Array.from(firstKnot).slice(1).map((end, v) => end - firstKnot[v]), counts);
    const f32 = Math.fround;
    knots.forEach(([x, y, z, , , , isovalue], knot) => {
        const found = [0, 1, 2].map((axis) => f32(quantum * positions[3 * knot + axis]));
        if (found[0] !== x || found[1] !== y || found[2] !== z) assert.fail(`knot ${knot} is at ${found}, expected ${[x, y, z]}`);
        if (f32(isovalues[ranks[knot]]) !== isovalue) assert.fail(`knot ${knot}`);
    });
    assert.equal(births.length, triangles.length);
    triangles.forEach(([birth, death, ...corners], t) => {
        const isSame = corners.every((v, k) => vertices[3 * t + k] === v) && f32(isovalues[births[t]]) === birth && f32(isovalues[deaths[t]]) === death;
        if (!isSame) assert.fail(`triangle ${t}`);
    });
});

test("the first range has the meshes of the whole spectrum", () => {
    const { about } = decodedPage();
    const [low, high] = about.first;
    assert.ok(low < about.isovalue && about.isovalue < high, `${low} to ${high}`);
    // Not at the ends: a triangle that is born or dies there belongs to one of the two only.
    const shares = [0.02, 0.3, 0.71, 0.98];
    for (const c of [about.isovalue, ...shares.map((t) => low * (1 - t) + high * t)]) compareFirst(c);
});

function compareFirst(isovalue) {
    const { about, spectrum, first } = decodedPage();
    const [whole, alone] = [spectrum, first].map((s) => {
        const query = new Query(s, about.step);
        query.moveTo(isovalue, false);
        return query.mesh(true);
    });
    assert.equal(alone.triangles.length, whole.triangles.length);
    assert.equal(alone.positions.length, whole.positions.length);
    // Vertices are numbered differently, so coordinates are compared in order; both are rounded.
    const along = ({ positions }, axis) => positions.filter((_, i) => i % 3 === axis).sort();
    for (let axis = 0; axis < 3; axis++) {
        const wanted = along(whole, axis);
        along(alone, axis).forEach((x, i) => {
            assert.ok(Math.abs(x - wanted[i]) <= (COARSE + 1) * about.step, `${x}, expected ${wanted[i]}`);
        });
    }
}

test("active triangles are those whose lifetime contains the rank, after moves of any size", () => {
    const { spectrum } = decodedPage();
    const { births, deaths, isovalues } = spectrum;
    const active = new ActiveSet(spectrum);
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
