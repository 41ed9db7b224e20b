// Draws what is seen, and tells what is drawn: a picture is drawn when there is something new to show, and shows the latest of it.

/** How long nothing may change before measures and address follow, milliseconds. */
const REST = 250;

/** How many lost devices are replaced. */
const MOST_LOST = 3;

class Viewer extends Scene {
    /** Draws with a renderer, which takes the place of what was in the page. */
    async use(renderer) {
        await renderer.load(this.spectrum, this.about.step);
        byId("canvas").replaceWith(renderer.canvas);
        this.renderer = renderer;
        this.canvas = renderer.canvas;
        this.isListed = false;
        renderer.onLost(() => this.recover());
        followPointers(this.canvas, this);
        new ResizeObserver(() => this.request()).observe(this.canvas);
        document.documentElement.dataset.renderer = renderer.name;
    }

    /** Takes over a spectrum with more isovalues: the whole one, if those are not told. */
    async takeWhole(spectrum, there = [this.low, this.high]) {
        this.spectrum = spectrum;
        this.query = new Query(spectrum, this.about.step);
        this.selection.forget();
        this.isListed = false;
        this.limit(there, true);
        // The isosurfaces beside the first are to fit, too, unless the reader looks from elsewhere by now.
        if (this.extras.length > 0 && this.fitted === JSON.stringify(this.view)) {
            Object.assign(this.view, this.firstView);
            this.isFitWanted = true;
        }
        // The device may be lost just now; who brings it back takes over the whole, too.
        const { renderer } = this;
        try {
            await renderer?.load(spectrum, this.about.step);
            // The device has them; another one would be given new ones.
            delete spectrum.tables;
        } catch (error) {
            this.renderer = null;
            await drawOtherwise(this, renderer, error);
        }
        this.request();
    }

    /** The device is gone: another may be there, else the still picture. */
    async recover() {
        this.renderer = null;
        this.nLost = (this.nLost ?? 0) + 1;
        const renderer = this.nLost <= MOST_LOST ? await openRenderer(renderersFor(null), this.about) : null;
        if (renderer) {
            await this.use(renderer);
            this.request();
        } else showStill("The graphics device was lost; reload the page to see it move again.");
    }

    /** The point of the surface under a point of the picture, voxel frame; null beside it. */
    under(point) {
        return meshPointUnder(this.query, this.projection(), point, this.looked().plane);
    }

    /** Keeps the part under a point of the picture alone, or hides it; whether there is one. */
    pick(point, isHiding) {
        this.update();
        const found = this.under(point);
        if (found) {
            this.selection.pick(found, isHiding);
            this.request();
        }
        return Boolean(found);
    }

    /** Measures from point to point of the surface: the distance in the world once there are two, else null. */
    measure(point) {
        if (!point || this.measuredPoints.length === 2) this.measuredPoints = [];
        const found = point && this.under(point);
        if (found) this.measuredPoints.push(found);
        this.request();
        const [a, b] = this.measuredPoints.map((p) => this.inWorld(p));
        return b ? Math.hypot(...a.map((x, i) => x - b[i])) : null;
    }

    /** A point of the voxel frame in the world. */
    inWorld(point) {
        const mesh = { positions: Float64Array.from(point), normals: [], triangles: [] };
        return [...placeInWorld(mesh, this.spectrum.info.volume.placement).positions];
    }

    /** Soon after the pointer rests on the surface, says where that is in the world. */
    tellPlace() {
        clearTimeout(this.telling);
        this.panel?.readOut(null);
        if (!this.pointed) return;
        this.telling = setTimeout(() => {
            const found = this.pointed && this.under(this.pointed);
            if (!found) return;
            const place = this.inWorld(found).map((x) => Number(x.toPrecision(5))).join(", ");
            this.panel.readOut(`x, y, z: ${place}${unitOf(this.spectrum.info.volume)}; value ${this.shownIsovalue()}`);
        }, REST);
    }

    /** Asks for a picture of what is wanted by then; any number of calls make one. */
    request() {
        this.firstInput ??= performance.now();
        if (this.isRequested) return;
        this.isRequested = true;
        requestAnimationFrame((now) => this.frame(now));
    }

    async frame(now) {
        // While a picture is in work, inputs only change what the next one shows.
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
            const [layers, look] = [this.layers(), this.looked()];
            const preparing = this.renderer.prepare(layers, look);
            if (preparing) await preparing;
            // The device may be lost meanwhile.
            if (!this.renderer) return;
            this.renderer.draw(layers, look, this.projection());
            this.panel?.show();
            this.legend?.show(this.shown, this.isDark());
            this.overlay?.draw(this, this.projection());
            this.cube?.draw(this.projection().axes);
            this.onShown?.(this.isovalue);
            this.rest();
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

    /** Brings canvas, mesh and view to what is wanted. */
    prepare() {
        this.resize();
        this.update();
        if (!this.isFitWanted) return;
        this.isFitWanted = false;
        const { width, height } = this.canvas;
        const { volume } = this.spectrum.info;
        const { distance } = this.view;
        const fitting = fitOf(volume, boxAround(this.layers().map(({ query }) => query.surface.box())), this.based(), width, height);
        Object.assign(this.view, fitting, { distance: distance * fitting.distance });
        this.fitted = JSON.stringify(this.view);
    }

    /** Gives the canvas as many pixels as it covers. */
    resize() {
        const { clientWidth, clientHeight } = this.canvas;
        // More than two pixels per CSS pixel are not seen, but paid for.
        this.pixelRatio = Math.min(window.devicePixelRatio || 1, 2);
        const size = [clientWidth, clientHeight].map((x) => Math.max(Math.round(x * this.pixelRatio), 1));
        if (this.canvas.width !== size[0]) this.canvas.width = size[0];
        if (this.canvas.height !== size[1]) this.canvas.height = size[1];
    }

    /** Brings the mesh and the renderer's list of it to the isovalue. */
    update() {
        const started = performance.now();
        this.updateExtras();
        if (!this.query.moveTo(this.isovalue, this.look.open, this.selection) && this.isListed) return;
        this.colour();
        this.renderer.list(this.query.surface);
        this.isListed = true;
        this.meshTime = performance.now() - started;
    }

    /** Brings the other isosurfaces to what is wanted; they are there once all isovalues are. */
    updateExtras() {
        if (!this.isWhole) return;
        const { largest, minVolume } = this.selection;
        this.extras.forEach((extra, i) => {
            if (extra.query?.spectrum !== this.spectrum) extra.query = new Query(this.spectrum, this.about.step);
            extra.selection ??= new Selection();
            if (extra.selection.largest !== largest || extra.selection.minVolume !== minVolume) {
                extra.selection.set({ largest, minVolume });
            }
            const isSame = !extra.query.moveTo(extra.isovalue, this.look.open, extra.selection);
            // Layers go by their place, which another may have had.
            if (isSame && extra.place === i && extra.renderer === this.renderer) return;
            this.renderer.list(extra.query.surface, i + 1);
            Object.assign(extra, { place: i, renderer: this.renderer });
        });
    }

    /** The isosurfaces of the picture, each with how it looks. */
    layers() {
        const sides = (front) => [1, 0.45].map((share) => [...linearOf(front).map((x) => share * x), 1]);
        const { color, front } = this.coloring;
        const [light, dark] = front ? sides(front) : [PLAIN_FRONT, PLAIN_BACK];
        const layers = [{
            query: this.query, front: light, backside: dark, opacity: this.opacity,
            palette: color === "none" ? PLAIN : color === "component" ? NAMES : MAP,
            stops: this.shown?.map && stopsOf(this.shown.map),
        }];
        for (const { query, front: own, opacity } of this.isWhole ? this.extras : []) {
            const [front, backside] = sides(own);
            layers.push({ query, front, backside, opacity, palette: PLAIN });
        }
        return layers;
    }

    /** Finds what the colours show of the surface. */
    colour() {
        const { color, map } = this.coloring;
        const { surface } = this.query;
        surface.codes = undefined;
        this.shown = null;
        if (color === "component") this.shown = { name: "component, the largest first" };
        if (color === "component" || color === "none") return;
        const numbers = numbersOf(color, surface, this.about, [this.low, this.high]);
        const ends = scaleOf(numbers, this.coloring, surface);
        surface.codes = codesOfNumbers(numbers, ends, surface);
        const { maps, field } = this.about;
        const usual = color === "curvature" ? "vik" : color === "field" ? field.map : "viridis";
        this.shown = { name: numbers.name, ends, map: maps[map ?? usual] };
    }

    /** Soon after the last change: what takes longer than a picture. */
    rest() {
        this.panel?.showMeasures({
            triangles: this.renderer.nTriangles, components: null, euler: null, area: null, volume: null,
        });
        clearTimeout(this.resting);
        this.resting = setTimeout(() => {
            if (this.isWhole) this.panel?.showMeasures(measured(this.worldMesh(false, false)), this.query.components);
            writeAddress(this);
        }, REST);
    }

    /** The mesh at the present isovalue, in the world. */
    worldMesh(open, withNormals) {
        // The renderer has not seen what this may have changed.
        if (this.query.moveTo(this.isovalue, open, this.selection)) this.isListed = false;
        const mesh = placeInWorld(this.query.mesh(withNormals), this.spectrum.info.volume.placement);
        // What is drawn may have caps where this has none.
        if (open !== this.look.open) this.isListed = false;
        return mesh;
    }

    /** Looks at the point of the mesh under a point of the picture; else at the middle. */
    recentre(point) {
        this.update();
        const { volume } = this.spectrum.info;
        const target = pointUnder(this.under(point), volume);
        this.setView({ target: target ?? [0, 0, 0] });
    }

    state() {
        const { isovalue, low, high, view, look, renderer, playing, nPictures, latency, meshTime } = this;
        return {
            isovalue, low, high, view: { ...view }, ...look, color: this.coloring.color, ends: this.shown?.ends ?? null, playing, nPictures, latency, meshTime,
            renderer: renderer?.name ?? null,
            nTriangles: renderer?.nTriangles ?? 0,
            components: this.query.components ?? null,
            opacity: this.opacity,
            extras: this.extras.map(({ isovalue: c, front, opacity }) => ({ isovalue: c, front, opacity })),
            measuredPoints: this.measuredPoints,
            // Whether a picture is wanted or in work.
            isPending: Boolean(this.isRequested || this.isDrawing),
            // Whether all isovalues can be shown by now.
            isWhole: this.isWhole,
        };
    }
}
