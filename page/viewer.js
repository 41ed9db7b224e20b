// Draws the scene. A picture is drawn when the scene has changed and shows its latest state.

/** The time without change after which measures and address are updated, milliseconds. */
const REST = 250;

/** The most lost devices that are replaced. */
const MAX_LOST = 3;

class Viewer extends Scene {
    /** Draws with a renderer from now on; its canvas replaces the one in the page. */
    async setRenderer(renderer) {
        await renderer.load(this.spectrum, this.about.step);
        byId("canvas").replaceWith(renderer.canvas);
        this.renderer = renderer;
        this.canvas = renderer.canvas;
        this.isUploaded = false;
        renderer.onLost(() => this.recover());
        listenToPointers(this.canvas, this);
        new ResizeObserver(() => this.request()).observe(this.canvas);
        document.documentElement.dataset.renderer = renderer.name;
    }

    /** Replaces the spectrum by one with other isovalues, by default the whole one. */
    async setSpectrum(spectrum, loaded = [this.low, this.high]) {
        this.spectrum = spectrum;
        this.query = new Query(spectrum, this.about.step);
        this.selection.reset();
        this.isUploaded = false;
        this.setLoaded(loaded, true);
        // The further isosurfaces should fit, too, unless the reader has moved the camera.
        if (this.extras.length > 0 && this.fitted === JSON.stringify(this.view)) {
            Object.assign(this.view, this.firstView);
            this.isFitWanted = "all";
        }
        // While the device is lost there is no renderer; recover() uploads the new spectrum.
        const { renderer } = this;
        try {
            await renderer?.load(spectrum, this.about.step);
            // Uploaded; they are made anew if another device needs them.
            delete spectrum.tables;
        } catch (error) {
            this.renderer = null;
            await drawWithWebGl2(this, renderer, error);
        }
        this.request();
    }

    /** Opens another device after one was lost, or shows the still picture. */
    async recover() {
        this.renderer = null;
        this.nLost = (this.nLost ?? 0) + 1;
        const renderer = this.nLost <= MAX_LOST ? await openRenderer(renderersFor(null), this.about) : null;
        if (renderer) {
            await this.setRenderer(renderer);
            this.request();
        } else showStill("The graphics device was lost; reload the page to see it move again.");
    }

    /** The point of the surface at a point of the picture, voxel frame; null if there is none. */
    surfacePointAt(point) {
        return meshPointUnder(this.query, this.projection(), point, this.drawnLook().plane);
    }

    /** Keeps or hides the component at a point of the picture; false if there is none. */
    pick(point, isHiding) {
        this.update();
        const found = this.surfacePointAt(point);
        if (found) {
            this.selection.pick(found, isHiding);
            this.request();
        }
        return Boolean(found);
    }

    /** Adds a point of the picture to a measurement; the distance in the world after the second point, else null. */
    measure(point) {
        if (!point || this.measuredPoints.length === 2) this.measuredPoints = [];
        const found = point && this.surfacePointAt(point);
        if (found) this.measuredPoints.push(found);
        this.request();
        return this.distance();
    }

    /** The distance between two measured points in the world; null before the second one. */
    distance() {
        const [a, b] = this.measuredPoints.map((p) => this.inWorld(p));
        return b ? Math.hypot(...a.map((x, i) => x - b[i])) : null;
    }

    /** A point of the voxel frame in the world. */
    inWorld(point) {
        const mesh = { positions: Float64Array.from(point), normals: [], triangles: [] };
        return [...placeInWorld(mesh, this.spectrum.info.volume.placement).positions];
    }

    /** Shows the point of the surface under the pointer, in the world, once the pointer rests. */
    showPlace() {
        clearTimeout(this.placeTimer);
        this.panel?.showText(null);
        if (!this.pointed) return;
        this.placeTimer = setTimeout(() => {
            const found = this.pointed && this.surfacePointAt(this.pointed);
            if (!found) return;
            this.panel.slice.follow(found);
            this.panel.showText(`x, y, z: ${this.placeText(found)}${unitOf(this.spectrum.info.volume)}; value ${this.shownIsovalue()}`);
        }, REST);
    }

    /** A point of the voxel frame in the world, as text. */
    placeText(point) {
        return this.inWorld(point).map((x) => Number(x.toPrecision(4))).join(", ");
    }

    /** The events at the isovalue whose places are known. */
    events() {
        return this.panel?.plot.named.filter(({ isovalue }) => isovalue === this.isovalue) ?? [];
    }

    /** Requests a picture; several requests before the next frame give one picture. */
    request() {
        this.firstInput ??= performance.now();
        if (this.isRequested) return;
        this.isRequested = true;
        requestAnimationFrame((now) => this.frame(now));
    }

    async frame(now) {
        // While a picture is being drawn, inputs only change what the next one shows.
        if (this.isDrawing) {
            this.isWaiting = true;
            return;
        }
        this.isRequested = false;
        if (!this.renderer) return;
        this.isDrawing = true;
        const started = this.firstInput;
        this.firstInput = undefined;
        try {
            if (this.playing) this.tick(now);
            this.prepare();
            const [layers, look] = [this.layers(), this.drawnLook()];
            const preparing = this.renderer.prepare(layers, look);
            if (preparing) await preparing;
            // The device may be lost meanwhile.
            if (!this.renderer) return;
            this.renderer.draw(layers, look, this.projection());
            this.panel?.show();
            this.legend?.show(this.legendContent, this.isDark());
            this.overlay?.draw(this, this.projection());
            this.cube?.draw(this.projection().axes);
            this.onShown?.(this.isovalue);
            this.updateAtRest();
            // The device may be lost meanwhile.
            await this.renderer?.done();
            this.latency = performance.now() - started;
            this.nPictures++;
        } finally {
            this.isDrawing = false;
        }
        if (this.isWaiting) {
            this.isWaiting = false;
            requestAnimationFrame((later) => this.frame(later));
        }
    }

    /** Updates canvas, mesh and camera. */
    prepare() {
        this.resize();
        this.update();
        if (!this.isFitWanted) return;
        const { width, height } = this.canvas;
        const { volume } = this.spectrum.info;
        const { distance } = this.view;
        const points = this.isFitWanted === "now" ? this.layers().flatMap(({ query }) => query.surface.points()) : this.about.extent;
        this.isFitWanted = false;
        const fitting = fittedView(volume, points, this.camera(), width, height);
        Object.assign(this.view, fitting, { distance: distance * fitting.distance });
        this.fitted = JSON.stringify(this.view);
    }

    /** Sets the resolution of the canvas to its size on the screen. */
    resize() {
        const { clientWidth, clientHeight } = this.canvas;
        // More than two pixels per CSS pixel take time without a visible difference.
        this.pixelRatio = Math.min(window.devicePixelRatio || 1, 2);
        const size = [clientWidth, clientHeight].map((x) => Math.max(Math.round(x * this.pixelRatio), 1));
        if (this.canvas.width !== size[0]) this.canvas.width = size[0];
        if (this.canvas.height !== size[1]) this.canvas.height = size[1];
    }

    /** Updates the mesh and uploads its triangles. */
    update() {
        const started = performance.now();
        this.updateExtras();
        if (!this.query.moveTo(this.isovalue, this.look.open, this.selection) && this.isUploaded) return;
        this.updateColors();
        this.renderer.upload(this.query.surface);
        this.isUploaded = true;
        this.meshTime = performance.now() - started;
    }

    /** The further isosurfaces that are shown: all of them, once all isovalues are loaded. */
    shownExtras() {
        return this.isWhole ? this.extras : [];
    }

    /** Updates the further isosurfaces that are shown. */
    updateExtras() {
        const { largest, minVolume } = this.selection;
        this.shownExtras().forEach((extra, i) => {
            if (extra.query?.spectrum !== this.spectrum) extra.query = new Query(this.spectrum, this.about.step);
            extra.selection ??= new Selection();
            if (extra.selection.largest !== largest || extra.selection.minVolume !== minVolume) {
                extra.selection.set({ largest, minVolume });
            }
            const isSame = !extra.query.moveTo(extra.isovalue, this.look.open, extra.selection);
            // Layers are numbered by place in the list, and another isosurface may have had this place.
            if (isSame && extra.place === i && extra.renderer === this.renderer) return;
            this.renderer.upload(extra.query.surface, i + 1);
            Object.assign(extra, { place: i, renderer: this.renderer });
        });
    }

    /** The layers of the picture: its isosurfaces with their colours and opacities. */
    layers() {
        const sides = (front) => [1, 0.45].map((share) => [...linearOf(front).map((x) => share * x), 1]);
        const { color, front } = this.coloring;
        const [light, dark] = front ? sides(front) : [PLAIN_FRONT, PLAIN_BACK];
        const layers = [{
            query: this.query, front: light, backside: dark, opacity: this.opacity,
            palette: color === "none" ? PLAIN : color === "component" ? COMPONENTS : MAP,
            stops: this.legendContent?.map && stopsOf(this.legendContent.map),
        }];
        for (const { query, front: own, opacity } of this.shownExtras()) {
            const [front, backside] = sides(own);
            layers.push({ query, front, backside, opacity, palette: PLAIN });
        }
        return layers;
    }

    /** Computes the colour codes of the surface and the legend. */
    updateColors() {
        const { color, map } = this.coloring;
        const { surface } = this.query;
        surface.codes = undefined;
        this.legendContent = null;
        if (color === "component") this.legendContent = { name: "component, the largest first; from 9 on again, darker" };
        if (color === "component" || color === "none") return;
        const quantity = quantityOf(color, surface, this.about, [this.low, this.high]);
        const ends = scaleOf(quantity, this.coloring, surface);
        surface.codes = colorCodesOf(quantity, ends, surface);
        const { maps, field } = this.about;
        const defaultMap = color === "curvature" ? "vik" : color === "field" ? field.map : "viridis";
        this.legendContent = { name: quantity.name, ends, map: maps[map ?? defaultMap] };
    }

    /** Updates measures and address some time after the last change. */
    updateAtRest() {
        // The curves are those of all components.
        const measures = this.selection.isAll && this.panel?.plot.measuresAt(this.isovalue);
        const unknown = { components: null, euler: null, area: null, volume: null };
        this.panel?.showMeasures({ triangles: this.renderer.nTriangles, ...(measures || unknown) });
        clearTimeout(this.restTimer);
        this.restTimer = setTimeout(() => {
            if (this.isWhole) this.panel?.showMeasures(measuresOf(this.worldMesh(false, false)), this.query.components);
            writeAddress(this);
        }, REST);
    }

    /** The mesh at the current isovalue, in the world. */
    worldMesh(open, withNormals) {
        // The renderer does not have the new mesh.
        if (this.query.moveTo(this.isovalue, open, this.selection)) this.isUploaded = false;
        const mesh = placeInWorld(this.query.mesh(withNormals), this.spectrum.info.volume.placement);
        // The drawn mesh differs from this one in its caps.
        if (open !== this.look.open) this.isUploaded = false;
        return mesh;
    }

    /** Makes the point of the surface at a point of the picture the target; the middle of the volume if there is none. */
    recentre(point) {
        this.update();
        const { volume } = this.spectrum.info;
        const found = this.surfacePointAt(point);
        this.setView({ target: found ? targetAt(found, volume) : [0, 0, 0] });
    }

    state() {
        const { isovalue, low, high, view, look, renderer, playing, nPictures, latency, meshTime } = this;
        return {
            isovalue, low, high, view: { ...view }, ...look, occlusion: this.isOccluded(), color: this.coloring.color, ends: this.legendContent?.ends ?? null, playing, nPictures, latency, meshTime,
            renderer: renderer?.name ?? null,
            nTriangles: renderer?.nTriangles ?? 0,
            components: this.query.components ?? null,
            opacity: this.opacity,
            extras: this.extras.map(({ isovalue: c, front, opacity }) => ({ isovalue: c, front, opacity })),
            measuredPoints: this.measuredPoints,
            // Whether a picture is requested or being drawn.
            isPending: Boolean(this.isRequested || this.isDrawing),
            // Whether all isovalues are loaded.
            isWhole: this.isWhole,
        };
    }
}
