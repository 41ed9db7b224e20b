// The connected components of a surface, and the selection of them. The twin of src/spectrum/components.rs; picked components are
// tracked from isovalue to isovalue by their vertices.

/** A picked component that has no vertex at the next isovalue is tracked through this many steps towards it. */
const TRACKING_STEPS = 16;
/** The most components that can be picked: owners are bytes. */
const MAX_PICKS = 250;

/**
 * The components of a closed surface: the component of each triangle (`of`) and vertex (`ofVertex`), and a `list` of their volume
 * (negative for a cavity), area without caps and number of triangles, in voxels, the largest volume first.
 */
function componentsOf({ nTriangles, nVertices, triangles, corners, positions }, caps) {
    const { root, join } = disjointSets(nVertices);
    for (let t = 0; t < nTriangles; t++) {
        join(corners[3 * t], corners[3 * t + 1]);
        join(corners[3 * t], corners[3 * t + 2]);
    }
    const list = [];
    const numberOf = new Int32Array(nVertices).fill(-1);
    const of = new Uint32Array(nTriangles);
    for (let t = 0; t < nTriangles; t++) {
        const [a, b, c] = [3 * corners[3 * t], 3 * corners[3 * t + 1], 3 * corners[3 * t + 2]];
        const at = root(corners[3 * t]);
        if (numberOf[at] < 0) {
            numberOf[at] = list.length;
            list.push({ volume: 0, area: 0, nTriangles: 0, first: triangles[t], apex: a });
        }
        of[t] = numberOf[at];
        const component = list[of[t]];
        component.nTriangles++;
        component.first = Math.min(component.first, triangles[t]);
        component.volume += tetrahedronVolume(positions, component.apex, a, b, c);
        if (!caps[triangles[t]]) component.area += triangleArea(positions, a, b, c);
    }
    const order = [...list.keys()].sort((i, j) =>
        Math.abs(list[j].volume) - Math.abs(list[i].volume) || list[i].first - list[j].first);
    const rank = new Uint32Array(list.length);
    order.forEach((old, now) => { rank[old] = now; });
    for (let t = 0; t < nTriangles; t++) of[t] = rank[of[t]];
    const ofVertex = Uint32Array.from({ length: nVertices }, (_, v) => rank[numberOf[root(v)]]);
    return { of, ofVertex, list: order.map((old) => list[old]) };
}

/** Selects the components that are shown, and whether they are coloured. */
class Selection {
    /** The first selection, in voxels. */
    constructor({ largest = null, min_volume: minVolume = 0, min_area: minArea = 0, at = null } = {}) {
        Object.assign(this, { largest, minVolume, minArea });
        /** Picked components: the only ones that are shown, or hidden if `isHiding`. */
        this.picks = at ? [{ point: at, isFresh: true }] : [];
        this.isHiding = false;
        this.isColoured = false;
        this.version = 0;
        /** For each vertex of the spectrum, the number of the pick, from 1, in whose component it was last; 0 for none. */
        this.owner = null;
    }

    /** Whether every component is shown. */
    get isAll() {
        return this.largest === null && !(this.minVolume > 0) && !(this.minArea > 0) && this.picks.length === 0;
    }

    /** Whether the picture does not depend on components. */
    get isPlain() {
        return this.isAll && !this.isColoured;
    }

    set(changes) {
        Object.assign(this, changes);
        this.version++;
    }

    /** Picks the component at a point, to be shown alone or hidden. */
    pick(point, isHiding) {
        if (isHiding !== this.isHiding || !isHiding) this.clearPicks();
        if (this.picks.length < MAX_PICKS) this.picks.push({ point, isFresh: true });
        this.set({ isHiding });
    }

    clearPicks() {
        this.owner?.fill(0);
        this.set({ picks: [] });
    }

    /** Prepares for another spectrum, whose vertices have other numbers. */
    reset() {
        this.owner = null;
        for (const pick of this.picks) pick.isFresh = true;
        this.version++;
    }

    /** Whether a component that was tracked has no vertex in these components. */
    isLost(surface, components) {
        if (this.picks.length === 0 || !this.owner) return false;
        const votes = this.votes(surface, components);
        return this.picks.some((pick, i) => !pick.isFresh && pick.component !== null && votes[i].size === 0);
    }

    /** For each pick, the number of its vertices in each component. */
    votes({ nVertices, vertices }, { ofVertex }) {
        const votes = this.picks.map(() => new Map());
        for (let i = 0; i < nVertices; i++) {
            const owner = this.owner[vertices[i]];
            if (owner > 0) votes[owner - 1].set(ofVertex[i], (votes[owner - 1].get(ofVertex[i]) ?? 0) + 1);
        }
        return votes;
    }

    /** Finds the picked components among those of a surface. */
    track(surface, components) {
        if (this.picks.length === 0) return;
        this.owner ??= new Uint8Array(surface.mark.length);
        const { nVertices, vertices } = surface;
        const { ofVertex } = components;
        const votes = this.votes(surface, components);
        this.picks.forEach((pick, i) => {
            if (pick.isFresh) pick.component = nearestComponent(surface, components, pick.point);
            else {
                const [best] = [...votes[i]].sort(([a, n], [b, m]) => m - n || a - b);
                pick.component = best ? best[0] : null;
            }
            if (pick.component !== null) pick.isFresh = false;
            pick.place = undefined;
        });
        const pickOf = new Map();
        this.picks.forEach((pick, i) => { if (pick.component !== null) pickOf.set(pick.component, i + 1); });
        for (let i = 0; i < nVertices; i++) {
            const v = vertices[i];
            const now = pickOf.get(ofVertex[i]);
            if (now) {
                this.owner[v] = now;
                this.picks[now - 1].place = i;
            }
            // A piece that has split off is no longer tracked; a component that vanished may come back.
            else if (this.owner[v] > 0 && this.picks[this.owner[v] - 1].component !== null) this.owner[v] = 0;
        }
        // Points by which components are found again in another spectrum and from the address.
        for (const pick of this.picks.filter((each) => each.component !== null && each.place !== undefined)) {
            pick.point = [...surface.positions.subarray(3 * pick.place, 3 * pick.place + 3)];
        }
    }

    /** Points on the picked components, as text for the address. */
    pickedPoints() {
        return this.picks.map(({ point }) => point.map((x) => Number(x.toPrecision(5))).join(",")).join(";");
    }

    /** For each component, whether it is shown. */
    kept({ list }) {
        const picked = new Set(this.picks.map((pick) => pick.component));
        let left = this.largest ?? Infinity;
        return list.map(({ volume, area }, i) => {
            const isKept = Math.abs(volume) >= this.minVolume && area >= this.minArea
                && (this.picks.length === 0 || picked.has(i) !== this.isHiding) && left > 0;
            if (isKept) left--;
            return isKept;
        });
    }
}

/** The component of the vertex nearest to a point; null if there is none. */
function nearestComponent({ nVertices, positions }, { ofVertex }, [x, y, z]) {
    let [nearest, found] = [Infinity, null];
    for (let i = 0; i < nVertices; i++) {
        const square = (positions[3 * i] - x) ** 2 + (positions[3 * i + 1] - y) ** 2 + (positions[3 * i + 2] - z) ** 2;
        if (square < nearest) [nearest, found] = [square, ofVertex[i]];
    }
    return found;
}
