// Saves meshes, pictures and films.

class Saves {
    constructor(viewer) {
        this.viewer = viewer;
        /** The size of saved pictures, undefined for that of the canvas, and whether their background is transparent. */
        this.size = undefined;
        this.isTransparent = false;
    }

    mesh(format) {
        const { viewer } = this;
        // Only the first isovalues are loaded.
        if (!viewer.isWhole) return;
        const [encode, type] = FORMATS[format];
        const { volume } = viewer.spectrum.info;
        const mesh = { ...viewer.worldMesh(viewer.look.open, true), comments: worldComments(volume), placement: volume.placement };
        const blob = new Blob([encode(mesh)], { type });
        const name = fileName(document.title, viewer.shownIsovalue(), format);
        save(blob, name);
        setText(viewer.panel.message, `Saved ${name}`);
    }

    /** The picture as PNG. */
    async screenshot({ size = this.size, transparent = this.isTransparent } = {}) {
        const picture = await this.pixels(size, transparent);
        if (transparent) withStraightAlpha(picture);
        return pngOf(drawPicture(element("canvas"), picture, this.viewer));
    }

    /** The pixels of the picture: rows from the top, four bytes per pixel, premultiplied alpha. */
    pixels(size, isTransparent = false) {
        const { viewer } = this;
        viewer.prepare();
        const { width, height, clientHeight } = viewer.canvas;
        const wanted = size ?? [width, height];
        const projection = viewer.projection(wanted);
        const look = { ...viewer.drawnLook(projection), isTransparent };
        if (size) look.pixelRatio = size[1] / clientHeight;
        if (isTransparent) look.background = [0, 0, 0];
        return viewer.renderer.read(viewer.layers(), look, projection, wanted);
    }

    async picture() {
        const { viewer } = this;
        save(await this.screenshot(), fileName(document.title, viewer.shownIsovalue(), "png"));
        viewer.request();
    }

    /** Saves a film of the sweep, or stops the film in progress. */
    async film() {
        const { viewer } = this;
        if (this.filming) {
            this.filming = null;
            return;
        }
        // Only the first isovalues are loaded.
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
