// Decodes the chunks of a spectrum file, each among the triangles of the chunks above it. FORMAT.md, "Chunks", and the parts on known
// triangles and pivots in section TRIA; the twin of src/file/living.rs, src/file/triangles.rs, src/file/path.rs and src/file/decode.rs.

/** The kind of death flags of triangles that a known triangle may replace, and the number of kinds. */
const REPLACED = 4;
const FLAG_KINDS = 5;

/** Directions from a pivot: triangles end at their death upwards, and at their birth downwards. */
const [UPWARDS, DOWNWARDS] = [0, 1];

/** The living triangles of a chunk, and those of the chunks above it, which are known: they take no numbers. */
class Living extends Holes {
    /** No living triangles; `known` has those of the chunks above that are alive in the span of the chunk. */
    constructor(columns, path, nAbove, known, nRanks) {
        const nKnown = known.births.length;
        const { n } = columns;
        super(columns, path, nAbove, n + nKnown);
        this.known = known;
        // The known triangles by the ranks at which they are born and die.
        [this.born, this.died] = [known.births, known.deaths].map((ranks) => {
            const byRank = new ByRank(nRanks, nKnown);
            ranks.forEach((rank, i) => byRank.push(rank, i));
            return byRank;
        });
        // By known triangle, its number here; and by triangle here, its number in the chunk, or NONE if it is known.
        this.places = new Int32Array(nKnown).fill(NONE);
        this.owners = new Int32Array(n + nKnown).fill(NONE);
        this.own = new Uint32Array(n);
        this.nAll = 0;
    }

    /** The mesh at the same rank without gates, for ranks downwards from there: births and deaths of known triangles are exchanged. */
    downwards() {
        this.clearGates();
        const { twins, outgoing, flagRank, newestGate, gates, popped } = this;
        const copies = Object.entries({ twins, outgoing, flagRank, newestGate, gates, popped }).map(([name, array]) => [name, array.slice()]);
        return Object.assign(Object.create(Living.prototype), this, Object.fromEntries(copies), { born: this.died, died: this.born });
    }

    /** Adds the known triangles that are alive at a rank. */
    addKnownAt(rank) {
        const { births, deaths } = this.known;
        for (let i = 0; i < births.length; i++) if (births[i] <= rank && rank < deaths[i]) this.addKnown(i);
    }

    addKnown(i) {
        this.places[i] = this.nAll;
        copyTriangle(this.known.vertices, i, this.vertices, this.nAll);
        this.addSeed(this.nAll++);
    }

    /** Adds the next n triangles of the chunk, from number t on. */
    addOwn(t, n) {
        for (let i = 0; i < n; i++) {
            this.own[t + i] = this.nAll + i;
            this.owners[this.nAll + i] = t + i;
        }
        this.nAll += n;
        this.read(this.nAll - n, this.nAll);
    }

    /** The death flag of a triangle of the chunk; all known triangles that die at the rank are dead. */
    dies(t, isNearEnd) {
        return this.owners[t] !== NONE && super.dies(t, isNearEnd);
    }

    /** Kills the known triangles that die at a rank, and triangles that known ones replace which are born there. */
    killKnown(rank, dying) {
        for (const i of this.died.at(rank)) if (this.places[i] !== NONE) this.kill(this.places[i], dying);
        const { vertices } = this.known;
        for (const i of this.born.at(rank)) {
            const t = this.atEdge(vertices[3 * i], vertices[3 * i + 1]);
            if (t === NONE || this.flagRank[t] === DEAD || this.flagRank[t] === rank) continue;
            this.flagRank[t] = rank;
            if (this.owners[t] !== NONE && this.flags[REPLACED]() === 1) this.kill(t, dying);
        }
    }

    /** The triangle with a half-edge, if it is near the outgoing half-edge of its start; else NONE. */
    atEdge(from, to) {
        const { twins, vertices } = this;
        const isFound = (h) => vertices[nextOf(h)] === to;
        let h = this.outgoing[from];
        for (let n = 0; h !== NONE && n < MAX_SEARCH; n++) {
            if (isFound(h)) return Math.floor(h / 3);
            h = twins[previousOf(h)];
        }
        h = this.outgoing[from];
        for (let n = 0; h !== NONE && n < MAX_SEARCH; n++) {
            if (isFound(h)) return Math.floor(h / 3);
            h = twins[h] === NONE ? NONE : nextOf(twins[h]);
        }
        return NONE;
    }

    /** Notes in `ends` the triangles of the chunk that end at a rank, and opens gates around the holes that all leave if there are births. */
    end(rank, ended, explicit, ends, hasBirths) {
        const { own, owners } = this;
        // At most ranks of one chunk nothing ends.
        if ([ended, explicit, this.born, this.died].every(({ newest }) => newest[rank] === NONE)) {
            if (hasBirths) this.clearGates();
            return;
        }
        const dying = this.dying(rank, ended.at(rank), Array.from(explicit.at(rank), (t) => own[t]));
        for (const t of dying) if (owners[t] !== NONE) ends[owners[t]] = rank;
        if (hasBirths) this.openGates(dying);
        else this.cut(dying);
    }

    /** Cuts dying triangles off as openGates does, without gates: no triangle is added after them. */
    cut(dying) {
        const { twins, vertices, flagRank, outgoing } = this;
        for (const t of dying) {
            for (let h = 3 * t; h < 3 * t + 3; h++) {
                const twin = twins[h];
                if (outgoing[vertices[h]] === h) outgoing[vertices[h]] = NONE;
                if (twin < 0 || flagRank[Math.floor(twin / 3)] === DEAD) continue;
                twins[twin] = NONE;
                outgoing[vertices[nextOf(h)]] = twin;
                outgoing[vertices[h]] = nextOf(twin);
            }
        }
    }
}

/** Decodes section TRIA of a chunk; `path` has the vertices up to the chunk, `nAbove` of them in chunks above. */
function trianglesOfChunk(section, { span: [start, end], pivot }, path, nAbove, known, nRanks) {
    const columns = triangleColumnsOf(section, nAbove > 0 ? FLAG_KINDS : FLAG_KINDS - 1, pivot < 0 ? 1 : 2);
    const { n, caps, listEnd } = columns;
    const [deaths, births] = [new Uint32Array(n), new Uint32Array(n)];
    const living = new Living(columns, path, nAbove, known, nRanks);
    if (pivot < 0) {
        const ended = verticesByEnd(path, nRanks, 1);
        const explicit = new ByRank(nRanks, n);
        if (start > 0) living.addKnownAt(start - 1);
        for (let rank = start, t = 0; rank < end; rank++) {
            living.end(rank, ended, explicit, deaths, true);
            for (const i of living.born.at(rank)) living.addKnown(i);
            const nBorn = columns.births[rank - start];
            living.addOwn(t, nBorn);
            for (const last = t + nBorn; t < last; t++) {
                births[t] = rank;
                listEnd[UPWARDS](t, rank, explicit);
            }
        }
    } else {
        living.addKnownAt(pivot);
        living.addOwn(0, n);
        const down = living.downwards();
        for (const direction of [UPWARDS, DOWNWARDS]) {
            const ended = verticesByEnd(path, nRanks, 1 - direction);
            const explicit = new ByRank(nRanks, n);
            const inOrder = { push: (rank, t) => explicit.push(direction === UPWARDS ? rank : nRanks - rank, t) };
            const from = direction === UPWARDS ? pivot : nRanks - 1 - pivot;
            for (let t = 0; t < n; t++) listEnd[direction](t, from, inOrder);
            if (direction === UPWARDS) for (let rank = pivot + 1; rank < end; rank++) living.end(rank, ended, explicit, deaths, false);
            else for (let rank = pivot; rank >= start; rank--) down.end(rank, ended, explicit, births, false);
        }
    }
    const vertices = new Uint32Array(3 * n);
    for (let t = 0; t < n; t++) copyTriangle(living.vertices, living.own[t], vertices, t);
    return { vertices, births, deaths, caps };
}

/** The stored bytes of the sections of a chunk. */
function sectionsOfChunk(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const sections = [];
    for (let at = 0; at < bytes.length; at = sections.at(-1).end) {
        const end = at + SECTION_HEADER + Number(view.getBigUint64(at + 8, true));
        sections.push({ end, stored: bytes.subarray(at + SECTION_HEADER, end) });
    }
    return sections.map(({ stored }) => stored);
}

/**
 * Decodes a chunk; `above` has the decoded chunks from the root to its parent. Its vertices have numbers of their own, triangles those of
 * the path.
 */
function decodedChunk(bytes, chunk, above, { isovalues, samples }) {
    const [rankSection, triangleSection, positionSection] = sectionsOfChunk(bytes);
    const nRanks = isovalues.length;
    const own = ranksOf(rankSection, chunk.pivot < 0 ? undefined : (columns, n) => {
        // Intervals down from the pivot, of ranks that are counted from the last one.
        const next = intervalReader(columns, n);
        return () => nRanks - next(nRanks - 1 - chunk.pivot);
    });
    const { firstKnot, ranks, isLattice } = own;
    const decoded = { number: chunk.number, firstKnot, ranks, isLattice, above };
    // With triangles of the chunks above only, and room for the positions of the chunk.
    const path = joined([...above, decoded]);
    const nAbove = path.firstKnot.length - firstKnot.length;
    const triangles = trianglesOfChunk(triangleSection, chunk, path, nAbove, aliveIn(path, chunk.span), nRanks);
    const residuals = residualsOf(positionSection, own);
    let last = nAbove - 1;
    while (last >= 0 && path.firstKnot[last] === path.firstKnot[last + 1]) last--;
    const place = { nAbove, pivot: chunk.pivot, last, positions: path.positions };
    const positions = positionsOf(residuals, samples, path, isovalues, triangles, place);
    return Object.assign(decoded, triangles, { positions: positions.slice(-3 * ranks.length || positions.length) });
}

/** The triangles that are alive somewhere in a span or right before it. */
function aliveIn({ vertices, births, deaths }, [start, end]) {
    const isKept = (t) => births[t] < end && deaths[t] >= start;
    let n = 0;
    for (let t = 0; t < births.length; t++) if (isKept(t)) n++;
    const alive = { vertices: new Uint32Array(3 * n), births: new Uint32Array(n), deaths: new Uint32Array(n) };
    for (let t = 0, i = 0; i < n; t++) {
        if (!isKept(t)) continue;
        copyTriangle(vertices, t, alive.vertices, i);
        alive.births[i] = births[t];
        alive.deaths[i++] = deaths[t];
    }
    return alive;
}

/** Copies the vertices of triangle t of a list to triangle i of another. */
function copyTriangle(from, t, to, i) {
    for (let k = 0; k < 3; k++) to[3 * i + k] = from[3 * t + k];
}

/** The columns of decoded chunks, with the type of each and the numbers per vertex (0), knot (1) or triangle (2). */
const JOINED = {
    isLattice: [Uint8Array, 0, 1], ranks: [Uint32Array, 1, 1], positions: [Int32Array, 1, 3],
    vertices: [Uint32Array, 2, 3], births: [Uint32Array, 2, 1], deaths: [Uint32Array, 2, 1], caps: [Uint8Array, 2, 1],
};

/** Joins decoded chunks, in pre-order and each with all chunks above it. The last one may have no positions and triangles yet. */
function joined(chunks) {
    const counts = chunks.map(({ isLattice, ranks, births }) => [isLattice.length, ranks.length, births?.length ?? 0]);
    const total = [0, 1, 2].map((i) => counts.reduce((sum, count) => sum + count[i], 0));
    const all = { firstKnot: new Uint32Array(total[0] + 1) };
    for (const [name, [Column, of, width]] of Object.entries(JOINED)) {
        all[name] = new Column(width * total[of]);
        let at = 0;
        chunks.forEach((chunk, i) => {
            if (chunk[name]) all[name].set(chunk[name], at);
            at += width * counts[i][of];
        });
    }
    // By chunk, the number of its first vertex.
    const starts = new Map();
    let [nVertices, nKnots, corner] = [0, 0, 0];
    all.shared = new Map();
    for (const chunk of chunks) {
        starts.set(chunk.number, nVertices);
        for (const [v, key] of chunk.shared ?? []) all.shared.set(nVertices + v, key);
        for (const first of chunk.firstKnot.subarray(1)) all.firstKnot[++nVertices] = nKnots + first;
        nKnots += chunk.ranks.length;
        renumber(all.vertices.subarray(corner, corner += chunk.vertices?.length ?? 0), [...chunk.above, chunk], starts);
    }
    return all;
}

/** Changes numbers of vertices on a path to those that begin at `starts`. */
function renumber(vertices, path, starts) {
    let n = 0;
    // The ends of the chunks on the path, and what is added to the numbers in each.
    const parts = path.map(({ number, isLattice }) => {
        const shift = starts.get(number) - n;
        return [n += isLattice.length, shift];
    });
    if (parts.every(([, shift]) => shift === 0)) return;
    for (let i = 0; i < vertices.length; i++) {
        let part = 0;
        while (vertices[i] >= parts[part][0]) part++;
        vertices[i] += parts[part][1];
    }
}

/** Section SEAM of a chunk. */
function seamOf(bytes) {
    return ["VERT", "TRIA", "POSN", "SEAM"].reduce((section, tag) => sectionIn(section.rest, tag), { rest: bytes });
}

/** The vertices of a chunk that other trees may contain, too, with their keys; the twin of src/file/seam.rs. */
function sharedOf(content) {
    const columns = new Columns(content);
    const n = columns.count();
    const [steps, keys] = [columns.column(n), columns.column64(n)];
    let [v, key] = [-1, 0n];
    return Array.from(steps, (step, i) => [v += step + 1, key = BigInt.asUintN(64, key + (keys[i] >> 1n ^ -(keys[i] & 1n)))]);
}

/**
 * Joins what was read of several trees, each with its `table` of isovalues. Vertices with equal keys are one, which lives as long as it does in all of
 * them. The twin of src/spectrum/joiner.rs.
 */
function joinedTrees(trees, isovalues) {
    const sum = (name) => trees.reduce((n, tree) => n + tree[name].length, 0);
    const all = { firstKnot: new Uint32Array(sum("isLattice") + 1) };
    for (const name of ["ranks", "positions", "vertices", "births", "deaths", "caps"]) all[name] = new JOINED[name][0](sum(name));
    const numberOf = new Map();
    let [n, nKnots, t] = [0, 0, 0];
    for (const { firstKnot, ranks, positions, vertices, births, deaths, caps, shared, table } of trees) {
        let rank = 0;
        const inWhole = Array.from(table, (c) => {
            while (isovalues[rank] < c) rank++;
            return rank;
        });
        const numbers = new Uint32Array(firstKnot.length - 1);
        for (let v = 0; v < numbers.length; v++) {
            const [from, end] = [firstKnot[v], firstKnot[v + 1]];
            const key = shared.get(v);
            const known = key === undefined ? undefined : numberOf.get(key);
            if (known !== undefined) {
                const knot = all.firstKnot[known];
                all.ranks[knot] = Math.min(all.ranks[knot], inWhole[ranks[from]]);
                all.ranks[knot + 1] = Math.max(all.ranks[knot + 1], inWhole[ranks[from + 1]]);
            } else {
                all.positions.set(positions.subarray(3 * from, 3 * end), 3 * nKnots);
                for (let knot = from; knot < end; knot++) all.ranks[nKnots++] = inWhole[ranks[knot]];
                if (key !== undefined) numberOf.set(key, n);
                all.firstKnot[n + 1] = nKnots;
            }
            numbers[v] = known ?? n++;
        }
        all.caps.set(caps, t);
        for (let i = 0; i < births.length; i++, t++) {
            for (let k = 0; k < 3; k++) all.vertices[3 * t + k] = numbers[vertices[3 * i + k]];
            all.births[t] = inWhole[births[i]];
            all.deaths[t] = inWhole[deaths[i]];
        }
    }
    return { ...all, firstKnot: all.firstKnot.slice(0, n + 1), ranks: all.ranks.slice(0, nKnots), positions: all.positions.slice(0, 3 * nKnots) };
}

/** The spectrum with its triangles sorted by birth, as drawing needs them. */
function sortedByBirth({ firstKnot, ranks, positions, vertices, births, deaths, caps }, nRanks) {
    const next = startsOf(births, nRanks);
    const sorted = { vertices: vertices.slice(), births: births.slice(), deaths: deaths.slice(), caps: caps.slice() };
    for (let t = 0; t < births.length; t++) {
        const to = next[births[t]]++;
        copyTriangle(vertices, t, sorted.vertices, to);
        sorted.births[to] = births[t];
        sorted.deaths[to] = deaths[t];
        sorted.caps[to] = caps[t];
    }
    return { firstKnot, ranks, positions, ...sorted };
}
