// GLB files as programs of others read them: the validator of glTF, and the importer of three.js. Arguments are files; each is
// told in one line of JSON.

import { readFileSync } from "node:fs";
import validator from "gltf-validator";
import { AnimationMixer, Box3, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

/** Times at which an animation is looked at, as shares of its length. */
const SHARES = [0, 0.26, 0.5, 0.999];

// The importer looks for workers and pictures there.
globalThis.self ??= globalThis;

function imported(bytes) {
    const { buffer, byteOffset, byteLength } = bytes;
    const file = buffer.slice(byteOffset, byteOffset + byteLength);
    return new Promise((done, fail) => new GLTFLoader().parse(file, "", done, fail));
}

/** Meshes that are seen, and the box around their vertices as they are moved and changed. */
function seen(scene) {
    scene.updateMatrixWorld(true);
    const box = new Box3();
    const point = new Vector3();
    let nTriangles = 0;
    scene.traverse((mesh) => {
        // Where a scale is 0 it is 0 in the matrix; taken apart, it would be 1.
        if (!mesh.isMesh || mesh.matrixWorld.elements.slice(0, 12).every((x) => x === 0)) return;
        nTriangles += mesh.geometry.index.count / 3;
        const { count } = mesh.geometry.attributes.position;
        for (let i = 0; i < count; i++) box.expandByPoint(mesh.getVertexPosition(i, point).applyMatrix4(mesh.matrixWorld));
    });
    return { nTriangles, low: box.min.toArray(), high: box.max.toArray() };
}

for (const path of process.argv.slice(2)) {
    const bytes = new Uint8Array(readFileSync(path));
    const { issues } = await validator.validateBytes(bytes);
    const { scene, animations } = await imported(bytes);
    const frames = [];
    if (animations.length > 0) {
        const mixer = new AnimationMixer(scene);
        mixer.clipAction(animations[0]).play();
        for (const share of SHARES) {
            mixer.setTime(share * animations[0].duration);
            frames.push(seen(scene));
        }
    } else frames.push(seen(scene));
    const messages = issues.messages.filter(({ severity }) => severity < 2);
    console.log(JSON.stringify({ path, messages, frames }));
}
