// When, where and which way the vertices are. FORMAT.md, sections VERT, POSN and NRML, with coarser
// normals; the twin of src/file/trajectories.rs and src/file/predict.rs. What is a whole number there is one here: all
// of them are below 2^53.

/** First knots and ranks from section VERT. */
function ranksOf(section) {
    const columns = new Columns(section);
    const n = columns.count();
    const counts = columns.column(n);
    const firstKnot = new Uint32Array(n + 1);
    let nMoving = 0;
    for (let v = 0; v < n; v++) {
        firstKnot[v + 1] = firstKnot[v] + counts[v];
        if (counts[v] > 0) nMoving++;
    }
    const firsts = columns.signedColumn(nMoving);
    const steps = columns.column(firstKnot[n] - nMoving);
    const ranks = new Uint32Array(firstKnot[n]);
    let [nextFirst, nextStep, previous] = [0, 0, 0];
    for (let v = 0; v < n; v++) {
        for (let i = firstKnot[v]; i < firstKnot[v + 1]; i++) {
            if (i === firstKnot[v]) ranks[i] = previous += firsts[nextFirst++];
            else ranks[i] = ranks[i - 1] + 1 + steps[nextStep++];
        }
    }
    return { firstKnot, ranks };
}

/** The last knot of a vertex not above a rank; the first where all are above. */
function knotAt(firstKnot, ranks, v, rank) {
    let low = firstKnot[v];
    let high = firstKnot[v + 1];
    while (high - low > 1) {
        const middle = (low + high) >>> 1;
        if (ranks[middle] <= rank) low = middle;
        else high = middle;
    }
    return low;
}

/**
 * For each vertex, the lower-numbered vertices of the triangles born with it, in the order of the
 * triangles and as often as they occur.
 */
function lowerNeighbours({ firstKnot, ranks }, { vertices, births }) {
    const n = firstKnot.length - 1;
    const first = new Uint32Array(n + 1);
    const eachOf = (visit) => {
        for (let t = 0; t < births.length; t++) {
            const a = vertices[3 * t];
            const b = vertices[3 * t + 1];
            const c = vertices[3 * t + 2];
            const v = Math.max(a, b, c);
            if (ranks[firstKnot[v]] !== births[t]) continue;
            const least = Math.min(a, b, c);
            visit(v, least, a + b + c - v - least);
        }
    };
    eachOf((v) => { first[v + 1] += 2; });
    for (let v = 0; v < n; v++) first[v + 1] += first[v];
    const next = first.slice();
    const neighbours = new Uint32Array(first[n]);
    eachOf((v, a, b) => {
        neighbours[next[v]++] = a;
        neighbours[next[v]++] = b;
    });
    return { first, neighbours };
}

/** Numbers of a place: three of the position, three of the normal on the octahedron. */
const PLACE = 6;

/** Knots of which some are known: what predicts the next. */
class KnownKnots {
    constructor({ firstKnot, ranks }, isovalues, radius) {
        Object.assign(this, { firstKnot, ranks, isovalues, radius });
        this.positions = new Int32Array(3 * ranks.length);
        this.normals = new Int8Array(2 * ranks.length);
        this.next = new Float64Array(PLACE);
    }

    /** Writes the place of a knot. */
    read(knot, into) {
        const { positions, normals, radius } = this;
        into[0] = positions[3 * knot];
        into[1] = positions[3 * knot + 1];
        into[2] = positions[3 * knot + 2];
        const u = normals[2 * knot];
        const v = normals[2 * knot + 1];
        const z = radius - Math.abs(u) - Math.abs(v);
        into[3] = z >= 0 ? u : withSign(radius - Math.abs(v), u);
        into[4] = z >= 0 ? v : withSign(radius - Math.abs(u), v);
        into[5] = z;
    }

    /** Writes the place of a vertex, all of whose knots are known, at a rank. */
    readAt(v, rank, into) {
        const { ranks, isovalues, next } = this;
        const knot = knotAt(this.firstKnot, ranks, v, rank);
        this.read(knot, into);
        if (ranks[knot] >= rank || knot + 1 === this.firstKnot[v + 1]) return;
        this.read(knot + 1, next);
        const low = 0.5 * isovalues[ranks[knot]];
        const high = 0.5 * isovalues[ranks[knot + 1]];
        // Not a number where the isovalues are so small that halving makes them equal.
        const t = Math.trunc(65536 * ((0.5 * isovalues[rank] - low) / (high - low))) || 0;
        // A power of two: multiplying by its inverse is exact, too.
        for (let i = 0; i < PLACE; i++) {
            into[i] += Math.floor((t * (next[i] - into[i]) + 32768) * (1 / 65536));
        }
    }
}

/** Positions and normals from what their predictions miss: three columns and two. */
function placesOf(missed, trajectories, isovalues, triangles, radius) {
    const { firstKnot, ranks } = trajectories;
    const { first, neighbours } = lowerNeighbours(trajectories, triangles);
    const [missedX, missedY, missedZ, missedU, missedV] = missed;
    const known = new KnownKnots(trajectories, isovalues, radius);
    const { positions, normals } = known;
    const place = new Float64Array(PLACE);
    const sum = new Float64Array(PLACE);
    let last = -1;

    /** Expects the first knot of a vertex at the mean of its neighbours, else where the last was. */
    const expectFirst = (v, rank) => {
        const count = first[v + 1] - first[v];
        for (let i = first[v]; i < first[v + 1]; i++) {
            known.readAt(neighbours[i], rank, place);
            for (let j = 0; j < PLACE; j++) sum[j] += place[j];
        }
        if (count === 0 && last >= 0) known.read(firstKnot[last], sum);
        for (let j = 0; j < PLACE; j++) sum[j] = Math.floor(sum[j] / Math.max(count, 1));
        last = v;
    };
    /** Expects a further knot where the vertex gets when it moves as its neighbours do. */
    const expectNext = (v, knot, rank) => {
        let count = 0;
        for (let i = first[v]; i < first[v + 1]; i++) {
            const u = neighbours[i];
            if (ranks[firstKnot[u + 1] - 1] < rank) continue;
            known.readAt(u, rank, place);
            for (let j = 0; j < PLACE; j++) sum[j] += place[j];
            known.readAt(u, ranks[knot - 1], place);
            for (let j = 0; j < PLACE; j++) sum[j] -= place[j];
            count++;
        }
        known.read(knot - 1, place);
        for (let j = 0; j < PLACE; j++) sum[j] = place[j] + Math.floor(sum[j] / Math.max(count, 1));
    };
    const flat = new Int32Array(2);
    for (let v = 0; v + 1 < firstKnot.length; v++) {
        for (let knot = firstKnot[v]; knot < firstKnot[v + 1]; knot++) {
            for (let j = 0; j < PLACE; j++) sum[j] = 0;
            if (knot === firstKnot[v]) expectFirst(v, ranks[knot]);
            else expectNext(v, knot, ranks[knot]);
            positions[3 * knot] = limited(sum[0]) + missedX[knot];
            positions[3 * knot + 1] = limited(sum[1]) + missedY[knot];
            positions[3 * knot + 2] = limited(sum[2]) + missedZ[knot];
            flatten(sum[3], sum[4], sum[5], radius, flat);
            normals[2 * knot] = around(flat[0] + missedU[knot], radius);
            normals[2 * knot + 1] = around(flat[1] + missedV[knot], radius);
        }
    }
    return { positions, normals };
}

/** What 32-bit signed numbers hold. */
function limited(x) {
    return x < -2147483648 ? -2147483648 : x > 2147483647 ? 2147483647 : x;
}

/** Writes the code of the direction of a point near the octahedron. */
function flatten(x, y, z, radius, into) {
    const length = Math.abs(x) + Math.abs(y) + Math.abs(z) || 1;
    const u = Math.floor((2 * radius * x + length) / (2 * length));
    const v = Math.floor((2 * radius * y + length) / (2 * length));
    into[0] = z < 0 ? withSign(radius - Math.abs(v), u) : u;
    into[1] = z < 0 ? withSign(radius - Math.abs(u), v) : v;
}

/** A size with a sign; zero counts as positive. */
function withSign(size, sign) {
    return sign < 0 ? -size : size;
}

/** A component of a normal modulo 2 radius + 1, from -radius to radius. */
function around(x, radius) {
    return x > radius ? x - 2 * radius - 1 : x < -radius ? x + 2 * radius + 1 : x;
}
