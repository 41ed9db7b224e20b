// What is seen: isovalue, view, look, other isosurfaces, sweep. Every change only says what is wanted; viewer.js draws it.

/** The sweep that "Play" shows takes this long from end to end, seconds. */
const SWEEP_SECONDS = 12;
/** Where motion is unwelcome, a sweep goes in so many steps, each so long, milliseconds. */
const REDUCED_STEPS = 24;
const REDUCED_PAUSE = 700;

/** Linear colours behind the surface; those of src/render.rs. */
const BACKGROUNDS = { white: [1, 1, 1], light: [0.82, 0.83, 0.85], dark: [0.012, 0.013, 0.016] };

/** Where the main light may be; the order of LAMPS in shaders/surface.wgsl. */
const LIGHTS = ["upper-left", "eye", "left", "right", "above", "below"];

/** A number between two. */
function clamped(x, [low, high]) {
    return Math.min(Math.max(x, low), high);
}

class Scene {
    constructor(spectrum, about) {
        this.spectrum = spectrum;
        this.about = about;
        [this.low, this.high] = spectrum.info.range;
        // Until the whole spectrum is there, only isovalues around the first one are.
        this.there = spectrum.info.range;
        this.isovalue = this.wanted = clamped(about.isovalue, this.there);
        this.query = new Query(spectrum, about.step);
        this.selection = new Selection(about.keep);
        this.saves = new Saves(this);
        this.isWhole = true;
        this.view = { ...FIRST_VIEW, ...about.view };
        // Whether the next picture is to fit the surface; where the address says how to look, it does not.
        this.isFitWanted = true;
        this.look = {
            wireframe: about.look.wireframe, open: about.open, axes: Boolean(about.axes), orthographic: about.orthographic,
            occlusion: about.look.occlusion, light: about.look.light, background: about.look.background ?? "auto", clip: about.look.clip,
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

    /** Goes to an isovalue, as far as it is there; what was wanted last is seen once it is. */
    setIsovalue(isovalue) {
        this.wanted = clamped(isovalue, [this.low, this.high]);
        this.isovalue = clamped(this.wanted, this.there);
        this.request();
    }

    /** Limits isovalues to what is there. */
    limit(there, isWhole) {
        Object.assign(this, { there, isWhole });
        this.setIsovalue(this.wanted);
    }

    /** The isovalues that a sweep goes through. */
    reach() {
        return this.there;
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

    /** Multiplies the distance. */
    zoom(factor) {
        this.setView({ distance: clamped(this.view.distance * factor, [NEAREST, FARTHEST]) });
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
        this.direction = this.isovalue < this.reach()[1] ? 1 : -1;
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
            const next = this.isovalue + this.direction * share * (this.high - this.low);
            const [low, high] = this.reach();
            if (next >= high || next <= low) this.direction = -this.direction;
            this.setIsovalue(next);
        }
        this.request();
    }

    /** Shows other isosurfaces, too. */
    setExtras(extras) {
        this.extras = extras;
        this.request();
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
        return { ...this.look, lamp: LIGHTS.indexOf(this.look.light), background: behind, plane, pixelRatio: this.pixelRatio ?? 1 };
    }

    shownIsovalue() {
        return shownIsovalue(this.isovalue, this.high - this.low);
    }
}
