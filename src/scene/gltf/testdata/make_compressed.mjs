// node make_compressed.mjs FOLDER   writes the files beside this script: a torus (radius 1, tube 0.4, about +y) whose uv
// are its two angles in turns. An animation turns it about +y. Other programs compress it.
// npm install gltfpack @gltf-transform/core @gltf-transform/extensions draco3dgltf
import {execFileSync} from 'node:child_process';
import {rmSync} from 'node:fs';
import {Document, NodeIO} from '@gltf-transform/core';
import {KHRDracoMeshCompression} from '@gltf-transform/extensions';
import draco3d from 'draco3dgltf';

const folder = process.argv[2];
const [around, along] = [24, 12];
const positions = [], normals = [], uvs = [], indices = [];
for (let i = 0; i <= around; ++i) for (let j = 0; j <= along; ++j) {
  const [u, v] = [i / around, j / along], [a, b] = [2 * Math.PI * u, 2 * Math.PI * v];
  const n = [Math.cos(b) * Math.cos(a), Math.sin(b), Math.cos(b) * Math.sin(a)];
  normals.push(...n);
  positions.push(Math.cos(a) + 0.4 * n[0], 0.4 * n[1], Math.sin(a) + 0.4 * n[2]);
  uvs.push(u, v);
  if (i < around && j < along) {
    const p = i * (along + 1) + j, q = p + along + 1;
    indices.push(p, p + 1, q, q, p + 1, q + 1);
  }
}
const document = new Document();
const buffer = document.createBuffer();
const accessor = (type, values) => document.createAccessor().setType(type).setArray(values).setBuffer(buffer);
const primitive = document.createPrimitive()
  .setAttribute('POSITION', accessor('VEC3', new Float32Array(positions)))
  .setAttribute('NORMAL', accessor('VEC3', new Float32Array(normals)))
  .setAttribute('TEXCOORD_0', accessor('VEC2', new Float32Array(uvs)))
  .setIndices(accessor('SCALAR', new Uint16Array(indices)))
  .setMaterial(document.createMaterial('glaze'));
const node = document.createNode('torus').setMesh(document.createMesh('torus').addPrimitive(primitive));
document.createScene().addChild(node);
const half = Math.SQRT1_2;
const sampler = document.createAnimationSampler().setInterpolation('LINEAR')
  .setInput(accessor('SCALAR', new Float32Array([0, 1])))
  .setOutput(accessor('VEC4', new Float32Array([0, 0, 0, 1, 0, half, 0, half])));
const channel = document.createAnimationChannel().setTargetNode(node).setTargetPath('rotation').setSampler(sampler);
document.createAnimation('turn').addSampler(sampler).addChannel(channel);

const io = new NodeIO().registerExtensions([KHRDracoMeshCompression])
  .registerDependencies({'draco3d.encoder': await draco3d.createEncoderModule()});
const plain = `${folder}/plain.glb`;
await io.write(plain, document);
const pack = (name, ...options) => execFileSync('npx', ['gltfpack', '-i', plain, '-o', `${folder}/${name}`, '-kn', '-km', '-kv', ...options]);
pack('meshopt.glb', '-cc', '-vtf');
pack('meshopt_floats.glb', '-cc', '-vpf', '-vtf', '-vnf', '-af', '0');
const bits = {POSITION: 14, NORMAL: 10, TEX_COORD: 12};
for (const [name, method] of [['draco_sequential.glb', 0], ['draco.glb', 1]]) {
  document.createExtension(KHRDracoMeshCompression).setRequired(true).setEncoderOptions({method, quantizationBits: bits});
  await io.write(`${folder}/${name}`, document);
}
rmSync(plain);
