// The camera and its matrices; the twin of src/render/camera.rs, with a target to look at. Matrices are in column order.

const FIELD_OF_VIEW = (30 * Math.PI) / 180;
/** The share of the picture's width or height that a fitted box takes. */
const FILL = 0.94;
/** The volume's box is enlarged by this on every side, voxels. */
const BORDER = 0.1;
/** The least distance of the eye that a picture is fitted to, voxels. */
const MIN_BOX = 1;
/** Steps of the search for the middle of a fitted picture. */
const FIT_STEPS = 4;

/**
 * Azimuth and elevation in degrees; a distance of 1 is the one at which the volume fits. Angles refer to the columns of `basis`
 * (azimuth 0, azimuth 90, up) if a view has one, else to the axes of the world.
 */
const FIRST_VIEW = { azimuth: 35, elevation: 22, distance: 1, target: [0, 0, 0] };

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) =>
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** The unit vectors right, up and towards the eye, in the world. */
function axesOf({ azimuth, elevation, basis }) {
    const [a, e] = [(azimuth * Math.PI) / 180, (elevation * Math.PI) / 180];
    const back = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const up = [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
    const axes = [cross(up, back), up, back];
    return basis ? axes.map((axis) => inWorldAxes(basis, axis)) : axes;
}

/** A point or direction of the voxel frame in the axes of the world, still in voxels. */
function inWorldAxes(columns, p) {
    return [0, 1, 2].map((i) => columns[0][i] * p[0] + columns[1][i] * p[1] + columns[2][i] * p[2]);
}

/** The corners of the volume's box, relative to its middle, and the middle, in the axes of the world. */
function boxOf({ dims, placement }) {
    const [columns, cellSize] = [voxelAxesOf(placement), cellSizeOf(placement)];
    const corner = (i) => inWorldAxes(columns, [0, 1, 2].map((axis) => {
        const side = (i >> axis) & 1;
        return cellSize[axis] * (side * (dims[axis] - 1 + 2 * BORDER) - BORDER);
    }));
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
    const middle = [0, 1, 2].map((i) => 0.5 * (corners[0][i] + corners[7][i]));
    return { corners: corners.map((c) => c.map((x, i) => x - middle[i])), middle };
}

/** The least distance from the origin at which corners fit a picture; in parallel projection only their outline counts. */
function fitDistance(axes, corners, width, height, isParallel) {
    const tanY = Math.tan(0.5 * FIELD_OF_VIEW);
    const tanX = (tanY * width) / height;
    return corners.reduce((most, c) => {
        const [x, y, z] = axes.map((axis) => dot(axis, c));
        return Math.max(most, (isParallel ? 0 : z) + Math.max(Math.abs(x) / (FILL * tanX), Math.abs(y) / (FILL * tanY)));
    }, 0);
}

/**
 * The distance and target at which points of the voxel frame fit the picture from the angles of a view; those of the volume without
 * points.
 */
function fittedView(volume, points, view, width, height) {
    if (points.length === 0) return { distance: 1, target: [0, 0, 0] };
    const columns = voxelAxesOf(volume.placement);
    const { corners, middle } = boxOf(volume);
    const axes = axesOf(view);
    const placed = points.map((p) => inWorldAxes(columns, p).map((x, i) => x - middle[i]));
    const whole = fitDistance(axes, corners, width, height, view.orthographic);
    let [target, fit] = [[0, 0, 0], 0];
    // The middle of the picture depends on the distance a little.
    for (let i = 0; i < FIT_STEPS; i++) {
        const around = placed.map((p) => p.map((x, k) => x - target[k]));
        fit = Math.max(fitDistance(axes, around, width, height, view.orthographic), MIN_BOX);
        const shift = axes.map((axis, row) => {
            const at = around.map((p) => dot(axis, p) / (view.orthographic || row === 2 ? 1 : 1 - dot(axes[2], p) / fit));
            return at.reduce((most, x) => Math.max(most, x), -Infinity) / 2 + at.reduce((least, x) => Math.min(least, x), Infinity) / 2;
        });
        target = target.map((x, k) => x + axes.reduce((sum, axis, row) => sum + shift[row] * axis[k], 0));
    }
    return { distance: clamped(fit / whole, [NEAREST, FARTHEST]), target };
}

/**
 * The matrices of a picture, and the distance of the eye from its target. `view.target` is relative to the middle of the volume,
 * in voxels along the axes of the world.
 */
function projectionOf(volume, view, width, height) {
    const voxelAxes = voxelAxesOf(volume.placement);
    const { corners, middle } = boxOf(volume);
    const axes = axesOf(view);
    const tanY = Math.tan(0.5 * FIELD_OF_VIEW);
    const tanX = (tanY * width) / height;
    const isParallel = Boolean(view.orthographic);
    const distance = view.distance * fitDistance(axes, corners, width, height, isParallel);
    const radius = Math.max(...corners.map((p) => Math.hypot(...p))) + Math.hypot(...view.target);
    const far = distance + radius;
    // In parallel projection the surface behind the eye is visible, too.
    const near = isParallel ? distance - radius : Math.max(distance - radius, 1e-3 * far);
    const halfExtent = [tanX, tanY].map((tan) => (isParallel ? distance * tan : tan));
    const depth = [isParallel ? 1 / (near - far) : far / (near - far), (isParallel ? near : near * far) / (near - far)];

    const eye = middle.map((x, i) => x + view.target[i]);
    // Columns: the images of the voxel axes and of the origin.
    const eyeFromVoxel = [];
    for (const column of voxelAxes) eyeFromVoxel.push(...axes.map((axis) => dot(axis, column)), 0);
    eyeFromVoxel.push(...axes.map((axis) => -dot(axis, eye)), 1);
    eyeFromVoxel[14] -= distance;
    const clipFromEye = [
        1 / halfExtent[0], 0, 0, 0,
        0, 1 / halfExtent[1], 0, 0,
        0, 0, depth[0], isParallel ? 0 : -1,
        0, 0, depth[1], isParallel ? 1 : 0,
    ];
    // The columns of the inverse transpose are cross products over the determinant.
    const columns = [0, 4, 8].map((at) => eyeFromVoxel.slice(at, at + 3));
    const scale = 1 / dot(columns[0], cross(columns[1], columns[2]));
    const eyeFromNormal = [[1, 2], [2, 0], [0, 1]].flatMap(([i, j]) =>
        [...cross(columns[i], columns[j]).map((x) => scale * x), 0]);
    eyeFromNormal.push(0, 0, 0, 1);
    return {
        clipFromVoxel: product(clipFromEye, eyeFromVoxel),
        eyeFromVoxel,
        eyeFromNormal,
        mirrored: determinant(voxelAxes) < 0,
        axes,
        eye,
        distance,
        isParallel,
        /**
         * Depth is (depth[0] z + depth[1]) / -z, without the division in parallel projection. `halfExtent` is half the width and
         * half the height of the picture at a distance of 1, at any distance in parallel projection.
         */
        depth,
        halfExtent,
    };
}

/** A clip plane across an axis of the volume, at a share of its length, in the eye frame; negative on the side that is cut off. */
function planeOf({ dims, placement }, { axis, share, turned }, { eyeFromVoxel: m, eyeFromNormal }) {
    const sign = turned ? 1 : -1;
    const offset = -sign * share * (dims[axis] - 1) * cellSizeOf(placement)[axis];
    const normal = [0, 1, 2].map((i) => sign * eyeFromNormal[4 * axis + i]);
    return [...normal, offset - dot(normal, m.slice(12, 15))];
}

/** The product of two 4x4 matrices. */
function product(a, b) {
    const c = new Array(16).fill(0);
    for (let column = 0; column < 4; column++) {
        for (let row = 0; row < 4; row++) {
            for (let k = 0; k < 4; k++) c[4 * column + row] += a[4 * k + row] * b[4 * column + k];
        }
    }
    return c;
}

/** A point of the voxel frame as the target of a view. */
function targetAt(point, volume) {
    const { middle } = boxOf(volume);
    return inWorldAxes(voxelAxesOf(volume.placement), point).map((a, i) => a - middle[i]);
}

/**
 * The nearest point of the mesh, voxel frame, at a point of the picture (-1 to 1, right and up), on the visible side of a clip
 * plane; null if there is none.
 */
function meshPointUnder({ surface }, { clipFromVoxel: m, eyeFromVoxel: e, isParallel }, [x, y], plane) {
    const { nTriangles, nVertices, corners, positions: p } = surface;
    // Each vertex's place in the picture relative to the point, and its distance.
    const screen = new Float64Array(3 * nVertices);
    for (let at = 0; at < 3 * nVertices; at += 3) {
        const w = m[3] * p[at] + m[7] * p[at + 1] + m[11] * p[at + 2] + m[15];
        screen[at] = (m[0] * p[at] + m[4] * p[at + 1] + m[8] * p[at + 2] + m[12]) / w - x;
        screen[at + 1] = (m[1] * p[at] + m[5] * p[at + 1] + m[9] * p[at + 2] + m[13]) / w - y;
        screen[at + 2] = isParallel ? -(e[2] * p[at] + e[6] * p[at + 1] + e[10] * p[at + 2] + e[14]) : w;
    }
    let [nearest, found] = [Infinity, null];
    for (let t = 0; t < 3 * nTriangles; t += 3) {
        const [a, b, c] = [3 * corners[t], 3 * corners[t + 1], 3 * corners[t + 2]];
        if (!isParallel && (screen[a + 2] <= 0 || screen[b + 2] <= 0 || screen[c + 2] <= 0)) continue;
        const u = screen[b] * screen[c + 1] - screen[b + 1] * screen[c];
        const v = screen[c] * screen[a + 1] - screen[c + 1] * screen[a];
        const w = screen[a] * screen[b + 1] - screen[a + 1] * screen[b];
        const total = u + v + w;
        if (total === 0 || u / total < 0 || v / total < 0 || w / total < 0) continue;
        const weights = [u / total, v / total, w / total];
        let depth = weights[0] * screen[a + 2] + weights[1] * screen[b + 2] + weights[2] * screen[c + 2];
        if (!isParallel) {
            // Perspective-correct barycentric coordinates.
            [a, b, c].forEach((corner, i) => { weights[i] /= screen[corner + 2]; });
            depth = 1 / (weights[0] + weights[1] + weights[2]);
            weights.forEach((weight, i) => { weights[i] = depth * weight; });
        }
        if (depth >= nearest) continue;
        const at = [0, 1, 2].map((i) => weights[0] * p[a + i] + weights[1] * p[b + i] + weights[2] * p[c + i]);
        const eye = (row) => e[row] * at[0] + e[4 + row] * at[1] + e[8 + row] * at[2] + e[12 + row];
        if (plane && plane[0] * eye(0) + plane[1] * eye(1) + plane[2] * eye(2) + plane[3] < 0) continue;
        [nearest, found] = [depth, at];
    }
    return found;
}
