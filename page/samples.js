// Positions of samples, for vertices that move along lattice edges. The twin of src/file/samples.rs.

/** Kinds of knots of vertices that are not lattice vertices; each kind has its own columns. */
const FIRST = 0;
const FURTHER = 1;

/** The samples of a volume, in steps of positions. */
class Samples {
    constructor({ placement: { spacing } }, perVoxel) {
        const voxel = Math.min(...spacing);
        this.cell = spacing.map((s) => (s / voxel) * perVoxel);
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
