// Where the picture is taken from, and the matrices that follow; the twin of src/render/camera.rs,
// with a point to look at. Matrices are arrays of columns one after the other.

const FIELD_OF_VIEW = (30 * Math.PI) / 180;
const FILL = 0.94;
const BORDER = 0.1;
/** The least side of a box that a picture is made to fit, voxels. */
const LEAST_BOX = 1;

/**
 * Degrees about the direction upwards and above the plane that is level; 1 is where the volume just fits. They count from
 * the columns of `basis` where a view has one (towards 0, towards 90 degrees, upwards), else from the world's axes.
 */
const FIRST_VIEW = { azimuth: 35, elevation: 22, distance: 1, target: [0, 0, 0] };

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) =>
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** Right, up and towards the eye; unit vectors of the world. */
function axesOf({ azimuth, elevation, basis }) {
    const [a, e] = [(azimuth * Math.PI) / 180, (elevation * Math.PI) / 180];
    const back = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const up = [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
    const axes = [cross(up, back), up, back];
    return basis ? axes.map((axis) => alongWorld(basis, axis)) : axes;
}

/** A point or direction of the voxel frame along the world's axes. */
function alongWorld(direction, p) {
    return [0, 1, 2].map((i) => direction[0][i] * p[0] + direction[1][i] * p[1] + direction[2][i] * p[2]);
}

/** The corners of the volume's box along the world's axes, and the middle. */
function boxOf({ dims, placement: { spacing, direction } }) {
    const least = Math.min(...spacing);
    const corner = (i) => alongWorld(direction, [0, 1, 2].map((axis) => {
        const side = (i >> axis) & 1;
        return (spacing[axis] / least) * (side * (dims[axis] - 1 + 2 * BORDER) - BORDER);
    }));
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
    const middle = [0, 1, 2].map((i) => 0.5 * (corners[0][i] + corners[7][i]));
    return { corners: corners.map((c) => c.map((x, i) => x - middle[i])), middle };
}

/**
 * From where boxes just fit a picture, along the direction of sight from their middle: the least distance. Of parallel
 * sight that is what the outline alone needs.
 */
function fitDistance(axes, corners, width, height, isParallel) {
    const tanY = Math.tan(0.5 * FIELD_OF_VIEW);
    const tanX = (tanY * width) / height;
    return Math.max(...corners.map((c) => {
        const [x, y, z] = axes.map((axis) => dot(axis, c));
        return (isParallel ? 0 : z) + Math.max(Math.abs(x) / (FILL * tanX), Math.abs(y) / (FILL * tanY));
    }));
}

/** The box around boxes, of which some may be none. */
function boxAround(boxes) {
    const [first, ...others] = boxes.filter(Boolean);
    return first ? others.reduce(([low, high], [a, b]) =>
        [low.map((x, i) => Math.min(x, a[i])), high.map((x, i) => Math.max(x, b[i]))], first) : null;
}

/**
 * Distance and target of a view, seen from where it is, that fits a box of the voxel frame (least and greatest
 * corner, LEAST_BOX voxels along each axis at least); without one, the volume.
 */
function fitOf(volume, box, view, width, height) {
    if (!box) return { distance: 1, target: [0, 0, 0] };
    const { direction } = volume.placement;
    const { corners, middle } = boxOf(volume);
    const [least, most] = box;
    const halves = least.map((x, axis) => 0.5 * Math.max(most[axis] - x, LEAST_BOX));
    const around = [0, 1, 2, 3, 4, 5, 6, 7].map((i) =>
        alongWorld(direction, halves.map((half, axis) => ((i >> axis) & 1 ? half : -half))));
    const axes = axesOf(view);
    const [fit, whole] = [around, corners].map((c) => fitDistance(axes, c, width, height, view.orthographic));
    const target = alongWorld(direction, least.map((x, axis) => 0.5 * (x + most[axis])));
    return {
        distance: Math.min(Math.max(fit / whole, NEAREST), FARTHEST),
        target: target.map((x, i) => x - middle[i]),
    };
}

/**
 * The matrices of a picture, and how far the eye is from the point it looks at. `view.target` is
 * the offset of that point from the middle of the volume, voxels along the world's axes.
 */
function projectionOf(volume, view, width, height) {
    const { direction } = volume.placement;
    const { corners, middle } = boxOf(volume);
    const axes = axesOf(view);
    const tanY = Math.tan(0.5 * FIELD_OF_VIEW);
    const tanX = (tanY * width) / height;
    const isParallel = Boolean(view.orthographic);
    const distance = view.distance * fitDistance(axes, corners, width, height, isParallel);
    const radius = Math.max(...corners.map((p) => Math.hypot(...p))) + Math.hypot(...view.target);
    const far = distance + radius;
    // What lies behind the eye is seen, too, where sight is parallel.
    const near = isParallel ? distance - radius : Math.max(distance - radius, 1e-3 * far);
    const reach = [tanX, tanY].map((tan) => (isParallel ? distance * tan : tan));
    const depth = [isParallel ? 1 / (near - far) : far / (near - far), (isParallel ? near : near * far) / (near - far)];

    const eye = middle.map((x, i) => x + view.target[i]);
    // Columns: where each voxel axis goes, and the origin.
    const eyeFromVoxel = [];
    for (const column of direction) eyeFromVoxel.push(...axes.map((axis) => dot(axis, column)), 0);
    eyeFromVoxel.push(...axes.map((axis) => -dot(axis, eye)), 1);
    eyeFromVoxel[14] -= distance;
    const clipFromEye = [
        1 / reach[0], 0, 0, 0,
        0, 1 / reach[1], 0, 0,
        0, 0, depth[0], isParallel ? 0 : -1,
        0, 0, depth[1], isParallel ? 1 : 0,
    ];
    // The inverse transpose of three columns are their cross products over the determinant.
    const columns = [0, 4, 8].map((at) => eyeFromVoxel.slice(at, at + 3));
    const scale = 1 / dot(columns[0], cross(columns[1], columns[2]));
    const eyeFromNormal = [[1, 2], [2, 0], [0, 1]].flatMap(([i, j]) =>
        [...cross(columns[i], columns[j]).map((x) => scale * x), 0]);
    eyeFromNormal.push(0, 0, 0, 1);
    return {
        clipFromVoxel: product(clipFromEye, eyeFromVoxel),
        eyeFromVoxel,
        eyeFromNormal,
        mirrored: determinant(direction) < 0,
        axes,
        eye,
        distance,
        isParallel,
        /**
         * Depth is (depth[0] z + depth[1]) / -z, half width and height of the picture those at a distance of 1; where sight
         * is parallel depth comes without the division, and they are those at any distance.
         */
        depth,
        reach,
    };
}

/** A plane across an axis of the volume, at a share of its length, in the eye frame: what lies beyond it is below 0. */
function planeOf({ dims, placement: { spacing } }, { axis, share, turned }, { eyeFromVoxel: m, eyeFromNormal }) {
    const sign = turned ? 1 : -1;
    const offset = -sign * share * (dims[axis] - 1) * (spacing[axis] / Math.min(...spacing));
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

/** A point of the voxel frame as a target of the view; none where there is none. */
function pointUnder(found, volume) {
    if (!found) return null;
    const { middle } = boxOf(volume);
    return alongWorld(volume.placement.direction, found).map((a, i) => a - middle[i]);
}

/**
 * The point of the mesh under a point of the picture (-1 to 1, right and up), voxel frame, on this side of a plane of the
 * eye frame; null beside the mesh.
 */
function meshPointUnder({ surface }, { clipFromVoxel: m, eyeFromVoxel: e, isParallel }, [x, y], plane) {
    const { nTriangles, nVertices, corners, positions: p } = surface;
    // Each vertex in the picture, relative to the point, and its distance.
    const seen = new Float64Array(3 * nVertices);
    for (let at = 0; at < 3 * nVertices; at += 3) {
        const w = m[3] * p[at] + m[7] * p[at + 1] + m[11] * p[at + 2] + m[15];
        seen[at] = (m[0] * p[at] + m[4] * p[at + 1] + m[8] * p[at + 2] + m[12]) / w - x;
        seen[at + 1] = (m[1] * p[at] + m[5] * p[at + 1] + m[9] * p[at + 2] + m[13]) / w - y;
        seen[at + 2] = isParallel ? -(e[2] * p[at] + e[6] * p[at + 1] + e[10] * p[at + 2] + e[14]) : w;
    }
    let [nearest, found] = [Infinity, null];
    for (let t = 0; t < 3 * nTriangles; t += 3) {
        const [a, b, c] = [3 * corners[t], 3 * corners[t + 1], 3 * corners[t + 2]];
        if (!isParallel && (seen[a + 2] <= 0 || seen[b + 2] <= 0 || seen[c + 2] <= 0)) continue;
        const u = seen[b] * seen[c + 1] - seen[b + 1] * seen[c];
        const v = seen[c] * seen[a + 1] - seen[c + 1] * seen[a];
        const w = seen[a] * seen[b + 1] - seen[a + 1] * seen[b];
        const total = u + v + w;
        if (total === 0 || u / total < 0 || v / total < 0 || w / total < 0) continue;
        const shares = [u / total, v / total, w / total];
        let depth = shares[0] * seen[a + 2] + shares[1] * seen[b + 2] + shares[2] * seen[c + 2];
        if (!isParallel) {
            // In space, shares are weighted by the distance.
            [a, b, c].forEach((corner, i) => { shares[i] /= seen[corner + 2]; });
            depth = 1 / (shares[0] + shares[1] + shares[2]);
            shares.forEach((share, i) => { shares[i] = depth * share; });
        }
        if (depth >= nearest) continue;
        const at = [0, 1, 2].map((i) => shares[0] * p[a + i] + shares[1] * p[b + i] + shares[2] * p[c + i]);
        const eye = (row) => e[row] * at[0] + e[4 + row] * at[1] + e[8 + row] * at[2] + e[12 + row];
        if (plane && plane[0] * eye(0) + plane[1] * eye(1) + plane[2] * eye(2) + plane[3] < 0) continue;
        [nearest, found] = [depth, at];
    }
    return found;
}
