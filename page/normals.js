// Normals of knots: those of the mesh there. The twin of src/spectrum/normals.rs.

/** How far inside its lifetime the ends of a trajectory are looked at, as a part of the way to the next knot. */
const INSIDE = 0.125;

/** Areas are counted in this part of a square voxel. */
const AREA_UNIT = 2 ** -24;

/** The largest component of the code of a normal. */
const NORMAL_ONE = 32767;

/** The triangles at each vertex: of vertex v those from first[v] to first[v + 1]. */
function trianglesAtOf(vertices, n) {
    const first = new Uint32Array(n + 1);
    for (let i = 0; i < vertices.length; i++) first[vertices[i] + 1]++;
    for (let v = 0; v < n; v++) first[v + 1] += first[v];
    const next = first.slice();
    const triangles = new Uint32Array(vertices.length);
    for (let i = 0; i < vertices.length; i++) triangles[next[vertices[i]]++] = Math.floor(i / 3);
    return { first, triangles };
}

/** Adds up the areas around vertices at isovalues. */
class AreaVectors {
    constructor(isovalues, { firstKnot, ranks }, { vertices, births, deaths, caps }, positions, step) {
        Object.assign(this, { isovalues, firstKnot, ranks, vertices, births, deaths, caps, positions, step });
        Object.assign(this, trianglesAtOf(vertices, firstKnot.length - 1));
        /** The vertex, and two corners of a triangle seen from it. */
        this.place = new Float64Array(9);
        this.sum = new Float64Array(3);
        this.capSum = new Float64Array(3);
    }

    /** Writes where a vertex is at an isovalue of its lifetime, steps. */
    placeAt(v, rank, isovalue, at) {
        const { ranks, isovalues, positions, place } = this;
        const knot = knotAt(this.firstKnot, ranks, v, rank);
        const p = 3 * knot;
        place[at] = positions[p];
        place[at + 1] = positions[p + 1];
        place[at + 2] = positions[p + 2];
        if (knot + 1 === this.firstKnot[v + 1]) return;
        const low = 0.5 * isovalues[ranks[knot]];
        const t = (0.5 * isovalue - low) / (0.5 * isovalues[ranks[knot + 1]] - low);
        if (!(Math.abs(t) < Infinity)) return;
        place[at] += t * (positions[p + 3] - place[at]);
        place[at + 1] += t * (positions[p + 4] - place[at + 1]);
        place[at + 2] += t * (positions[p + 5] - place[at + 2]);
    }

    /**
     * The sum of the triangles' normals around a vertex at an isovalue, each as long as twice its area;
     * that of the caps where there is nothing else. None of no area.
     */
    around(v, rank, isovalue) {
        const { vertices, births, deaths, sum, capSum } = this;
        sum.fill(0);
        capSum.fill(0);
        this.placeAt(v, rank, isovalue, 0);
        for (let i = this.first[v]; i < this.first[v + 1]; i++) {
            const t = this.triangles[i];
            if (births[t] > rank || deaths[t] <= rank) continue;
            const a = vertices[3 * t];
            const b = vertices[3 * t + 1];
            const c = vertices[3 * t + 2];
            this.placeAt(a === v ? b : b === v ? c : a, rank, isovalue, 3);
            this.placeAt(a === v ? c : b === v ? a : b, rank, isovalue, 6);
            this.add(this.caps[t] ? capSum : sum);
        }
        if (hasLength(sum)) return sum;
        return hasLength(capSum) ? capSum : null;
    }

    /** Adds the product of the two corners seen from the vertex. */
    add(sum) {
        const p = this.place;
        const unit = (this.step * this.step) / AREA_UNIT;
        // Pairs taken apart would be arrays: this is done millions of times.
        const ax = p[3] - p[0];
        const ay = p[4] - p[1];
        const az = p[5] - p[2];
        const bx = p[6] - p[0];
        const by = p[7] - p[1];
        const bz = p[8] - p[2];
        sum[0] += Math.round(unit * (ay * bz - az * by));
        sum[1] += Math.round(unit * (az * bx - ax * bz));
        sum[2] += Math.round(unit * (ax * by - ay * bx));
    }
}

/** Whether a vector is not zero. */
function hasLength(vector) {
    return vector[0] !== 0 || vector[1] !== 0 || vector[2] !== 0;
}

/** Writes the octahedral code of a direction: src/spectrum/normal.rs. */
function encodeNormal(direction, codes, at) {
    const z = direction[2];
    const length = Math.abs(direction[0]) + Math.abs(direction[1]) + Math.abs(z);
    const u = direction[0] / length;
    const v = direction[1] / length;
    codes[at] = Math.round(NORMAL_ONE * (z < 0 ? withSign(1 - Math.abs(v), u) : u));
    codes[at + 1] = Math.round(NORMAL_ONE * (z < 0 ? withSign(1 - Math.abs(u), v) : v));
}

/** A size with a sign; zero counts as positive. */
function withSign(size, sign) {
    return sign < 0 ? -size : size;
}

/** The unit vector of an octahedral code. */
function decodedNormal(u, v) {
    let [x, y] = [u / NORMAL_ONE, v / NORMAL_ONE];
    const z = 1 - Math.abs(x) - Math.abs(y);
    if (z < 0) [x, y] = [withSign(1 - Math.abs(y), x), withSign(1 - Math.abs(x), y)];
    const length = Math.hypot(x, y, z);
    return [x / length, y / length, z / length];
}

/** The codes of the normals at all knots, two numbers each (Int16Array). */
function normalsOf(isovalues, trajectories, triangles, positions, step) {
    const { firstKnot, ranks } = trajectories;
    const codes = new Int16Array(2 * ranks.length);
    const areas = new AreaVectors(isovalues, trajectories, triangles, positions, step);
    /** The isovalue a little inside from one knot to another. */
    const inside = (from, to) =>
        (1 - INSIDE) * isovalues[ranks[from]] + INSIDE * isovalues[ranks[to]];
    for (let v = 0; v + 1 < firstKnot.length; v++) {
        const first = firstKnot[v];
        const last = firstKnot[v + 1] - 1;
        // The knots before have none: they get that of the next one.
        let waiting = first;
        for (let knot = first; knot <= last; knot++) {
            const isEnd = first < last && (knot === first || knot === last);
            const isovalue = isEnd
                ? inside(knot, knot === first ? first + 1 : last - 1)
                : isovalues[ranks[knot]];
            const rank = isEnd ? rankAt(isovalues, isovalue) : ranks[knot];
            const area = areas.around(v, rank, isovalue);
            if (area) {
                encodeNormal(area, codes, 2 * knot);
                for (; waiting < knot; waiting++) codes.copyWithin(2 * waiting, 2 * knot, 2 * knot + 2);
                waiting = knot + 1;
            } else if (waiting === knot && knot > first) {
                codes.copyWithin(2 * knot, 2 * knot - 2, 2 * knot);
                waiting = knot + 1;
            }
        }
    }
    return codes;
}
