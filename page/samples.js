// Vertices that run along an edge of the lattice, from a sample to its neighbour. The twin of src/file/samples.rs.

/** Kinds of knots, those of lattice vertices aside: each with columns of its own. */
const FIRST = 0;
const FURTHER = 1;

/** The samples of a volume in the whole numbers of positions. */
class Samples {
    constructor({ placement: { spacing } }, perVoxel) {
        const least = Math.min(...spacing);
        this.cell = spacing.map((s) => (s / least) * perVoxel);
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
