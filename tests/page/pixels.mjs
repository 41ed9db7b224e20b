// Pictures as numbers, and how far two of them differ.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";

/** Pixels count as different where a channel is off by more than this: a tenth of the way to white. */
export const FAR = 25;

/** The pixels of a PNG of 8-bit RGB or RGBA without interlace, always with alpha. */
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

/**
 * How far two pictures of one size differ: `mean`, of all channels of all pixels, in steps of 255;
 * `share` of pixels of which a channel differs by more than `limit`.
 */
export function difference(a, b, limit) {
    assert.deepEqual([a.width, a.height], [b.width, b.height], "size");
    let [sum, nFar] = [0, 0];
    for (let i = 0; i < a.pixels.length; i += 4) {
        let most = 0;
        for (let channel = 0; channel < 3; channel++) {
            const d = Math.abs(a.pixels[i + channel] - b.pixels[i + channel]);
            sum += d;
            most = Math.max(most, d);
        }
        if (most > limit) nFar++;
    }
    return { mean: sum / (0.75 * a.pixels.length), share: nFar / (a.pixels.length / 4) };
}

/** The share of pixels that are not white. */
export function coverage({ pixels }) {
    let n = 0;
    for (let i = 0; i < pixels.length; i += 4) {
        if (Math.min(pixels[i], pixels[i + 1], pixels[i + 2]) < 250) n++;
    }
    return n / (pixels.length / 4);
}
