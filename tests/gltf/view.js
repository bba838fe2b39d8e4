// Draws /scene.glb once and posts the picture: PNG, sRGB, opaque where there is a surface.
//
//   view.html?eye=X,Y,Z&target=X,Y,Z&up=X,Y,Z&fov=DEGREES&size=PIXELS&exposure=E
//
// A pixel is min(1, exposure * luminance). There is no lamp, no environment and no gloss: the lightmaps are all the light.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MozLightmap } from './moz_lightmap.js';

// Radiosity is diffuse: what three.js's standard material takes off for its gloss would be missing.
function diffuseOnly(material) {
  const { name, map, emissive, emissiveMap, emissiveIntensity, lightMap, lightMapIntensity } = material;
  const { side, vertexColors, alphaTest, transparent, opacity } = material;
  const color = material.color.clone().multiplyScalar(1 - (material.metalness ?? 0));
  return new THREE.MeshLambertMaterial({ name, color, map, emissive, emissiveMap, emissiveIntensity, lightMap,
    lightMapIntensity, side, vertexColors, alphaTest, transparent, opacity });
}

async function draw(parameters) {
  const vector = (name) => new THREE.Vector3(...parameters.get(name).split(',').map(Number));
  const number = (name) => Number(parameters.get(name));
  const renderer = new THREE.WebGLRenderer({ alpha: true, antialias: true });
  renderer.setSize(number('size'), number('size'));
  renderer.setClearColor(0x000000, 0);
  renderer.toneMapping = THREE.LinearToneMapping;
  renderer.toneMappingExposure = number('exposure');

  const loader = new GLTFLoader().register((parser) => new MozLightmap(parser));
  const { scene } = await loader.loadAsync('/scene.glb');
  const lamps = [];
  let lightmapped = 0;
  scene.traverse((object) => {
    if (object.isLight) lamps.push(object);
    if (!object.isMesh) return;
    object.material = diffuseOnly(object.material);
    if (object.material.lightMap) lightmapped += 1;
  });
  for (const lamp of lamps) lamp.removeFromParent();
  if (lightmapped === 0) throw new Error('no mesh of the scene has a lightmap');

  const eye = vector('eye');
  const size = new THREE.Box3().setFromObject(scene).getBoundingSphere(new THREE.Sphere()).radius;
  const camera = new THREE.PerspectiveCamera(number('fov'), 1, size / 1000, eye.length() + 10 * size);
  camera.position.copy(eye);
  camera.up.copy(vector('up'));
  camera.lookAt(vector('target'));
  renderer.render(scene, camera);
  return new Promise((resolve) => renderer.domElement.toBlob(resolve, 'image/png'));
}

const answer = (kind, body) => fetch(`/${kind}`, { method: 'POST', body });
window.addEventListener('error', (event) => answer('failure', event.message));
draw(new URLSearchParams(location.search)).then(
  (picture) => answer('picture', picture),
  (error) => answer('failure', `${error.stack ?? error}`));
