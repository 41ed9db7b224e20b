// Draws on WebGPU with shaders/surface.wgsl; the twin of src/render/painter.rs.

const UNIFORM_BYTES = 272 + 16 * N_STOPS;
/** 32-bit words of a knot and of a triangle in the shader's tables. */
const KNOT_WORDS = 4;
const TRIANGLE_WORDS = 7;
/** With a stencil, which finds where a clip plane is inside a surface. */
const DEPTH_FORMAT = "depth24plus-stencil8";
const PLAIN_FRONT = [0.17, 0.49, 0.47, 1];
const PLAIN_BACK = [0.72, 0.29, 0.16, 1];
const PLAIN_WIRE = [0.01, 0.022, 0.045, 0.8];
const COLOURED_WIRE = [0.008, 0.008, 0.01, 0.72];

/** The width of silhouettes, CSS pixels. */
const SILHOUETTE = 1.5;

/** A number as the sum of two of single precision. */
function splitInTwo(x) {
    const high = Math.fround(x);
    return [high, x - high];
}

/** An isovalue, scaled so that those of the spectrum cover [0, 1], as two numbers of single precision. */
function scaledIsovalue({ isovalues }, isovalue) {
    const [first, last] = [isovalues[0] ?? 0, isovalues.at(-1) ?? 1];
    const share = (0.5 * isovalue - 0.5 * first) / (0.5 * last - 0.5 * first);
    return splitInTwo(Number.isFinite(share) ? share : 0);
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

/** Bytes of the shader's Cut. */
const CUT_BYTES = 48;

/** The numbers of the shader's Cut. */
function cutOf({ opacity }, { plane }, projection) {
    return new Float32Array([
        ...(plane ?? [0, 0, 0, 1]), opacity, 0, ...projection.depth, ...projection.halfExtent, 0, 0,
    ]);
}

/** The layers in drawing order: opaque ones, then transparent ones; inner ones (of a higher isovalue) first. */
function drawingOrder(layers) {
    return [...layers.keys()].sort((i, j) => {
        const [a, b] = [layers[i], layers[j]];
        return (a.opacity < 1) - (b.opacity < 1) || b.query.isovalue - a.query.isovalue;
    });
}

/** The bytes of the shader's SurfaceUniforms. */
function surfaceUniforms(spectrum, { query, front, backside, palette, stops }, look, projection) {
    const uniforms = new ArrayBuffer(UNIFORM_BYTES);
    const numbers = new Float32Array(uniforms);
    numbers.set(projection.clipFromVoxel, 0);
    numbers.set(projection.eyeFromVoxel, 16);
    numbers.set(projection.eyeFromNormal, 32);
    numbers.set(front, 48);
    numbers[51] = look.silhouette ? SILHOUETTE * look.pixelRatio : 0;
    numbers.set(insideOf(backside, look), 52);
    numbers.set(palette ? COLOURED_WIRE : PLAIN_WIRE, 56);
    numbers.set(scaledIsovalue(spectrum, query.isovalue), 60);
    const words = new Uint32Array(uniforms);
    words[62] = Math.max(query.active.rank, 0);
    words[63] = palette;
    if (stops) numbers.set(stops, 68);
    numbers[64] = look.wireframe ? look.pixelRatio : 0;
    words[65] = projection.mirrored ? 1 : 0;
    words[66] = projection.isParallel ? 1 : 0;
    words[67] = look.lamp;
    return uniforms;
}

/** The colour of the inner side; the last number is 1 where that side cannot be seen. */
function insideOf([r, g, b], { open, plane }) {
    return [r, g, b, open || plane ? 0 : 1];
}

class WebGpuRenderer {
    /** Opens a renderer without a spectrum; throws if there is no WebGPU, or the spectrum described by `about` is too large. */
    static async open(canvas, about) {
        const adapter = await navigator.gpu?.requestAdapter();
        if (!adapter) throw new Error("no WebGPU adapter");
        const nWords = capacityFor(TRIANGLE_WORDS * about.max_triangles);
        const largest = Math.max(4 * KNOT_WORDS * about.knots, 4 * nWords, 1 << 27);
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
        // Older browsers have it in the adapter.
        const { description, isFallbackAdapter = adapter.isFallbackAdapter } = adapter.info ?? {};
        renderer.isFast = !(isFallbackAdapter || /swiftshader|llvmpipe/i.test(description));
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
        this.layers = [];
    }

    async compile() {
        const { device } = this;
        const text = (id) => byId(id).textContent;
        const module = device.createShaderModule({ code: text("wgsl") });
        const cut = device.createShaderModule({ code: text("wgsl") + text("cut-wgsl") });
        const [vertex, fragment, all] = [1, 2, 3];
        const buffers = [[all, "uniform"], ...Array(4).fill([vertex, "read-only-storage"]), [fragment, "uniform"]];
        this.layout = device.createBindGroupLayout({
            entries: buffers.map(([visibility, type], binding) => ({ binding, visibility, buffer: { type } })),
        });
        const layout = device.createPipelineLayout({ bindGroupLayouts: [this.layout] });
        const over = { srcFactor: "one", dstFactor: "one-minus-src-alpha" };
        const pipeline = (code, vertexEntry, fragmentEntry, target, depthStencil) => device.createRenderPipelineAsync({
            layout,
            vertex: { module: code, entryPoint: vertexEntry },
            fragment: { module: code, entryPoint: fragmentEntry, targets: [{ format: this.pictureFormat, ...target }] },
            primitive: { topology: "triangle-list" },
            depthStencil: { format: DEPTH_FORMAT, depthWriteEnabled: true, depthCompare: "less", ...depthStencil },
            multisample: { count: 4 },
        });
        this.uncut = await pipeline(module, "surface_vertex", "surface_fragment", {}, {});
        // The others are compiled on demand: compiling takes as long as drawing a picture.
        const blended = { blend: { color: over, alpha: over } };
        const surface = (...rest) => pipeline(cut, "surface_vertex", ...rest);
        const reset = { compare: "not-equal", failOp: "keep", depthFailOp: "zero", passOp: "zero" };
        const capping = { stencilFront: reset, stencilBack: reset };
        this.compileCutPipelines = async () => {
            const made = {
                clipped: surface("cut_fragment", {}, {}),
                transparent: surface("cut_fragment", blended, { depthWriteEnabled: false }),
                count: surface("depth_only_fragment", { writeMask: 0 }, {
                    depthWriteEnabled: false, depthCompare: "always",
                    stencilFront: { compare: "always", passOp: "decrement-wrap" },
                    stencilBack: { compare: "always", passOp: "increment-wrap" },
                }),
                cap: pipeline(cut, "cap_vertex", "cap_fragment", blended, capping),
            };
            for (const [name, promise] of Object.entries(made)) made[name] = await promise;
            this.cutPipelines = made;
        };
    }

    /** Compiles what plain pictures do not need; a promise, or null if nothing is missing. */
    prepare(layers, { plane, occlusion }) {
        const isCut = plane || layers.some(({ opacity }) => opacity < 1);
        const cutting = isCut && !this.cutPipelines ? (this.preparing ??= this.compileCutPipelines()) : null;
        const darkening = occlusion && !this.occlusion ? (this.preparingOcclusion ??= this.compileOcclusion()) : null;
        return cutting && darkening ? cutting.then(() => darkening) : cutting ?? darkening;
    }

    async compileOcclusion() {
        this.occlusion = await WebGpuOcclusion.compile(this.device, this.pictureFormat);
    }

    /** The greatest width and height of a picture, pixels. */
    get largest() {
        return this.device.limits.maxTextureDimension2D;
    }

    /** Uploads a spectrum; throws if the device refuses it. */
    async load(spectrum, step) {
        const { device } = this;
        this.spectrum = spectrum;
        const { isovalues, firstKnot, knots } = spectrum.tables ?? tablesOf(spectrum, step);
        for (const filter of ["out-of-memory", "validation"]) device.pushErrorScope(filter);
        // Tables of the previous spectrum.
        for (const table of this.tables ?? []) table.destroy();
        this.tables = [isovalues, firstKnot, knots].map((table) => {
            const buffer = this.storage(table.byteLength);
            device.queue.writeBuffer(buffer, 0, table);
            return buffer;
        });
        for (const layer of this.layers) this.bind(layer);
        const errors = await Promise.all([device.popErrorScope(), device.popErrorScope()]);
        for (const error of errors) if (error) throw new Error(error.message);
    }

    storage(size, usage = GPUBufferUsage.STORAGE) {
        return this.device.createBuffer({ size: Math.max(size, 32), usage: usage | GPUBufferUsage.COPY_DST });
    }

    bind(layer) {
        const entries = [layer.uniforms, ...this.tables, layer.buffer, layer.cut]
            .map((buffer, binding) => ({ binding, resource: { buffer } }));
        layer.group = this.device.createBindGroup({ layout: this.layout, entries });
    }

    /** The buffers of a layer. */
    layer(i) {
        const uniform = (size) => this.device.createBuffer({
            size, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST,
        });
        while (this.layers.length <= i) {
            const triangles = new Uint32Array(4096);
            const buffer = this.storage(triangles.byteLength);
            const layer = { uniforms: uniform(UNIFORM_BYTES), cut: uniform(CUT_BYTES), triangles, buffer, nTriangles: 0 };
            this.bind(layer);
            this.layers.push(layer);
        }
        return this.layers[i];
    }

    /** Uploads the order of a layer's corners. */
    uploadOrder(layer, indices) {
        if (!(layer.indices?.size >= indices.byteLength)) {
            layer.indices?.destroy();
            layer.indices = this.storage(4 * capacityFor(indices.length), GPUBufferUsage.INDEX);
        }
        this.device.queue.writeBuffer(layer.indices, 0, indices);
    }

    /** The number of triangles of the first layer. */
    get nTriangles() {
        return this.layers[0]?.nTriangles ?? 0;
    }

    /** Uploads the triangles of layer i and the normals at their corners. */
    upload({ nTriangles, corners, vertices, normals, components, codes = components }, i = 0) {
        const layer = this.layer(i);
        const before = layer.triangles;
        layer.triangles = withCapacity(before, TRIANGLE_WORDS * nTriangles);
        if (layer.triangles !== before) {
            layer.buffer.destroy();
            layer.buffer = this.storage(layer.triangles.byteLength);
            this.bind(layer);
        }
        const words = layer.triangles;
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
        layer.nTriangles = nTriangles;
        this.device.queue.writeBuffer(layer.buffer, 0, words, 0, TRIANGLE_WORDS * nTriangles);
    }

    /** Draws into the canvas. */
    draw(layers, look, projection) {
        const encoder = this.device.createCommandEncoder();
        const size = [this.canvas.width, this.canvas.height];
        this.encode(encoder, layers, look, projection, size);
        // Copied, not resolved into an sRGB view of the canvas, which SwiftShader does not convert.
        encoder.copyTextureToTexture(
            { texture: this.picture },
            { texture: this.context.getCurrentTexture() },
            size,
        );
        this.device.queue.submit([encoder.finish()]);
    }

    /** Makes textures of the picture's size. */
    resize([width, height]) {
        if (this.picture?.width === width && this.picture?.height === height) return;
        for (const texture of [this.samples, this.depth, this.picture]) texture?.destroy();
        const texture = (format, sampleCount, usage) => this.device.createTexture({
            size: [width, height],
            sampleCount,
            format,
            usage: GPUTextureUsage.RENDER_ATTACHMENT | usage,
        });
        this.samples = texture(this.pictureFormat, 4, 0);
        this.depth = texture(DEPTH_FORMAT, 4, GPUTextureUsage.TEXTURE_BINDING);
        this.picture = texture(this.pictureFormat, 1, GPUTextureUsage.COPY_SRC);
    }

    /** Records the drawing of a picture. */
    encode(encoder, layers, look, projection, size) {
        this.resize(size);
        const order = drawingOrder(layers);
        const nOpaque = layers.filter(({ opacity }) => opacity === 1).length;
        if (!look.occlusion || !this.occlusion || nOpaque === 0) {
            this.encodeLayers(encoder, order, layers, look, projection, true, true);
            return;
        }
        // Transparent layers are draw over the occlusion of the opaque ones.
        this.encodeLayers(encoder, order.slice(0, nOpaque), layers, look, projection, true, false);
        this.occlusion.encode(encoder, this, projection);
        if (nOpaque < layers.length) {
            this.encodeLayers(encoder, order.slice(nOpaque), layers, look, projection, false, true);
        }
    }

    /** Records the drawing of the layers in `order`, in the first or the last pass of a picture. */
    encodeLayers(encoder, order, layers, look, projection, isFirst, isLast) {
        const { device } = this;
        const [loadOp, storeOp] = [isFirst ? "clear" : "load", isLast ? "discard" : "store"];
        const pass = encoder.beginRenderPass({
            colorAttachments: [{
                view: this.samples.createView(),
                resolveTarget: this.picture.createView(),
                clearValue: [...look.background, look.isTransparent ? 0 : 1],
                loadOp,
                storeOp,
            }],
            depthStencilAttachment: {
                view: this.depth.createView(),
                depthClearValue: 1,
                depthLoadOp: loadOp,
                depthStoreOp: storeOp,
                stencilClearValue: 0,
                stencilLoadOp: loadOp,
                stencilStoreOp: storeOp,
            },
        });
        for (const i of order) {
            const { uniforms, cut } = this.layer(i);
            device.queue.writeBuffer(uniforms, 0, surfaceUniforms(this.spectrum, layers[i], look, projection));
            device.queue.writeBuffer(cut, 0, cutOf(layers[i], look, projection));
        }
        const choose = (i, pipeline) => {
            pass.setBindGroup(0, this.layer(i).group);
            pass.setPipeline(pipeline);
        };
        const draw = (i, pipeline, n = 3 * this.layer(i).nTriangles) => {
            choose(i, pipeline);
            pass.draw(n);
        };
        const cap = (i) => {
            if (!look.plane || look.open) return;
            draw(i, this.cutPipelines.count);
            draw(i, this.cutPipelines.cap, 3);
        };
        const clear = order.filter((i) => layers[i].opacity < 1);
        for (const i of order.slice(0, order.length - clear.length)) {
            cap(i);
            draw(i, look.plane ? this.cutPipelines.clipped : this.uncut);
        }
        // What remains is behind the clip plane, or in front of it.
        const areCapsLast = isEyeCutOff(look, projection);
        if (!areCapsLast) clear.forEach(cap);
        const { sorted, runs } = depthOrder(layers, clear, projection);
        for (const { i, indices } of sorted) this.uploadOrder(this.layer(i), indices);
        for (const { i, first, end } of runs) {
            choose(i, this.cutPipelines.transparent);
            pass.setIndexBuffer(this.layer(i).indices, "uint32");
            pass.drawIndexed(end - first, 1, first);
        }
        if (areCapsLast) clear.forEach(cap);
        pass.end();
    }

    /** Resolves when the device has finished drawing. */
    done() {
        return this.device.queue.onSubmittedWorkDone();
    }

    /** Draws a picture and reads it back: rows from the top, four bytes per pixel, premultiplied alpha. */
    async read(layers, look, projection, [width, height]) {
        await this.prepare(layers, look);
        const { device } = this;
        const bytesPerRow = Math.ceil((4 * width) / 256) * 256;
        const buffer = device.createBuffer({
            size: bytesPerRow * height,
            usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ,
        });
        const encoder = device.createCommandEncoder();
        this.encode(encoder, layers, look, projection, [width, height]);
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

    /** Calls back when the device is lost. */
    onLost(callback) {
        this.device.lost.then(({ reason }) => {
            if (reason !== "destroyed") callback();
        });
    }
}
