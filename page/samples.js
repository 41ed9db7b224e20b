// The voxel frame, and positions of samples in it, for vertices that move along lattice edges. The twin of src/file/samples.rs and
// of the frames in src/volume/placement.rs.

/** Length of a cell of the voxel frame along an axis, at most; the shortest is 1. */
const MAX_CELL_SIZE = 1.5;

/** Size of a cell in the voxel frame: spacing over the smallest spacing, at most MAX_CELL_SIZE. */
function cellSizeOf({ spacing }) {
    const voxel = Math.min(...spacing);
    return spacing.map((s) => Math.min(s / voxel, MAX_CELL_SIZE));
}

/** The unit vectors of the voxel frame in the axes of the world, in smallest spacings. */
function voxelAxesOf({ spacing, direction }) {
    const voxel = Math.min(...spacing);
    return direction.map((axis, a) => axis.map((x) => x * Math.max(spacing[a] / voxel / MAX_CELL_SIZE, 1)));
}

/** Kinds of knots of vertices that are not lattice vertices; each kind has its own columns. */
const FIRST = 0;
const FURTHER = 1;

/** The samples of a volume, in steps of positions. */
class Samples {
    constructor({ placement }, perVoxel) {
        this.cell = cellSizeOf(placement).map((s) => s * perVoxel);
    }

    /** The sample nearest to a coordinate along an axis. */
    nearest(axis, x) {
        return Math.floor(x / this.cell[axis] + 0.5);
    }

    /** The coordinate of a sample along an axis. */
    place(axis, i) {
        return Math.floor(i * this.cell[axis] + 0.5);
    }
}
