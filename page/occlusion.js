// Ambient occlusion of the opaque surfaces of a picture; the twin of src/render/occlusion.rs, on WebGPU with shaders/occlusion.wgsl
// and on WebGL2 with page/occlusion.frag.glsl.

/** The radius of occlusion, as a share of half the height of the picture at the target. */
const RADIUS = 0.14;

/** The OcclusionUniforms of the shader: depth, half extent, size, radius, and whether the projection is parallel. */
function occlusionUniforms({ depth, halfExtent, distance, isParallel }, [width, height]) {
    return [...depth, ...halfExtent, width, height, RADIUS * halfExtent[1] * (isParallel ? 1 : distance), isParallel];
}

class WebGpuOcclusion {
    static async compile(device, format) {
        const module = device.createShaderModule({ code: byId("occlusion-wgsl").textContent });
        const pipeline = (entryPoint, target, count) => device.createRenderPipelineAsync({
            layout: "auto",
            vertex: { module, entryPoint: "picture_vertex" },
            fragment: { module, entryPoint, targets: [target] },
            multisample: { count },
        });
        const multiply = {
            color: { srcFactor: "dst", dstFactor: "zero" },
            alpha: { srcFactor: "zero", dstFactor: "one" },
        };
        const occlusion = new WebGpuOcclusion();
        occlusion.device = device;
        occlusion.visibility = await pipeline("visibility_fragment", { format: "r8unorm" }, 1);
        occlusion.darken = await pipeline("darken_fragment", { format, blend: multiply }, 4);
        occlusion.uniforms = device.createBuffer({ size: 32, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
        return occlusion;
    }

    /** Records the occlusion of a picture from its samples and their depth. */
    encode(encoder, { samples, depth, picture }, projection) {
        const { device, uniforms } = this;
        const size = [picture.width, picture.height];
        const numbers = new Float32Array(occlusionUniforms(projection, size));
        new Uint32Array(numbers.buffer)[7] = projection.isParallel ? 1 : 0;
        device.queue.writeBuffer(uniforms, 0, numbers);
        if (this.texture?.width !== size[0] || this.texture?.height !== size[1]) {
            this.texture?.destroy();
            const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.TEXTURE_BINDING;
            this.texture = device.createTexture({ size, format: "r8unorm", usage });
        }
        const textures = [depth.createView({ aspect: "depth-only" }), this.texture.createView()];
        const pass = (pipeline, n, target) => {
            const entries = [{ buffer: uniforms }, ...textures.slice(0, n)].map((resource, binding) => ({ binding, resource }));
            const renderPass = encoder.beginRenderPass({ colorAttachments: [{ storeOp: "store", ...target }] });
            renderPass.setPipeline(pipeline);
            renderPass.setBindGroup(0, device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }));
            renderPass.draw(3);
            renderPass.end();
        };
        pass(this.visibility, 1, { view: textures[1], loadOp: "clear" });
        pass(this.darken, 2, { view: samples.createView(), resolveTarget: picture.createView(), loadOp: "load" });
    }
}

class WebGl2Occlusion {
    constructor(renderer) {
        const text = byId("occlusion-glsl").textContent.trimStart();
        this.renderer = renderer;
        this.visibility = renderer.linked(byId("behind-vertex").textContent.trimStart(), text.replace("\n", "\n#define VISIBILITY\n"));
        this.darken = renderer.linked(byId("behind-vertex").textContent.trimStart(), text);
        this.target = renderer.gl.createFramebuffer();
    }

    /** Draws the occlusion of a picture from its samples and their depth. */
    draw(projection, size) {
        const { renderer, target } = this;
        const { gl, samples, resolved, depth } = renderer;
        gl.bindFramebuffer(gl.READ_FRAMEBUFFER, samples);
        gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, resolved);
        gl.blitFramebuffer(0, 0, ...size, 0, 0, ...size, gl.DEPTH_BUFFER_BIT, gl.NEAREST);
        gl.bindFramebuffer(gl.FRAMEBUFFER, target);
        if (this.size?.[0] !== size[0] || this.size?.[1] !== size[1]) {
            gl.deleteTexture(this.texture ?? null);
            this.texture = renderer.texture(gl.R8, size);
            gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
            this.size = size;
        }
        gl.bindVertexArray(null);
        gl.disable(gl.DEPTH_TEST);
        this.pass(this.visibility, [depth], projection, size);
        // Only over samples of surfaces, whose depth is less.
        gl.bindFramebuffer(gl.FRAMEBUFFER, samples);
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.GREATER);
        gl.depthMask(false);
        gl.enable(gl.BLEND);
        gl.blendFuncSeparate(gl.DST_COLOR, gl.ZERO, gl.ZERO, gl.ONE);
        this.pass(this.darken, [depth, this.texture], projection, size);
        gl.disable(gl.BLEND);
        gl.depthMask(true);
        gl.depthFunc(gl.LESS);
    }

    pass(program, textures, projection, size) {
        const { gl } = this.renderer;
        const at = (name) => gl.getUniformLocation(program, name);
        gl.useProgram(program);
        const uniforms = occlusionUniforms(projection, size);
        ["depth", "half_extent", "size"].forEach((name, i) => gl.uniform2f(at(name), uniforms[2 * i], uniforms[2 * i + 1]));
        gl.uniform1f(at("radius"), uniforms[6]);
        gl.uniform1i(at("parallel"), uniforms[7] ? 1 : 0);
        textures.forEach((texture, unit) => {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(gl.TEXTURE_2D, texture);
            gl.uniform1i(at(["depths", "visibility"][unit]), unit);
        });
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
}
