// The orientation cube in the corner of the picture. A click on a side looks from that side.

/** Half an edge of the cube, CSS pixels. */
const HALF_EDGE = 17;
/** Half the side of the drawing, CSS pixels: more than half the cube's diagonal. */
const HALF_SIDE = 32;

/** The names of the sides +x, -x, +y and so on in a patient's space. */
const SIDES = { LPS: "LRPASI", RAS: "RLAPSI" };

/** The names of the six sides in the world of a volume. */
function sideNames({ placement: { space } }) {
    return [...SIDES[space] ?? ["x", "-x", "y", "-y", "z", "-z"]];
}

/** The angles of a view from a side (0 to 5: +x, -x, +y and so on), relative to `basis`. */
function viewFrom(side, basis) {
    const [x, y, z] = (basis ?? [[1, 0, 0], [0, 1, 0], [0, 0, 1]]).map((column) => (side % 2 ? -1 : 1) * column[side >> 1]);
    const elevation = (Math.asin(clamped(z, [-1, 1])) * 180) / Math.PI;
    // From above and from below, +y is up.
    const isLevel = Math.abs(z) < 0.999;
    const azimuth = isLevel ? (((Math.atan2(y, x) * 180) / Math.PI) + 360) % 360 : z > 0 ? 270 : 90;
    return { azimuth, elevation: Number(elevation.toFixed(6)) };
}

class Cube {
    constructor(svg, viewer) {
        this.svg = svg;
        this.names = sideNames(viewer.spectrum.info.volume);
        svg.setAttribute("viewBox", `${-HALF_SIDE} ${-HALF_SIDE} ${2 * HALF_SIDE} ${2 * HALF_SIDE}`);
        this.sides = this.names.map((name, side) => {
            const group = svgElement("g", { class: `axis-${"xyz"[side >> 1]}` });
            const label = svgElement("text", {});
            label.textContent = name;
            const title = svgElement("title", {});
            title.textContent = `From ${name} (${side + 1})`;
            group.append(title, svgElement("path", {}), label);
            on(group, "click", () => viewer.lookFrom(side));
            return group;
        });
    }

    /** Draws the visible sides. */
    draw([right, up, back]) {
        const key = [...right, ...up].map((x) => x.toFixed(3)).join();
        if (key === this.drawn) return;
        this.drawn = key;
        const unit = (axis, sign) => [right, up, back].map((row) => sign * row[axis]);
        const visible = this.sides.filter((group, side) => {
            const [axis, sign] = [side >> 1, side % 2 ? -1 : 1];
            const out = unit(axis, sign);
            if (out[2] < 0.02) return false;
            const [u, v] = [unit((axis + 1) % 3, 1), unit((axis + 2) % 3, 1)];
            const at = (i, j) => [0, 1].map((k) => ((k ? -1 : 1) * HALF_EDGE * (out[k] + i * u[k] + j * v[k])).toFixed(1));
            group.children[1].setAttribute("d", `M${at(1, 1)}L${at(1, -1)}L${at(-1, -1)}L${at(-1, 1)}Z`);
            const label = group.children[2];
            const [x, y] = at(0, 0);
            label.setAttribute("x", x);
            label.setAttribute("y", y);
            // A side at a grazing angle has no room for its name.
            label.setAttribute("visibility", out[2] > 0.35 ? "visible" : "hidden");
            return true;
        });
        this.svg.replaceChildren(...visible);
    }
}
