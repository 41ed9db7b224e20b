// Normals of a mesh: at each vertex the area-weighted mean of the normals of its triangles; caps count only at vertices that have
// nothing but caps. The twin of src/spectrum/normals.rs; codes are those of src/spectrum/normal.rs.

/** The largest component of the code of a normal. */
const NORMAL_ONE = 32767;

/** A vector has no direction if its squared length is below this, the least normal number of single precision. */
const MIN_SQUARED_LENGTH = 2 ** -126;

/**
 * Adds the normal of each triangle, of a length of twice its area, to the sums of its corners (3 numbers per vertex); caps have
 * separate sums. True if there are caps.
 */
function addAreas({ nTriangles, triangles, corners, positions: p }, caps, sums, capSums) {
    let hasCaps = false;
    for (let t = 0; t < nTriangles; t++) {
        const isCap = caps[triangles[t]] !== 0;
        if (isCap) hasCaps = true;
        const to = isCap ? capSums : sums;
        const a = 3 * corners[3 * t];
        const b = 3 * corners[3 * t + 1];
        const c = 3 * corners[3 * t + 2];
        const ux = p[b] - p[a];
        const uy = p[b + 1] - p[a + 1];
        const uz = p[b + 2] - p[a + 2];
        const vx = p[c] - p[a];
        const vy = p[c + 1] - p[a + 1];
        const vz = p[c + 2] - p[a + 2];
        const x = uy * vz - uz * vy;
        const y = uz * vx - ux * vz;
        const z = ux * vy - uy * vx;
        // Written out for speed: it runs for every triangle of every picture of a sweep.
        to[a] += x;
        to[a + 1] += y;
        to[a + 2] += z;
        to[b] += x;
        to[b + 1] += y;
        to[b + 2] += z;
        to[c] += x;
        to[c + 1] += y;
        to[c + 2] += z;
    }
    return hasCaps;
}

/** Replaces sums without a direction by the sums of caps, or by a fixed direction. */
function fillDirections(n, sums, capSums) {
    for (let at = 0; at < 3 * n; at += 3) {
        if (hasDirection(sums, at)) continue;
        const isCapped = capSums !== null && hasDirection(capSums, at);
        // A vertex of triangles without area is not visible.
        sums[at] = isCapped ? capSums[at] : 0;
        sums[at + 1] = isCapped ? capSums[at + 1] : 0;
        sums[at + 2] = isCapped ? capSums[at + 2] : 1;
    }
}

function hasDirection(vectors, at) {
    const x = vectors[at];
    const y = vectors[at + 1];
    const z = vectors[at + 2];
    return x * x + y * y + z * z >= MIN_SQUARED_LENGTH;
}

/** Normalizes n directions (3 numbers each) into `units`. */
function unitsOf(n, directions, units) {
    for (let at = 0; at < 3 * n; at += 3) {
        const x = directions[at];
        const y = directions[at + 1];
        const z = directions[at + 2];
        const scale = 1 / Math.sqrt(x * x + y * y + z * z);
        units[at] = scale * x;
        units[at + 1] = scale * y;
        units[at + 2] = scale * z;
    }
}

/** Encodes n directions into `codes`: octahedral, two signed 16-bit numbers in one of 32 bits. */
function codesOf(n, directions, codes) {
    for (let v = 0, at = 0; v < n; v++, at += 3) {
        const z = directions[at + 2];
        const scale = 1 / (Math.abs(directions[at]) + Math.abs(directions[at + 1]) + Math.abs(z));
        let x = scale * directions[at];
        let y = scale * directions[at + 1];
        if (z < 0) {
            // The lower hemisphere is folded outwards.
            const folded = withSign(1 - Math.abs(y), x);
            y = withSign(1 - Math.abs(x), y);
            x = folded;
        }
        codes[v] = (Math.round(NORMAL_ONE * x) & 0xffff) | (Math.round(NORMAL_ONE * y) << 16);
    }
}

/** A magnitude with the sign of a number; zero counts as positive. */
function withSign(size, sign) {
    return sign < 0 ? -size : size;
}
