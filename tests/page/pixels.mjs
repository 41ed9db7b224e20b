// Reads and compares pictures.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";

/** Two pixels are different if a channel differs by more than this, a tenth of the range. */
export const MAX_PIXEL_DIFFERENCE = 25;

/** Decodes a PNG of 8-bit RGB or RGBA without interlacing to RGBA. */
export function decodePng(bytes) {
    const chunks = [];
    let head;
    for (let at = 8; at < bytes.length; ) {
        const length = bytes.readUInt32BE(at);
        const tag = bytes.toString("latin1", at + 4, at + 8);
        const content = bytes.subarray(at + 8, at + 8 + length);
        if (tag === "IHDR") head = content;
        if (tag === "IDAT") chunks.push(content);
        at += 12 + length;
    }
    const [width, height] = [head.readUInt32BE(0), head.readUInt32BE(4)];
    const [depth, color, interlace] = [head[8], head[9], head[12]];
    assert.ok(depth === 8 && (color === 2 || color === 6) && interlace === 0, "8-bit RGB or RGBA");
    const size = color === 6 ? 4 : 3;
    const lines = inflateSync(Buffer.concat(chunks));
    const stride = size * width;
    const rows = Buffer.alloc(stride * height);
    for (let y = 0; y < height; y++) {
        const filter = lines[y * (stride + 1)];
        for (let i = 0; i < stride; i++) {
            const left = i >= size ? rows[y * stride + i - size] : 0;
            const up = y > 0 ? rows[(y - 1) * stride + i] : 0;
            const corner = i >= size && y > 0 ? rows[(y - 1) * stride + i - size] : 0;
            const add = [0, left, up, (left + up) >> 1, paeth(left, up, corner)][filter];
            rows[y * stride + i] = lines[y * (stride + 1) + 1 + i] + add;
        }
    }
    const pixels = new Uint8Array(4 * width * height).fill(255);
    for (let i = 0; i < width * height; i++) {
        for (let channel = 0; channel < size; channel++) pixels[4 * i + channel] = rows[size * i + channel];
    }
    return { width, height, pixels };
}

function paeth(left, up, corner) {
    const guess = left + up - corner;
    const [a, b, c] = [left, up, corner].map((x) => Math.abs(guess - x));
    if (a <= b && a <= c) return left;
    return b <= c ? up : corner;
}

export function readPng(path) {
    return decodePng(readFileSync(path));
}

/** The mean difference of two pictures over all channels, and the share of different pixels. */
export function difference(a, b) {
    assert.deepEqual([a.width, a.height], [b.width, b.height], "size");
    let [sum, nDifferent] = [0, 0];
    for (let i = 0; i < a.pixels.length; i += 4) {
        let largest = 0;
        for (let channel = 0; channel < 3; channel++) {
            const d = Math.abs(a.pixels[i + channel] - b.pixels[i + channel]);
            sum += d;
            largest = Math.max(largest, d);
        }
        if (largest > MAX_PIXEL_DIFFERENCE) nDifferent++;
    }
    return { mean: sum / (0.75 * a.pixels.length), share: nDifferent / (a.pixels.length / 4) };
}

/** The share of pixels that are not white. */
export function coverage({ pixels }) {
    let n = 0;
    for (let i = 0; i < pixels.length; i += 4) {
        if (Math.min(pixels[i], pixels[i + 1], pixels[i + 2]) < 250) n++;
    }
    return n / (pixels.length / 4);
}

/** Asserts that two pictures differ by at most `bound`, and logs how much they differ. */
export function assertSimilar(a, b, bound, name) {
    const found = difference(a, b);
    const text = `${name}: mean ${found.mean.toFixed(4)}, share ${found.share.toFixed(5)}`;
    console.log(text);
    assert.ok(found.mean <= bound.mean && found.share <= bound.share, text);
}

/**
 * The page compared with native pictures. Positions in the page are rounded by at most half a step of 1/40 voxel, a tenth of a
 * pixel here, so an outline may cross one more of the four samples of a pixel; elsewhere drivers differ by a step or two.
 * Outlines of the torus and its caps cover some 1,500 of the 307,200 pixels: no more pixels may be different.
 */
export const TO_NATIVE = { mean: 0.2, share: 0.005 };

/** The canvas on the screen compared with the pixels that were read back. */
export const TO_SCREEN = { mean: 0, share: 0 };
