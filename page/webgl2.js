// Draws on WebGL2 with page/surface.*.glsl: the same tables in textures, the same picture as on WebGPU. The picture is drawn in
// linear light into a multisampled sRGB target and copied to the canvas, which has no sRGB format.

/** Texels per row of a table. */
const ROW = 2048;

class WebGl2Renderer {
    /** Opens a renderer without a spectrum; throws if there is no WebGL2, or the spectrum described by `about` is too large. */
    static async open(canvas, about) {
        const gl = canvas.getContext("webgl2", { antialias: false, depth: false, alpha: false });
        if (!gl) throw new Error("no WebGL2");
        if (Math.ceil(about.knots / ROW) > gl.getParameter(gl.MAX_TEXTURE_SIZE)) {
            throw new Error("the spectrum is too large for this device");
        }
        return new WebGl2Renderer(gl, canvas);
    }

    constructor(gl, canvas) {
        this.name = "WebGL2";
        Object.assign(this, { gl, canvas });
        const text = (id) => byId(id).textContent.trimStart();
        const variant = (name) => text("fragment-glsl").replace("\n", `\n#define ${name}\n`);
        this.uncut = this.linked(text("vertex-glsl"), text("fragment-glsl"));
        // The others are compiled on demand.
        this.compileCutPrograms = () => {
            this.cut ??= this.linked(text("vertex-glsl"), variant("CUT"));
            this.cap ??= this.linked(text("cap-vertex"), variant("CAP"));
        };
        this.copy = this.linked(text("copy-vertex"), text("copy-fragment"));
        this.uniforms = new Map();
        this.layers = [];
        this.nSamples = Math.min(4, gl.getParameter(gl.MAX_SAMPLES));
    }

    /** Uploads a spectrum. */
    async load(spectrum, step) {
        this.spectrum = spectrum;
        for (const [, texture] of this.tables ?? []) this.gl.deleteTexture(texture);
        this.uploadTables(spectrum.tables ?? tablesOf(spectrum, step));
    }

    linked(vertex, fragment) {
        const { gl } = this;
        const program = gl.createProgram();
        for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, source);
            gl.compileShader(shader);
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
            const logs = gl.getAttachedShaders(program).map((s) => gl.getShaderInfoLog(s));
            throw new Error([gl.getProgramInfoLog(program), ...logs].join(" "));
        }
        return program;
    }

    uploadTables({ isovalues, firstKnot, knots }) {
        const { gl } = this;
        const integer = gl.RED_INTEGER;
        const tables = [
            ["isovalues", isovalues, 2, gl.RG32F, gl.RG, gl.FLOAT],
            ["first_knot", firstKnot, 1, gl.R32UI, integer, gl.UNSIGNED_INT],
            ["knots", knots, 4, gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT],
        ];
        this.tables = tables.map(([name, table, width, internal, format, type]) => {
            const texture = gl.createTexture();
            gl.bindTexture(gl.TEXTURE_2D, texture);
            for (const key of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
                gl.texParameteri(gl.TEXTURE_2D, key, gl.NEAREST);
            }
            const nRows = Math.max(Math.ceil(table.length / width / ROW), 1);
            gl.texStorage2D(gl.TEXTURE_2D, 1, internal, ROW, nRows);
            // Whole rows, then the rest of the last row.
            const nWhole = Math.floor(table.length / width / ROW);
            const rest = table.length / width - nWhole * ROW;
            if (nWhole > 0) {
                gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, nWhole, format, type, table, 0);
            }
            if (rest > 0) {
                const from = nWhole * ROW * width;
                gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, nWhole, rest, 1, format, type, table, from);
            }
            return [name, texture];
        });
    }

    uniform(program, name) {
        if (!this.uniforms.has(program)) this.uniforms.set(program, new Map());
        const known = this.uniforms.get(program);
        if (!known.has(name)) known.set(name, this.gl.getUniformLocation(program, name));
        return known.get(name);
    }

    /** The buffers of a layer. */
    layer(i) {
        const { gl } = this;
        while (this.layers.length <= i) {
            const layer = { corners: gl.createBuffer(), vertexArray: gl.createVertexArray(), words: new Uint32Array(4096), nTriangles: 0 };
            gl.bindVertexArray(layer.vertexArray);
            gl.bindBuffer(gl.ARRAY_BUFFER, layer.corners);
            // Each corner: its vertex, the code of its normal, the colour code of its triangle.
            for (const place of [0, 1, 2]) {
                gl.enableVertexAttribArray(place);
                gl.vertexAttribIPointer(place, 1, gl.UNSIGNED_INT, 12, 4 * place);
            }
            this.layers.push(layer);
        }
        return this.layers[i];
    }

    /** The number of triangles of the first layer. */
    get nTriangles() {
        return this.layers[0]?.nTriangles ?? 0;
    }

    /** Compiles what plain pictures do not need. */
    prepare(layers, { plane, occlusion }) {
        if (plane || layers.some(({ opacity }) => opacity < 1)) this.compileCutPrograms();
        if (occlusion) this.occlusion ??= new WebGl2Occlusion(this);
        return null;
    }

    /** The greatest width and height of a picture, pixels. */
    get largest() {
        const { gl } = this;
        return Math.min(gl.getParameter(gl.MAX_RENDERBUFFER_SIZE), gl.getParameter(gl.MAX_TEXTURE_SIZE));
    }

    /** Uploads the triangles of layer i and the normals at their corners. */
    upload({ nTriangles, corners, vertices, normals, components, codes = components }, i = 0) {
        const { gl } = this;
        const layer = this.layer(i);
        const words = withCapacity(layer.words, 9 * nTriangles);
        for (let at = 0; at < 3 * nTriangles; at++) {
            words[3 * at] = vertices[corners[at]];
            words[3 * at + 1] = normals[corners[at]];
            words[3 * at + 2] = codes[(at / 3) | 0];
        }
        Object.assign(layer, { nTriangles, words });
        gl.bindBuffer(gl.ARRAY_BUFFER, layer.corners);
        gl.bufferData(gl.ARRAY_BUFFER, words.subarray(0, 9 * nTriangles), gl.DYNAMIC_DRAW);
    }

    /** Draws a picture of a size into `resolved`. */
    render(layers, look, projection, [width, height]) {
        const { gl } = this;
        this.resize(width, height);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.samples);
        gl.viewport(0, 0, width, height);
        gl.clearBufferfv(gl.COLOR, 0, [...look.background, look.isTransparent ? 0 : 1]);
        gl.clearBufferfi(gl.DEPTH_STENCIL, 0, 1, 0);
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.LESS);
        const order = drawingOrder(layers);
        const nOpaque = layers.filter(({ opacity }) => opacity === 1).length;
        for (const i of order.slice(0, nOpaque)) {
            this.drawCap(i, layers[i], look, projection);
            this.use(i, layers[i], look, projection);
            gl.drawArrays(gl.TRIANGLES, 0, 3 * this.layer(i).nTriangles);
        }
        // Transparent layers are drawn over the occlusion of the opaque ones.
        if (nOpaque > 0 && look.occlusion) this.occlusion?.draw(projection, [width, height]);
        this.drawTransparent(order.slice(nOpaque), layers, look, projection);
        gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.samples);
        gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.resolved);
        gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    }

    /** Draws into the canvas. */
    draw(layers, look, projection) {
        const { gl } = this;
        const { width, height } = this.canvas;
        this.render(layers, look, projection, [width, height]);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.viewport(0, 0, width, height);
        gl.disable(gl.DEPTH_TEST);
        gl.useProgram(this.copy);
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, this.picture);
        gl.uniform1i(gl.getUniformLocation(this.copy, "picture"), 0);
        gl.bindVertexArray(null);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    /** Chooses the program and the triangles of layer i. */
    use(i, layer, look, projection) {
        const program = look.plane || layer.opacity < 1 ? this.cut : this.uncut;
        this.gl.bindVertexArray(this.layer(i).vertexArray);
        this.gl.useProgram(program);
        this.setUniforms(program, layer, look, projection);
    }

    /** Draws transparent layers, inner ones first in the order: all of them together, from the farthest triangles to the nearest. */
    drawTransparent(order, layers, look, projection) {
        if (order.length === 0) return;
        const { gl } = this;
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        const caps = () => { for (const i of order) this.drawCap(i, layers[i], look, projection); };
        // What remains is behind the clip plane, or in front of it.
        const areCapsLast = isEyeCutOff(look, projection);
        if (!areCapsLast) caps();
        const { sorted, runs } = depthOrder(layers, order, projection);
        for (const { i, indices } of sorted) {
            // This sets the uniforms of all layers, too.
            this.use(i, layers[i], look, projection);
            gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.layer(i).indices ??= gl.createBuffer());
            gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STREAM_DRAW);
        }
        gl.depthMask(false);
        for (const { i, first, end } of runs) {
            gl.bindVertexArray(this.layer(i).vertexArray);
            this.setOwn(this.cut, layers[i], look);
            gl.drawElements(gl.TRIANGLES, end - first, gl.UNSIGNED_INT, 4 * first);
        }
        gl.depthMask(true);
        if (areCapsLast) caps();
        gl.disable(gl.BLEND);
    }

    /** Counts front and back faces of layer i behind the clip plane, and draws a cap where the plane is inside the surface. */
    drawCap(i, layer, look, projection) {
        if (!look.plane || look.open) return;
        const { gl } = this;
        this.use(i, layer, look, projection);
        gl.enable(gl.STENCIL_TEST);
        gl.colorMask(false, false, false, false);
        gl.depthMask(false);
        gl.depthFunc(gl.ALWAYS);
        gl.stencilFunc(gl.ALWAYS, 0, 255);
        gl.stencilOpSeparate(gl.FRONT, gl.KEEP, gl.KEEP, gl.DECR_WRAP);
        gl.stencilOpSeparate(gl.BACK, gl.KEEP, gl.KEEP, gl.INCR_WRAP);
        gl.drawArrays(gl.TRIANGLES, 0, 3 * this.layer(i).nTriangles);
        gl.colorMask(true, true, true, true);
        gl.depthMask(true);
        gl.depthFunc(gl.LESS);
        gl.stencilFunc(gl.NOTEQUAL, 0, 255);
        gl.stencilOp(gl.KEEP, gl.ZERO, gl.ZERO);
        gl.useProgram(this.cap);
        gl.bindVertexArray(null);
        this.setUniforms(this.cap, layer, look, projection);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        gl.disable(gl.STENCIL_TEST);
    }

    /** Sets uniforms of a kind. A program may lack some of them. */
    set(program, kind, values) {
        for (const name in values) this.gl[`uniform${kind}`](this.uniform(program, name), values[name]);
    }

    /** Sets what is a layer's own. */
    setOwn(program, { query, front, backside, palette, stops, opacity }, look) {
        this.set(program, "2fv", { isovalue: scaledIsovalue(this.spectrum, query.isovalue) });
        this.set(program, "1ui", { rank: Math.max(query.active.rank, 0) });
        this.set(program, "3fv", { front: front.slice(0, 3) });
        const wire = palette ? COLOURED_WIRE : PLAIN_WIRE;
        this.set(program, "4fv", { back: insideOf(backside, look), wire, ...stops && { map: stops } });
        this.set(program, "1i", { palette });
        this.set(program, "1f", { opacity });
    }

    setUniforms(program, layer, look, projection) {
        const { gl } = this;
        const { clipFromVoxel, eyeFromVoxel, eyeFromNormal, depth, halfExtent, mirrored, isParallel } = projection;
        const matrices = { clip_from_voxel: clipFromVoxel, eye_from_voxel: eyeFromVoxel, eye_from_normal: eyeFromNormal };
        const at = (name) => this.uniform(program, name);
        for (const name in matrices) gl.uniformMatrix4fv(at(name), false, matrices[name]);
        this.setOwn(program, layer, look);
        this.set(program, "4fv", { plane: look.plane ?? [0, 0, 0, 1] });
        this.set(program, "2fv", { depth, half_extent: halfExtent });
        const { wireframe, pixelRatio, lamp } = look;
        this.set(program, "1f", { silhouette: look.silhouette ? SILHOUETTE * pixelRatio : 0, wire_width: wireframe ? pixelRatio : 0 });
        this.set(program, "1i", { mirrored, parallel: isParallel, lamp });
        this.tables.forEach(([name, texture], unit) => {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(gl.TEXTURE_2D, texture);
            gl.uniform1i(at(name), unit);
        });
    }

    /** Makes a texture of the picture's size that is read without filtering. */
    texture(format, [width, height]) {
        const { gl } = this;
        const texture = gl.createTexture();
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        return texture;
    }

    /** Makes targets of the picture's size. */
    resize(width, height) {
        if (this.size?.[0] === width && this.size?.[1] === height) return;
        const { gl } = this;
        for (const buffer of this.buffers ?? []) gl.deleteRenderbuffer(buffer);
        for (const target of [this.samples, this.resolved]) gl.deleteFramebuffer(target ?? null);
        for (const texture of [this.picture, this.depth]) gl.deleteTexture(texture ?? null);
        this.samples = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.samples);
        this.buffers = [
            [gl.SRGB8_ALPHA8, gl.COLOR_ATTACHMENT0],
            [gl.DEPTH24_STENCIL8, gl.DEPTH_STENCIL_ATTACHMENT],
        ].map(([format, attachment]) => {
            const buffer = gl.createRenderbuffer();
            gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
            gl.renderbufferStorageMultisample(gl.RENDERBUFFER, this.nSamples, format, width, height);
            gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, buffer);
            return buffer;
        });
        this.picture = this.texture(gl.SRGB8_ALPHA8, [width, height]);
        this.depth = this.texture(gl.DEPTH24_STENCIL8, [width, height]);
        this.resolved = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.resolved);
        for (const [attachment, texture] of [[gl.COLOR_ATTACHMENT0, this.picture], [gl.DEPTH_STENCIL_ATTACHMENT, this.depth]]) {
            gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, texture, 0);
        }
        this.size = [width, height];
    }

    /** Resolves when the device has finished drawing. */
    done() {
        const { gl } = this;
        const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        return new Promise((resolve) => {
            const look = () => {
                const state = gl.clientWaitSync(sync, 0, 0);
                if (state === gl.TIMEOUT_EXPIRED) {
                    setTimeout(look, 1);
                    return;
                }
                gl.deleteSync(sync);
                resolve();
            };
            look();
        });
    }

    /** Draws a picture and reads it back: rows from the top, four bytes per pixel, premultiplied alpha. */
    async read(layers, look, projection, [width, height]) {
        this.prepare(layers, look);
        this.render(layers, look, projection, [width, height]);
        const { gl } = this;
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.resolved);
        const rows = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, rows);
        const pixels = new Uint8ClampedArray(rows.length);
        for (let y = 0; y < height; y++) {
            const from = 4 * (height - 1 - y) * width;
            pixels.set(rows.subarray(from, from + 4 * width), 4 * y * width);
        }
        return { width, height, pixels };
    }

    /** Calls back when the context is lost. */
    onLost(callback) {
        on(this.canvas, "webglcontextlost", callback);
    }
}
