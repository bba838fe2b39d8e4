// MOZ_lightmap for three.js's GLTFLoader: loader.register((parser) => new MozLightmap(parser)).
//
//   "extensions": {"MOZ_lightmap": {"index": 0, "texCoord": 1, "intensity": 17.5}}      of a material
//
// The texture holds irradiance / intensity, linear. three.js shows reflectance / pi * texel * lightMapIntensity, so that
// what it draws is luminance: nit, where the intensity is in lx.
import { LinearSRGBColorSpace } from 'three';

export class MozLightmap {
  constructor(parser) {
    this.name = 'MOZ_lightmap';
    this.parser = parser;
  }

  async extendMaterialParams(materialIndex, params) {
    const lightmap = this.parser.json.materials[materialIndex].extensions?.[this.name];
    if (lightmap === undefined) return;
    const texture = { texCoord: 1, ...lightmap };
    await this.parser.assignTexture(params, 'lightMap', texture, LinearSRGBColorSpace);
    params.lightMapIntensity = lightmap.intensity ?? 1;
  }
}
