// What is seen and what draws it: isovalue, view, look, sweep. Every change only says what is wanted; a
// picture is drawn when there is something new to show, and shows the latest of it.

/** The sweep that "Play" shows takes this long from end to end, seconds. */
const SWEEP_SECONDS = 12;
/** Where motion is unwelcome, a sweep goes in so many steps, each so long, milliseconds. */
const REDUCED_STEPS = 24;
const REDUCED_PAUSE = 700;
/** How long nothing may change before measures and address follow, milliseconds. */
const REST = 250;

/** How many lost devices are replaced. */
const MOST_LOST = 3;

/** Linear colours behind the surface; those of src/render.rs. */
const BACKGROUNDS = { white: [1, 1, 1], light: [0.82, 0.83, 0.85], dark: [0.012, 0.013, 0.016] };

class Viewer {
    constructor(spectrum, about) {
        this.spectrum = spectrum;
        this.about = about;
        [this.low, this.high] = spectrum.info.range;
        this.isovalue = Math.min(Math.max(about.isovalue, this.low), this.high);
        this.query = new Query(spectrum, about.step);
        this.selection = new Selection(about.keep);
        this.saves = new Saves(this);
        // Until the whole spectrum is there, only isovalues around the first one are.
        this.isWhole = true;
        this.view = { ...FIRST_VIEW, ...about.view };
        // Whether the next picture is to fit the surface; where the address says how to look, it does not.
        this.isFitWanted = true;
        this.look = {
            wireframe: about.look.wireframe, open: about.open, axes: Boolean(about.axes), orthographic: about.orthographic,
            occlusion: about.look.occlusion, background: about.look.background ?? "auto", clip: about.look.clip,
        };
        // Other isosurfaces beside that of the slider: { isovalue, front (six digits), opacity }.
        this.opacity = about.look.opacity;
        this.extras = about.look.also.map((extra) => ({ ...extra }));
        // What the colours show, and how.
        this.coloring = { color: "none", map: null, low: null, high: null, front: about.look.front, version: 0, ...about.color };
        this.selection.isColoured = this.coloring.color === "component";
        this.firstView = { ...FIRST_VIEW, ...about.view };
        this.speed = 1;
        this.measuredPoints = [];
        this.playing = false;
        this.darkness = window.matchMedia("(prefers-color-scheme: dark)");
        this.stillness = window.matchMedia("(prefers-reduced-motion: reduce)");
        this.darkness.addEventListener("change", () => this.request());
        // Pictures drawn, and what the last one took from input to done, for tests and the curious.
        this.nPictures = 0;
    }

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

    /** Takes over the whole spectrum. */
    async takeWhole(spectrum) {
        this.spectrum = spectrum;
        this.query = new Query(spectrum, this.about.step);
        this.selection.forget();
        this.isWhole = true;
        this.isListed = false;
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

    setIsovalue(isovalue) {
        this.isovalue = Math.min(Math.max(isovalue, this.low), this.high);
        this.request();
    }

    /** Steps by a share of the range. */
    stepIsovalue(share) {
        this.setIsovalue(this.isovalue + share * (this.high - this.low));
    }

    setLook(look) {
        // What lies as far as the point looked at keeps its size.
        const sizes = look.orthographic !== undefined && this.canvas ? [this.projection().distance] : [];
        Object.assign(this.look, look);
        if (sizes.length > 0) this.view.distance *= sizes[0] / this.projection().distance;
        this.request();
    }

    /** Looks from a side of the world, upright. */
    lookFrom(side) {
        this.setView(viewFrom(side, this.about.basis));
    }

    /** Changes what the colours show, and how. */
    setColoring(changes) {
        Object.assign(this.coloring, changes);
        this.coloring.version++;
        const isColoured = this.coloring.color === "component";
        if (isColoured !== this.selection.isColoured) this.selection.set({ isColoured });
        this.isListed = false;
        this.request();
    }

    /** Whether there is what a colour shows. */
    canShow(color) {
        return Object.hasOwn(COLORS, color) && (color !== "field" || Boolean(this.about.field));
    }

    /** Changes which components are shown. */
    select(changes) {
        this.selection.set(changes);
        this.request();
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
        const [a, b] = this.measuredPoints;
        const { spacing } = this.spectrum.info.volume.placement;
        return b ? Math.min(...spacing) * Math.hypot(...a.map((x, i) => x - b[i])) : null;
    }

    /** Soon after the pointer rests on the surface, says where that is in the world. */
    tellPlace() {
        clearTimeout(this.telling);
        this.panel?.readOut(null);
        if (!this.pointed) return;
        this.telling = setTimeout(() => {
            const found = this.pointed && this.under(this.pointed);
            if (!found) return;
            const mesh = { positions: Float64Array.from(found), normals: [], triangles: [] };
            const { positions } = placeInWorld(mesh, this.spectrum.info.volume.placement);
            const place = [...positions].map((x) => Number(x.toPrecision(5))).join(", ");
            this.panel.readOut(`x, y, z: ${place}${unitOf(this.spectrum.info.volume)}; value ${this.shownIsovalue()}`);
        }, REST);
    }

    showAll() {
        this.selection.showPicked();
        this.select({ largest: null, minVolume: 0, minArea: 0 });
    }

    setView(view) {
        Object.assign(this.view, view);
        this.request();
    }

    rotate(azimuth, elevation) {
        this.setView({
            azimuth: (((this.view.azimuth + azimuth) % 360) + 360) % 360,
            elevation: Math.min(Math.max(this.view.elevation + elevation, -90), 90),
        });
    }

    /** Moves the volume by CSS pixels to the right and down. */
    move(dx, dy) {
        const { axes, distance } = this.projection();
        const voxels = (2 * Math.tan(0.5 * FIELD_OF_VIEW) * distance) / this.canvas.clientHeight;
        const { target } = this.view;
        this.setView({
            target: target.map((x, i) => x + voxels * (dy * axes[1][i] - dx * axes[0][i])),
        });
    }

    /** Multiplies the distance. */
    zoom(factor) {
        const distance = Math.min(Math.max(this.view.distance * factor, NEAREST), FARTHEST);
        this.setView({ distance });
    }

    /** Looks at the point of the mesh under a point of the picture; else at the middle. */
    recentre(point) {
        this.update();
        const { volume } = this.spectrum.info;
        const target = pointUnder(this.under(point), volume);
        this.setView({ target: target ?? [0, 0, 0] });
    }

    /** Back to where the volume is seen from at first, as near as fits the surface that is shown. */
    reset() {
        this.play(false);
        this.isFitWanted = true;
        this.setView({ ...this.firstView });
    }

    projection([width, height] = [this.canvas.width, this.canvas.height]) {
        return projectionOf(this.spectrum.info.volume, this.based(), width, height);
    }

    /** The view, what its angles count from, which the author chose, and whether sight is parallel. */
    based() {
        return { ...this.view, basis: this.about.basis, orthographic: this.look.orthographic };
    }

    /** Starts or stops the sweep through all isovalues, to and fro. */
    play(playing) {
        if (playing === this.playing) return;
        this.playing = playing;
        this.direction = this.isovalue < this.high ? 1 : -1;
        this.lastTick = performance.now();
        this.request();
    }

    tick(now) {
        const elapsed = now - this.lastTick;
        const isStill = this.stillness.matches;
        if (!isStill || elapsed >= REDUCED_PAUSE) {
            // After a pause (a hidden page) the sweep goes on where it was.
            const share = isStill ? 1 / REDUCED_STEPS : (this.speed * Math.min(elapsed, 100)) / 1000 / SWEEP_SECONDS;
            this.lastTick = now;
            let next = this.isovalue + this.direction * share * (this.high - this.low);
            if (next >= this.high || next <= this.low) this.direction = -this.direction;
            next = Math.min(Math.max(next, this.low), this.high);
            this.isovalue = next;
        }
        this.request();
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
        const isovalue = this.isWhole ? this.isovalue : this.nearestThere();
        const started = performance.now();
        this.updateExtras();
        if (!this.query.moveTo(isovalue, this.look.open, this.selection) && this.isListed) return;
        this.colour();
        this.renderer.list(this.query.surface);
        this.isListed = true;
        this.meshTime = performance.now() - started;
    }

    /** The isovalue nearest to the wanted one of those that are there before all others. */
    nearestThere() {
        const [low, high] = this.about.first;
        return Math.min(Math.max(this.isovalue, low), high);
    }

    /** Shows other isosurfaces, too. */
    setExtras(extras) {
        this.extras = extras;
        this.request();
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
        const ends = scaleOf(numbers, this.coloring);
        surface.codes = codesOfNumbers(numbers, ends, surface);
        const { maps, field } = this.about;
        const usual = color === "curvature" ? "vik" : color === "field" ? field.map : "viridis";
        this.shown = { name: numbers.name, ends, map: maps[map ?? usual] };
    }

    /** Whether what lies behind the surface is dark. */
    isDark() {
        const { background } = this.look;
        return background === "dark" || (background === "auto" && this.darkness.matches);
    }

    looked(projection = this.projection()) {
        const { background } = this.look;
        const behind = BACKGROUNDS[background] ?? BACKGROUNDS[this.isDark() ? "dark" : "white"];
        const { clip } = this.look;
        const plane = clip && planeOf(this.spectrum.info.volume, clip, projection);
        return { ...this.look, background: behind, plane, pixelRatio: this.pixelRatio ?? 1 };
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

    shownIsovalue() {
        return shownIsovalue(this.isovalue, this.high - this.low);
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
