// The set of triangles that are alive at a rank, updated when the rank changes.
//
// Triangles are sorted by birth, and a second list is sorted by death, so the triangles that are born or die between two ranks are
// contiguous. A small move visits only those. A jump searches a tree with the last death of each block of triangles, block of
// blocks and so on.

const BLOCK = 32;

class ActiveSet {
    constructor(spectrum) {
        Object.assign(this, spectrum.orders ?? ordersOf(spectrum));
        this.births = spectrum.births;
        this.deaths = spectrum.deaths;
        this.rank = -1;
        // The active triangles in any order, and for each triangle its place in the list or -1.
        this.list = new Uint32Array(1024);
        this.length = 0;
        this.place = new Int32Array(this.births.length).fill(-1);
    }

    /** Moves to a rank, at which the triangles list[0..length) are alive; true if the set changed. */
    moveTo(rank) {
        const old = this.rank;
        if (rank === old) return false;
        this.rank = rank;
        const [low, high] = [Math.min(old, rank), Math.max(old, rank)];
        const isNew = old < 0;
        const [firstBorn, endBorn] = isNew ? [0, 0] : [this.bornBefore[low + 1], this.bornBefore[high + 1]];
        const [firstDead, endDead] = isNew ? [0, 0] : [this.diedBefore[low + 1], this.diedBefore[high + 1]];
        const nChanges = endBorn - firstBorn + endDead - firstDead;
        if (isNew || nChanges > this.length) {
            this.rebuild();
            return true;
        }
        for (let t = firstBorn; t < endBorn; t++) this.update(t);
        for (let i = firstDead; i < endDead; i++) this.update(this.byDeath[i]);
        return nChanges > 0;
    }

    /** Adds a triangle to the list or removes it from the list, as it is alive or not. */
    update(t) {
        const isAlive = this.births[t] <= this.rank && this.rank < this.deaths[t];
        const at = this.place[t];
        if (isAlive === (at >= 0)) return;
        if (isAlive) {
            this.push(t);
            return;
        }
        const last = this.list[--this.length];
        this.list[at] = last;
        this.place[last] = at;
        this.place[t] = -1;
    }

    push(t) {
        if (this.length === this.list.length) {
            const list = new Uint32Array(2 * this.length);
            list.set(this.list);
            this.list = list;
        }
        this.place[t] = this.length;
        this.list[this.length++] = t;
    }

    rebuild() {
        for (let i = 0; i < this.length; i++) this.place[this.list[i]] = -1;
        this.length = 0;
        const end = this.bornBefore[this.rank + 1];
        if (end > 0) this.collect(this.levels.length - 1, 0, end);
    }

    /** Pushes the living triangles below entry i of a level, of the first `end` triangles. */
    collect(level, i, end) {
        if (this.levels[level][i] <= this.rank) return;
        if (level === 0) {
            this.push(i);
            return;
        }
        const width = BLOCK ** (level - 1);
        const last = Math.min((i + 1) * BLOCK, this.levels[level - 1].length);
        for (let j = i * BLOCK; j < last && j * width < end; j++) this.collect(level - 1, j, end);
    }
}

/**
 * The orders of triangles by birth and by death: for each rank the number born and the number dead below it, the triangles sorted by
 * death, and the levels of the tree of last deaths.
 */
function ordersOf({ births, deaths, isovalues }) {
    const bornBefore = startsOf(births, isovalues.length);
    const diedBefore = startsOf(deaths, isovalues.length);
    const byDeath = new Uint32Array(births.length);
    const next = diedBefore.slice();
    for (let t = 0; t < deaths.length; t++) byDeath[next[deaths[t]]++] = t;
    const levels = [deaths];
    while (levels.at(-1).length > 1) {
        const below = levels.at(-1);
        const level = new Uint32Array(Math.ceil(below.length / BLOCK));
        for (let i = 0; i < below.length; i++) {
            const block = Math.floor(i / BLOCK);
            if (below[i] > level[block]) level[block] = below[i];
        }
        levels.push(level);
    }
    return { bornBefore, diedBefore, byDeath, levels };
}

/** For each rank up to n, and the one after, how many of the given ranks are below it. */
function startsOf(ranks, n) {
    const starts = new Uint32Array(n + 2);
    for (let i = 0; i < ranks.length; i++) starts[ranks[i] + 1]++;
    for (let i = 0; i <= n; i++) starts[i + 1] += starts[i];
    return starts;
}

/** The last rank whose isovalue is not above `isovalue`, or 0. */
function rankAt(isovalues, isovalue) {
    let low = 0;
    let high = isovalues.length;
    while (high - low > 1) {
        const middle = (low + high) >>> 1;
        if (isovalues[middle] <= isovalue) low = middle;
        else high = middle;
    }
    return low;
}
