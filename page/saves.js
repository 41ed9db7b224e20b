// What the reader takes along: meshes, pictures, films.

class Saves {
    constructor(viewer) {
        this.viewer = viewer;
        /** Width and height of pictures where they are not those that are seen, and whether nothing lies behind. */
        this.size = undefined;
        this.isTransparent = false;
    }

    mesh(format) {
        const { viewer } = this;
        // Another isosurface than the first ones is not there yet.
        if (!viewer.isWhole) return;
        const [encode, type] = FORMATS[format];
        const { volume } = viewer.spectrum.info;
        const mesh = { ...viewer.worldMesh(viewer.look.open, true), said: saidOfWorld(volume), placement: volume.placement };
        const blob = new Blob([encode(mesh)], { type });
        save(blob, fileName(document.title, viewer.shownIsovalue(), format));
    }

    /** The picture as PNG: of the size that is seen, or another one; on the background, or on nothing. */
    async screenshot({ size = this.size, transparent = this.isTransparent } = {}) {
        const picture = await this.pixels(size, transparent);
        if (transparent) withStraightAlpha(picture);
        return pngOf(canvasOf(document.createElement("canvas"), picture, this.viewer));
    }

    /** What the picture shows, four bytes per pixel, colours times alpha. */
    pixels(size, isTransparent = false) {
        const { viewer } = this;
        viewer.prepare();
        const { width, height, clientHeight } = viewer.canvas;
        const wanted = size ?? [width, height];
        const projection = viewer.projection(wanted);
        const look = { ...viewer.looked(projection), isTransparent };
        if (size) look.pixelRatio = size[1] / clientHeight;
        if (isTransparent) look.background = [0, 0, 0];
        return viewer.renderer.read(viewer.layers(), look, projection, wanted);
    }

    async picture() {
        const { viewer } = this;
        save(await this.screenshot(), fileName(document.title, viewer.shownIsovalue(), "png"));
        viewer.request();
    }

    /** Saves a film of the sweep, or stops the one that is made. */
    async film() {
        const { viewer } = this;
        if (this.filming) {
            this.filming = null;
            return;
        }
        // Other isovalues than the first are not there yet.
        if (!viewer.isWhole) return;
        const own = (this.filming = {});
        const { message } = viewer.panel;
        try {
            const film = await filmOf(viewer, (share) => {
                setText(message, `Film ${Math.round(100 * share)} %; again stops it`);
                return this.filming !== own;
            });
            if (film) save(film, fileName(document.title, "sweep", "webm"));
            setText(message, film ? "Film saved" : "Film stopped");
        } catch (error) {
            setText(message, `No film: ${error.message}`);
        } finally {
            if (this.filming === own) this.filming = null;
        }
    }
}
