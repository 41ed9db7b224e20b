// Decodes the trajectories of vertices. FORMAT.md, sections VERT and POSN, in the units of src/page/data.rs; the twin of
// src/file/trajectories.rs, src/file/geometry.rs and src/file/predict.rs. Integers there are exact numbers here, below 2^53.

/** Decodes section VERT: first knots, ranks, and whether each vertex is a lattice vertex. */
function ranksOf(section) {
    const columns = new CodedColumns(section);
    const n = columns.count();
    const counts = columns.column(n);
    const firstKnot = new Uint32Array(n + 1);
    const [pairs, isLattice] = [[], new Uint8Array(n)];
    let nMoving = 0;
    for (let v = 0; v < n; v++) {
        firstKnot[v + 1] = firstKnot[v] + counts[v];
        if (counts[v] > 0) nMoving++;
        if (counts[v] === 2) pairs.push(v);
    }
    const flags = columns.column(pairs.length);
    pairs.forEach((v, i) => { isLattice[v] = flags[i]; });
    const nLattice = flags.reduce((sum, flag) => sum + flag, 0);
    const firsts = columns.signedColumn(nMoving);
    // The intervals of lattice vertices are stored first.
    const onLattice = intervalReader(columns, nLattice);
    const nextRanks = [intervalReader(columns, firstKnot[n] - nMoving - nLattice), onLattice];
    const ranks = new Uint32Array(firstKnot[n]);
    let [nextFirst, previous] = [0, 0];
    for (let v = 0; v < n; v++) {
        const nextRank = nextRanks[isLattice[v]];
        for (let i = firstKnot[v]; i < firstKnot[v + 1]; i++) {
            if (i === firstKnot[v]) ranks[i] = previous += firsts[nextFirst++];
            else ranks[i] = nextRank(ranks[i - 1]);
        }
    }
    return { firstKnot, ranks, isLattice };
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

/** For each vertex, the lower-numbered vertices of the triangles born with it, in the order of the triangles, with repetitions. */
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

/** The positions decoded so far, and how the neighbours of a vertex move through them. */
class DecodedKnots {
    constructor({ firstKnot, ranks }, isovalues) {
        Object.assign(this, { firstKnot, ranks, isovalues });
        this.positions = new Int32Array(3 * ranks.length);
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

/** Decodes positions, in steps, from predictions and residuals; residuals along the surface count `along` steps. */
function positionsOf(residuals, samples, trajectories, isovalues, triangles, along) {
    const { firstKnot, ranks } = trajectories;
    const { first, neighbours } = lowerNeighbours(trajectories, triangles);
    const decoded = new DecodedKnots(trajectories, isovalues);
    const sum = new Float64Array(3);
    let last = -1;
    const next = [0, 0];

    /** Predicts the first knot of a vertex: the mean of its neighbours, or the first knot of the vertex before. */
    const predictFirst = (v, rank) => {
        const count = first[v + 1] - first[v];
        if (count > decoded.knots.length) decoded.resize(2 * count);
        for (let i = 0; i < count; i++) {
            const u = neighbours[first[v] + i];
            decoded.move(i, u, knotAt(firstKnot, ranks, u, rank), rank, false, sum);
        }
        if (count === 0 && last >= 0) decoded.add(firstKnot[last], sum);
        if (count > 1) for (let j = 0; j < 3; j++) sum[j] = Math.floor(sum[j] / count);
        last = v;
    };
    /** Predicts another knot of a vertex: it moves as its neighbours do on average. */
    const predictNext = (v, knot, rank) => {
        let count = 0;
        for (let at = first[v], i = 0; at < first[v + 1]; at++, i++) {
            const u = neighbours[at];
            if (ranks[firstKnot[u + 1] - 1] < rank) continue;
            decoded.move(i, u, decoded.knots[i], rank, true, sum);
            count++;
        }
        if (count > 1) for (let j = 0; j < 3; j++) sum[j] = Math.floor(sum[j] / count);
        decoded.add(knot - 1, sum);
    };
    /** The sample of a lattice vertex. */
    const at = new Float64Array(3);
    let nLattice = 0;
    /** Sets knot i of a lattice vertex, which is at a sample. */
    const setLatticeKnot = (knot, i) => {
        if (i > 0) {
            const direction = residuals.directions[nLattice++];
            at[direction >> 1] += direction & 1 ? 1 : -1;
        } else {
            for (let a = 0; a < 3; a++) {
                at[a] = samples.nearest(a, clampedToInt32(sum[a])) + residuals.starts[a][nLattice];
            }
        }
        decoded.set(knot, samples.place(0, at[0]), samples.place(1, at[1]), samples.place(2, at[2]));
    };
    let nOthers = 0;
    /** Sets knot i of another vertex. */
    const setKnot = (knot, i) => {
        const kind = i === 0 ? FIRST : FURTHER;
        if (i === 0) nOthers++;
        const facing = residuals.facing[nOthers - 1];
        const n = next[kind]++;
        const columns = residuals.positions[kind];
        for (let k = 0; k < 3; k++) {
            const a = (facing + k) % 3;
            const unit = k === 0 ? 1 : along;
            sum[a] = unit * (Math.floor((clampedToInt32(sum[a]) + (unit >> 1)) / unit) + columns[k][n]);
        }
        decoded.set(knot, sum[0], sum[1], sum[2]);
    };
    for (let v = 0; v + 1 < firstKnot.length; v++) {
        for (let knot = firstKnot[v]; knot < firstKnot[v + 1]; knot++) {
            sum.fill(0);
            const i = knot - firstKnot[v];
            if (i === 0) predictFirst(v, ranks[knot]);
            else predictNext(v, knot, ranks[knot]);
            if (residuals.isLattice[v]) setLatticeKnot(knot, i);
            else setKnot(knot, i);
        }
    }
    return decoded.positions;
}

/** Clamps to the range of signed 32-bit integers. */
function clampedToInt32(x) {
    return x < -2147483648 ? -2147483648 : x > 2147483647 ? 2147483647 : x;
}
