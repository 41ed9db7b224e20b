// The order in which the triangles of transparent layers are drawn; the twin of src/render/depth_order.rs.

/** The number of slabs of the depth. */
const N_SLABS = 256;

/**
 * For transparent layers, whose numbers in `order` are those of inner ones first: the indices of their corners in the order of drawing, and
 * the draws of all layers together, { i, first, end }, in corners.
 */
function depthOrder(layers, order, { eyeFromVoxel: m }) {
    let [near, far] = [Infinity, -Infinity];
    const sorted = order.map((i) => {
        const { nTriangles, positions, corners } = layers[i].query.surface;
        const depths = new Float32Array(nTriangles);
        for (let t = 0; t < nTriangles; t++) {
            let depth = 0;
            for (let k = 0; k < 3; k++) {
                const at = 3 * corners[3 * t + k];
                depth -= m[2] * positions[at] + m[6] * positions[at + 1] + m[10] * positions[at + 2];
            }
            depths[t] = depth;
            near = Math.min(near, depths[t]);
            far = Math.max(far, depths[t]);
        }
        return { i, depths, indices: new Uint32Array(3 * nTriangles) };
    });
    for (const layer of sorted) {
        const slabs = layer.depths.map((depth) => Math.min(Math.floor((N_SLABS * (far - depth)) / (far - near || 1)), N_SLABS - 1));
        const next = new Uint32Array(N_SLABS + 1);
        for (const slab of slabs) next[slab + 1] += 3;
        for (let slab = 0; slab < N_SLABS; slab++) next[slab + 1] += next[slab];
        layer.starts = next.slice();
        slabs.forEach((slab, t) => {
            for (let k = 0; k < 3; k++) layer.indices[next[slab]++] = 3 * t + k;
        });
    }
    const runs = [];
    for (let slab = 0; slab < N_SLABS; slab++) {
        for (const { i, starts } of sorted) {
            const [first, end] = starts.subarray(slab);
            const last = runs.at(-1);
            if (last?.i === i) last.end = end;
            else if (first < end) runs.push({ i, first, end });
        }
    }
    return { sorted, runs };
}

/** Whether the eye is on the side of the clip plane where nothing is shown. */
function isEyeCutOff({ plane }, { isParallel }) {
    return plane?.[isParallel ? 2 : 3] < 0;
}
