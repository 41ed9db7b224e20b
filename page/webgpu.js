// Draws on WebGPU with shaders/surface.wgsl; the twin of src/render/surface.rs.

const FRAME_BYTES = 272 + 16 * N_STOPS;
/** Words of a knot and of a triangle in the shader's tables. */
const KNOT_WORDS = 4;
const TRIANGLE_WORDS = 7;
const PLAIN_FRONT = [0.235, 0.41, 0.62, 1];
const PLAIN_BACK = [0.7, 0.37, 0.15, 1];
const PLAIN_WIRE = [0.01, 0.022, 0.045, 0.8];
const COLOURED_WIRE = [0.008, 0.008, 0.01, 0.72];

/** A number as the sum of two of single precision. */
function inTwo(x) {
    const high = Math.fround(x);
    return [high, x - high];
}

/** An isovalue on the scale where those of the spectrum cover [0, 1]. */
function scaledIsovalue({ isovalues }, isovalue) {
    const [first, last] = [isovalues[0] ?? 0, isovalues.at(-1) ?? 1];
    const share = (0.5 * isovalue - 0.5 * first) / (0.5 * last - 0.5 * first);
    return inTwo(Number.isFinite(share) ? share : 0);
}

/** The tables of the shader: scaled isovalues, first knots, knots. */
function tablesOf(spectrum, step) {
    const { firstKnot, ranks, positions } = spectrum;
    const isovalues = new Float32Array(2 * spectrum.isovalues.length);
    spectrum.isovalues.forEach((c, i) => isovalues.set(scaledIsovalue(spectrum, c), 2 * i));
    const knots = new Uint32Array(KNOT_WORDS * ranks.length);
    const numbers = new Float32Array(knots.buffer);
    for (let i = 0; i < ranks.length; i++) {
        const at = KNOT_WORDS * i;
        knots[at] = ranks[i];
        numbers[at + 1] = step * positions[3 * i];
        numbers[at + 2] = step * positions[3 * i + 1];
        numbers[at + 3] = step * positions[3 * i + 2];
    }
    return { isovalues, firstKnot, knots };
}

/** The bytes of the shader's Frame. */
function frameOf(spectrum, query, look, projection) {
    const frame = new ArrayBuffer(FRAME_BYTES);
    const numbers = new Float32Array(frame);
    numbers.set(projection.clipFromVoxel, 0);
    numbers.set(projection.eyeFromVoxel, 16);
    numbers.set(projection.eyeFromNormal, 32);
    numbers.set(look.front, 48);
    numbers.set(look.backside, 52);
    numbers.set(look.palette ? COLOURED_WIRE : PLAIN_WIRE, 56);
    numbers.set(scaledIsovalue(spectrum, query.isovalue), 60);
    const words = new Uint32Array(frame);
    words[62] = Math.max(query.active.rank, 0);
    words[63] = look.palette;
    if (look.stops) numbers.set(look.stops, 68);
    numbers[64] = look.wireframe ? look.pixelRatio : 0;
    words[65] = projection.mirrored ? 1 : 0;
    return frame;
}

class WebGpuRenderer {
    /**
     * A renderer for a canvas, still without a spectrum; throws where there is none, or not for so
     * large a spectrum as the page tells of.
     */
    static async open(canvas, about) {
        const adapter = await navigator.gpu?.requestAdapter();
        if (!adapter) throw new Error("no WebGPU adapter");
        const most = roomOf(TRIANGLE_WORDS * about.most_triangles);
        const largest = Math.max(4 * KNOT_WORDS * about.knots, 4 * most, 1 << 27);
        if (adapter.limits.maxStorageBufferBindingSize < largest) {
            throw new Error("the spectrum is too large for this adapter");
        }
        const device = await adapter.requestDevice({
            requiredLimits: {
                maxStorageBufferBindingSize: largest,
                maxBufferSize: Math.max(largest, 1 << 28),
            },
        });
        const renderer = new WebGpuRenderer(device, canvas);
        await renderer.compile();
        return renderer;
    }

    constructor(device, canvas) {
        this.name = "WebGPU";
        Object.assign(this, { device, canvas });
        this.context = canvas.getContext("webgpu");
        this.format = navigator.gpu.getPreferredCanvasFormat();
        this.pictureFormat = `${this.format}-srgb`;
        this.context.configure({
            device,
            format: this.format,
            usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_DST,
            alphaMode: "opaque",
        });
        this.triangles = new Uint32Array(4096);
    }

    async compile() {
        const { device } = this;
        const module = device.createShaderModule({
            code: document.getElementById("wgsl").textContent,
        });
        this.pipeline = await device.createRenderPipelineAsync({
            layout: "auto",
            vertex: { module, entryPoint: "surface_vertex" },
            fragment: {
                module,
                entryPoint: "surface_fragment",
                targets: [{ format: this.pictureFormat }],
            },
            primitive: { topology: "triangle-list" },
            depthStencil: { format: "depth32float", depthWriteEnabled: true, depthCompare: "less" },
            multisample: { count: 4 },
        });
    }

    /** Takes over a spectrum; throws if the device refuses it. */
    async load(spectrum, step) {
        const { device } = this;
        this.spectrum = spectrum;
        const { isovalues, firstKnot, knots } = spectrum.tables ?? tablesOf(spectrum, step);
        for (const filter of ["out-of-memory", "validation"]) device.pushErrorScope(filter);
        this.frame ??= device.createBuffer({
            size: FRAME_BYTES,
            usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST,
        });
        // Those of the spectrum before.
        for (const table of this.tables ?? []) table.destroy();
        this.tables = [isovalues, firstKnot, knots].map((table) => {
            const buffer = this.storage(table.byteLength);
            device.queue.writeBuffer(buffer, 0, table);
            return buffer;
        });
        this.listed ??= this.storage(this.triangles.byteLength);
        this.bind();
        const errors = await Promise.all([device.popErrorScope(), device.popErrorScope()]);
        for (const error of errors) if (error) throw new Error(error.message);
    }

    storage(size) {
        return this.device.createBuffer({
            size: Math.max(size, 32),
            usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST,
        });
    }

    bind() {
        const entries = [this.frame, ...this.tables, this.listed]
            .map((buffer, binding) => ({ binding, resource: { buffer } }));
        this.group = this.device.createBindGroup({
            layout: this.pipeline.getBindGroupLayout(0),
            entries,
        });
    }

    /** Takes over the triangles of a surface and the normals at their corners. */
    list({ nTriangles, corners, vertices, normals, names, codes = names }) {
        const before = this.triangles;
        this.triangles = roomFor(before, TRIANGLE_WORDS * nTriangles);
        if (this.triangles !== before) {
            this.listed.destroy();
            this.listed = this.storage(this.triangles.byteLength);
            this.bind();
        }
        const words = this.triangles;
        for (let t = 0; t < nTriangles; t++) {
            const a = corners[3 * t];
            const b = corners[3 * t + 1];
            const c = corners[3 * t + 2];
            const at = TRIANGLE_WORDS * t;
            words[at] = vertices[a];
            words[at + 1] = vertices[b];
            words[at + 2] = vertices[c];
            words[at + 3] = codes[t];
            words[at + 4] = normals[a];
            words[at + 5] = normals[b];
            words[at + 6] = normals[c];
        }
        this.nTriangles = nTriangles;
        this.device.queue.writeBuffer(this.listed, 0, words, 0, TRIANGLE_WORDS * nTriangles);
    }

    /** Draws into the canvas. */
    draw(query, look, projection) {
        const encoder = this.device.createCommandEncoder();
        this.encode(encoder, query, look, projection);
        // Copied, not resolved into an sRGB view of the canvas: SwiftShader forgets to convert there.
        encoder.copyTextureToTexture(
            { texture: this.picture },
            { texture: this.context.getCurrentTexture() },
            [this.canvas.width, this.canvas.height],
        );
        this.device.queue.submit([encoder.finish()]);
    }

    /** Textures of the canvas's size. */
    resize() {
        const { width, height } = this.canvas;
        if (this.picture?.width === width && this.picture?.height === height) return;
        for (const texture of [this.samples, this.depth, this.picture]) texture?.destroy();
        const texture = (format, sampleCount, usage) => this.device.createTexture({
            size: [width, height],
            sampleCount,
            format,
            usage: GPUTextureUsage.RENDER_ATTACHMENT | usage,
        });
        this.samples = texture(this.pictureFormat, 4, 0);
        this.depth = texture("depth32float", 4, 0);
        this.picture = texture(this.pictureFormat, 1, GPUTextureUsage.COPY_SRC);
    }

    /** Records the drawing of the picture. */
    encode(encoder, query, look, projection) {
        const { device } = this;
        this.resize();
        device.queue.writeBuffer(this.frame, 0, frameOf(this.spectrum, query, look, projection));
        const pass = encoder.beginRenderPass({
            colorAttachments: [{
                view: this.samples.createView(),
                resolveTarget: this.picture.createView(),
                clearValue: [...look.background, 1],
                loadOp: "clear",
                storeOp: "discard",
            }],
            depthStencilAttachment: {
                view: this.depth.createView(),
                depthClearValue: 1,
                depthLoadOp: "clear",
                depthStoreOp: "discard",
            },
        });
        if (this.nTriangles > 0) {
            pass.setPipeline(this.pipeline);
            pass.setBindGroup(0, this.group);
            pass.draw(3 * this.nTriangles);
        }
        pass.end();
    }

    /** Resolves when what was drawn is done. */
    done() {
        return this.device.queue.onSubmittedWorkDone();
    }

    /** Draws and reads back a picture: rows from the top, four bytes per pixel. */
    async read(query, look, projection) {
        const { device } = this;
        const { width, height } = this.canvas;
        const bytesPerRow = Math.ceil((4 * width) / 256) * 256;
        const buffer = device.createBuffer({
            size: bytesPerRow * height,
            usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ,
        });
        const encoder = device.createCommandEncoder();
        this.encode(encoder, query, look, projection);
        encoder.copyTextureToBuffer({ texture: this.picture }, { buffer, bytesPerRow }, [width, height]);
        device.queue.submit([encoder.finish()]);
        await buffer.mapAsync(GPUMapMode.READ);
        const rows = new Uint8Array(buffer.getMappedRange());
        const pixels = new Uint8ClampedArray(4 * width * height);
        for (let y = 0; y < height; y++) {
            pixels.set(rows.subarray(y * bytesPerRow, y * bytesPerRow + 4 * width), 4 * y * width);
        }
        if (this.format.startsWith("bgra")) {
            for (let i = 0; i < pixels.length; i += 4) {
                [pixels[i], pixels[i + 2]] = [pixels[i + 2], pixels[i]];
            }
        }
        buffer.destroy();
        return { width, height, pixels };
    }

    /** Calls back when the device is gone. */
    onLost(callback) {
        this.device.lost.then(({ reason }) => {
            if (reason !== "destroyed") callback();
        });
    }
}
