// Decodes the trajectories of vertices. FORMAT.md, sections VERT and POSN, in the units of src/page/data.rs; the twin of
// src/file/trajectories.rs, src/file/geometry.rs and src/file/predict.rs. Integers there are exact numbers here, below 2^53.

/** Steps that a coordinate along the surface counts, and what stands for an axis where a vertex faces none. */
const [COARSE, NO_AXIS] = [4, 3];

/**
 * Decodes section VERT: first knots, ranks, whether each vertex is a lattice vertex, and how many have knots and are lattice vertices. First
 * ranks are stored as differences, unless `firstsOf` reads them from the columns.
 */
function ranksOf(section, firstsOf) {
    const columns = new CodedColumns(section);
    const n = columns.count();
    const counts = columns.column(n);
    const firstKnot = new Uint32Array(n + 1);
    const isLattice = new Uint8Array(n);
    let [nMoving, nPairs, nLattice] = [0, 0, 0];
    for (let v = 0; v < n; v++) {
        firstKnot[v + 1] = firstKnot[v] + counts[v];
        if (counts[v] > 0) nMoving++;
        if (counts[v] === 2) nPairs++;
    }
    const flag = reader(columns.column(nPairs));
    for (let v = 0; v < n; v++) if (counts[v] === 2) nLattice += isLattice[v] = flag();
    const step = reader(columns.signedColumn(firstsOf ? 0 : nMoving));
    const firstRank = firstsOf?.(columns, nMoving);
    // The intervals of lattice vertices are stored first.
    const onLattice = intervalReader(columns, nLattice);
    const nextRanks = [intervalReader(columns, firstKnot[n] - nMoving - nLattice), onLattice];
    const ranks = new Uint32Array(firstKnot[n]);
    let previous = 0;
    for (let v = 0; v < n; v++) {
        const nextRank = nextRanks[isLattice[v]];
        for (let i = firstKnot[v]; i < firstKnot[v + 1]; i++) {
            if (i > firstKnot[v]) ranks[i] = nextRank(ranks[i - 1]);
            else ranks[i] = firstRank ? firstRank() : (previous += step());
        }
    }
    return { firstKnot, ranks, isLattice, nMoving, nLattice };
}

/** The last knot of a vertex that is not above a rank; its first knot if all are above. */
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
 * For each vertex from number `nAbove` on, the lower-numbered vertices of the triangles born with it, or of all triangles if there is a
 * pivot, in the order of the triangles, with repetitions.
 */
function lowerNeighbours({ firstKnot, ranks }, { vertices, births }, nAbove, pivot) {
    const n = firstKnot.length - 1;
    const first = new Uint32Array(n + 1);
    const eachOf = (visit) => {
        for (let t = 0; t < births.length; t++) {
            const a = vertices[3 * t];
            const b = vertices[3 * t + 1];
            const c = vertices[3 * t + 2];
            const v = Math.max(a, b, c);
            if (v < nAbove || (pivot < 0 && ranks[firstKnot[v]] !== births[t])) continue;
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

/** The positions decoded so far, and how the neighbours of a vertex move through them. */
class DecodedKnots {
    constructor({ firstKnot, ranks }, isovalues, positions) {
        Object.assign(this, { firstKnot, ranks, isovalues });
        this.positions = positions ?? new Int32Array(3 * ranks.length);
        this.resize(64);
    }

    /** Makes room for n neighbours. */
    resize(n) {
        /** The last position of each neighbour. */
        this.places = new Float64Array(3 * n);
        /** The last knot of each neighbour not above its last rank. */
        this.knots = new Uint32Array(n);
    }

    /** Sets the position of a knot. */
    set(knot, x, y, z) {
        const { positions } = this;
        positions[3 * knot] = x;
        positions[3 * knot + 1] = y;
        positions[3 * knot + 2] = z;
    }

    /** Adds the position of a knot to a sum. */
    add(knot, sum) {
        const { positions } = this;
        sum[0] += positions[3 * knot];
        sum[1] += positions[3 * knot + 1];
        sum[2] += positions[3 * knot + 2];
    }

    /**
     * Moves neighbour i, vertex u, from a knot to a rank and adds its position there to a sum. If it `continues`, the sum gets
     * the displacement since its last position instead.
     */
    move(i, u, knot, rank, continues, sum) {
        const { ranks, isovalues, positions, places } = this;
        const last = this.firstKnot[u + 1] - 1;
        while (knot < last && ranks[knot + 1] <= rank) knot++;
        while (ranks[knot] > rank && knot > this.firstKnot[u]) knot--;
        this.knots[i] = knot;
        const at = 3 * i;
        const p = 3 * knot;
        // Written out: loops over three numbers take twice as long.
        let x = positions[p];
        let y = positions[p + 1];
        let z = positions[p + 2];
        if (knot < last && ranks[knot] < rank) {
            const low = 0.5 * isovalues[ranks[knot]];
            const high = 0.5 * isovalues[ranks[knot + 1]];
            // NaN becomes 0: isovalues can be so small that halving makes them equal.
            const t = Math.trunc(65536 * ((0.5 * isovalues[rank] - low) / (high - low))) || 0;
            x = interpolated(x, positions[p + 3], t);
            y = interpolated(y, positions[p + 4], t);
            z = interpolated(z, positions[p + 5], t);
        }
        if (continues) {
            sum[0] -= places[at];
            sum[1] -= places[at + 1];
            sum[2] -= places[at + 2];
        }
        sum[0] += places[at] = x;
        sum[1] += places[at + 1] = y;
        sum[2] += places[at + 2] = z;
    }
}

/** The rounded position at t / 65536 of the way between two integers. */
function interpolated(a, b, t) {
    // Multiplying by the inverse of a power of two is exact.
    return a + Math.floor((t * (b - a) + 32768) * (1 / 65536));
}

/**
 * Decodes positions, in steps, from predictions and residuals; residuals along the surface count COARSE steps. In a chunk the positions
 * of the first vertices, `nAbove`, are in `positions` already, which gets the others; `last` is the last of them with knots.
 */
function positionsOf(residuals, samples, trajectories, isovalues, triangles,
    { nAbove, pivot, last, positions } = { nAbove: 0, pivot: NONE, last: NONE }) {
    const { firstKnot, ranks, isLattice } = trajectories;
    const { first, neighbours } = lowerNeighbours(trajectories, triangles, nAbove, pivot);
    const decoded = new DecodedKnots(trajectories, isovalues, positions);
    const sum = new Float64Array(3);

    /** Divides the sum of so many vectors. */
    const toMean = (count) => {
        if (count > 1) for (let j = 0; j < 3; j++) sum[j] = Math.floor(sum[j] / count);
    };
    /** Predicts the first knot of a vertex: the mean of its neighbours, or the first knot of the vertex before. */
    const predictFirst = (v, rank) => {
        const count = first[v + 1] - first[v];
        sum.fill(0);
        if (count > decoded.knots.length) decoded.resize(2 * count);
        for (let i = 0; i < count; i++) {
            const u = neighbours[first[v] + i];
            decoded.move(i, u, knotAt(firstKnot, ranks, u, rank), rank, false, sum);
        }
        if (count === 0 && last >= 0) decoded.add(firstKnot[last], sum);
        toMean(count);
        last = v;
    };
    /** Sets another knot of a vertex, after the knot `before`. Predicted to move as its neighbours do on average. */
    const setNext = (v, knot, before) => {
        const rank = ranks[knot];
        let count = 0;
        sum.fill(0);
        for (let at = first[v], i = 0; at < first[v + 1]; at++, i++) {
            const u = neighbours[at];
            if (before < knot ? ranks[firstKnot[u + 1] - 1] < rank : ranks[firstKnot[u]] > rank) continue;
            decoded.move(i, u, decoded.knots[i], rank, true, sum);
            count++;
        }
        toMean(count);
        decoded.add(before, sum);
        setKnot(knot, FURTHER);
    };
    /** The sample of a lattice vertex. */
    const at = new Float64Array(3);
    /** Sets the knots of a lattice vertex, which are at neighbouring samples. */
    const setLatticeKnots = (first) => {
        for (let a = 0; a < 3; a++) at[a] = samples.nearest(a, clampedToInt32(sum[a])) + residuals.starts[a]();
        const direction = residuals.direction();
        for (const knot of [first, first + 1]) {
            decoded.set(knot, samples.place(0, at[0]), samples.place(1, at[1]), samples.place(2, at[2]));
            at[direction >> 1] += direction & 1 ? 1 : -1;
        }
    };
    let facing = 0;
    /** Sets a knot of another vertex. */
    const setKnot = (knot, kind) => {
        if (kind === FIRST) facing = residuals.facing();
        for (let k = 0; k < 3; k++) {
            const a = (facing + k) % 3;
            const unit = k === 0 || facing === NO_AXIS ? 1 : COARSE;
            sum[a] = unit * (Math.floor((clampedToInt32(sum[a]) + (unit >> 1)) / unit) + residuals.positions[kind][k]());
        }
        decoded.set(knot, sum[0], sum[1], sum[2]);
    };
    for (let v = nAbove; v + 1 < firstKnot.length; v++) {
        const [low, end] = [firstKnot[v], firstKnot[v + 1]];
        if (low === end) continue;
        // All of the mesh at a pivot exists there.
        const start = isLattice[v] ? low : knotAt(firstKnot, ranks, v, pivot);
        predictFirst(v, ranks[start]);
        if (isLattice[v]) setLatticeKnots(low);
        else {
            setKnot(start, FIRST);
            for (let knot = start + 1; knot < end; knot++) setNext(v, knot, knot - 1);
            // Moves the neighbours back.
            if (start > low) predictFirst(v, ranks[start]);
            for (let knot = start - 1; knot >= low; knot--) setNext(v, knot, knot + 1);
        }
    }
    return decoded.positions;
}

/** Clamps to the range of signed 32-bit integers. */
function clampedToInt32(x) {
    return x < -2147483648 ? -2147483648 : x > 2147483647 ? 2147483647 : x;
}
