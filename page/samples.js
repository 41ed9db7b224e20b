// Vertices that run along an edge of the lattice, from a sample to its neighbour. The twin of src/file/samples.rs.

/** Kinds of knots, each with columns of its own. */
const LATTICE = 0;
const FIRST = 1;
const FURTHER = 2;

/** The samples of a volume in the whole numbers of positions, and the normals there. */
class Samples {
    constructor({ dims, placement: { spacing } }, perVoxel) {
        const least = Math.min(...spacing);
        this.dims = dims;
        this.cell = spacing.map((s) => (s / least) * perVoxel);
        /** Two components in one number, by that of the sample. */
        this.normals = new Map();
    }

    /** The sample nearest to a coordinate along an axis. */
    nearest(axis, x) {
        return Math.floor(x / this.cell[axis] + 0.5);
    }

    /** The coordinate of a sample along an axis. */
    place(axis, i) {
        return Math.floor(i * this.cell[axis] + 0.5);
    }

    /** The number of a sample, x fastest. */
    index(x, y, z) {
        return x + this.dims[0] * (y + this.dims[1] * z);
    }

    /** Puts the normal that lattice vertices had last at a sample into `normal`, if there is one. */
    readNormal(index, normal) {
        const packed = this.normals.get(index);
        if (packed === undefined) return;
        normal[0] = (packed >> 8) - 128;
        normal[1] = (packed & 255) - 128;
    }

    /** This is the normal at a sample. */
    setNormal(index, u, v) {
        this.normals.set(index, ((u + 128) << 8) | (v + 128));
    }
}
