// The state of the scene: isovalue, view, look, further isosurfaces, sweep. Changes request a picture, which viewer.js draws.

/** The duration of a sweep by "Play" from end to end, seconds. */
const SWEEP_SECONDS = 12;
/** The number of steps of a sweep if the reader prefers reduced motion. */
const REDUCED_STEPS = 24;
/** The duration of such a step, milliseconds. */
const REDUCED_PAUSE = 700;

/** Linear colours of the background; those of src/render.rs. */
const BACKGROUNDS = { white: [1, 1, 1], light: [0.82, 0.83, 0.85], dark: [0.012, 0.013, 0.016] };

/** Positions of the main light, in the order of LAMPS in shaders/surface.wgsl. */
const LIGHTS = ["upper-left", "eye", "left", "right", "above", "below"];

/** Clamps a number to a range. */
function clamped(x, [low, high]) {
    return Math.min(Math.max(x, low), high);
}

class Scene {
    constructor(spectrum, about) {
        this.spectrum = spectrum;
        this.about = about;
        [this.low, this.high] = spectrum.info.range;
        // The isovalues that can be shown; not all until the whole spectrum is loaded.
        this.loaded = spectrum.info.range;
        this.isovalue = this.wanted = clamped(about.isovalue, this.loaded);
        this.words = about.words[spectrum.info.volume.outside];
        this.query = new Query(spectrum, about.step);
        this.selection = new Selection(about.keep);
        this.saves = new Saves(this);
        this.isWhole = true;
        this.firstView = { ...FIRST_VIEW, ...about.view };
        this.view = { ...this.firstView };
        // Whether the next picture moves the camera so that the surfaces of all isovalues ("all") or of this one ("now") fit; not if the
        // address has a view.
        this.isFitWanted = "all";
        // `occlusion` is null where it depends on the renderer.
        const { wireframe, silhouette, occlusion, light, background, clip } = about.look;
        const { open, axes, orthographic } = about;
        this.look = { wireframe, silhouette, open, axes, orthographic, occlusion, light, background, clip };
        // Further isosurfaces: { isovalue, front (six hexadecimal digits), opacity }.
        this.opacity = about.look.opacity;
        this.extras = about.look.also.map((extra) => ({ ...extra }));
        // The quantity that colours show, its map and scale, and the plain colour.
        this.coloring = { color: "none", map: null, low: null, high: null, front: about.look.front, version: 0, ...about.color };
        this.selection.isColoured = this.coloring.color === "component";
        this.speed = 1;
        this.measuredPoints = [];
        this.playing = false;
        this.prefersDark = window.matchMedia("(prefers-color-scheme: dark)");
        this.prefersReducedMotion = window.matchMedia("(prefers-reduced-motion: reduce)");
        // The number of pictures drawn, part of the public state.
        this.nPictures = 0;
    }

    /** Goes to an isovalue, or to the nearest loaded one until it is loaded. */
    setIsovalue(isovalue) {
        this.wanted = clamped(isovalue, [this.low, this.high]);
        this.isovalue = clamped(this.wanted, this.loaded);
        this.request();
    }

    /** Sets the isovalues that are loaded. */
    setLoaded(loaded, isWhole) {
        Object.assign(this, { loaded, isWhole });
        this.setIsovalue(this.wanted);
    }

    /** The ends of a sweep. */
    sweepRange() {
        return this.loaded;
    }

    /** Steps by a share of the range. */
    stepIsovalue(share) {
        this.setIsovalue(this.isovalue + share * (this.high - this.low));
    }

    setLook(look) {
        // Things at the distance of the target keep their size when the projection changes.
        const before = look.orthographic !== undefined && this.canvas && this.projection().distance;
        Object.assign(this.look, look);
        if (before) this.view.distance *= before / this.projection().distance;
        this.request();
    }

    /** Sets background, light, colour and occlusion to those of a style. */
    setStyle(name) {
        const { front, ...look } = this.about.styles[name];
        this.style = name;
        this.setLook(look);
        this.setColoring({ front });
    }

    /** Whether occlusion darkens hollows; by default it does where that is fast. */
    isOccluded() {
        return this.look.occlusion ?? Boolean(this.renderer?.isFast);
    }

    /** Looks from a side of the world. */
    lookFrom(side) {
        this.setView(viewFrom(side, this.about.basis));
    }

    /** Changes the colouring. */
    setColoring(changes) {
        Object.assign(this.coloring, changes);
        this.coloring.version++;
        const isColoured = this.coloring.color === "component";
        if (isColoured !== this.selection.isColoured) this.selection.set({ isColoured });
        this.isUploaded = false;
        this.request();
    }

    /** Whether the spectrum has the quantity of a colour. */
    canShow(color) {
        return Object.hasOwn(COLORS, color) && (color !== "field" || Boolean(this.about.field));
    }

    /** Changes which components are shown. */
    select(changes) {
        this.selection.set(changes);
        this.request();
    }

    showAll() {
        this.selection.clearPicks();
        this.select({ largest: null, minVolume: 0, minArea: 0 });
    }

    setView(view) {
        Object.assign(this.view, view);
        this.request();
    }

    rotate(azimuth, elevation) {
        this.setView({
            azimuth: (((this.view.azimuth + azimuth) % 360) + 360) % 360,
            elevation: clamped(this.view.elevation + elevation, [-90, 90]),
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

    /** Multiplies the distance of the camera. */
    zoom(factor) {
        this.setView({ distance: clamped(this.view.distance * factor, [NEAREST, FARTHEST]) });
    }

    /** Returns to the first view, in which the surfaces of all isovalues fit. */
    reset() {
        this.play(false);
        this.isFitWanted = "all";
        this.setView({ ...this.firstView });
    }

    /** Fits the surfaces of all isovalues, or those that are shown, into the picture. */
    fit(isAll) {
        this.isFitWanted = isAll ? "all" : "now";
        this.setView({ distance: 1 });
    }

    projection([width, height] = [this.canvas.width, this.canvas.height]) {
        return projectionOf(this.spectrum.info.volume, this.camera(), width, height);
    }

    /** The view with the basis of its angles and the kind of projection. */
    camera() {
        return { ...this.view, basis: this.about.basis, orthographic: this.look.orthographic };
    }

    /** Starts or stops the sweep through all isovalues, back and forth. */
    play(playing) {
        if (playing === this.playing) return;
        this.playing = playing;
        this.direction = this.isovalue < this.sweepRange()[1] ? 1 : -1;
        this.lastTick = performance.now();
        this.request();
    }

    tick(now) {
        const elapsed = now - this.lastTick;
        const isReduced = this.prefersReducedMotion.matches;
        if (!isReduced || elapsed >= REDUCED_PAUSE) {
            // After a pause, when the page was hidden, the sweep continues without a jump.
            const share = isReduced ? 1 / REDUCED_STEPS : (this.speed * Math.min(elapsed, 100)) / 1000 / SWEEP_SECONDS;
            this.lastTick = now;
            const next = this.isovalue + this.direction * share * (this.high - this.low);
            const [low, high] = this.sweepRange();
            if (next >= high || next <= low) this.direction = -this.direction;
            this.setIsovalue(next);
        }
        this.request();
    }

    /** Sets the further isosurfaces. */
    setExtras(extras) {
        this.extras = extras;
        this.request();
    }

    /** Whether the background is dark. */
    isDark() {
        const { background } = this.look;
        return background === "dark" || (background === "auto" && this.prefersDark.matches);
    }

    /** The look as the renderers read it. */
    drawnLook(projection = this.projection()) {
        const { background } = this.look;
        const backgroundColor = BACKGROUNDS[background] ?? BACKGROUNDS[this.isDark() ? "dark" : "white"];
        const { clip } = this.look;
        const plane = clip && planeOf(this.spectrum.info.volume, clip, projection);
        return { ...this.look, occlusion: this.isOccluded(), lamp: LIGHTS.indexOf(this.look.light), background: backgroundColor, plane, pixelRatio: this.pixelRatio ?? 1 };
    }

    shownIsovalue() {
        return shownIsovalue(this.isovalue, this.high - this.low);
    }
}
