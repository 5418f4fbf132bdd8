import {
  Color, IUniform, Light, LightProbe, Loader, LoadingManager, Material, Mesh, Object3D, SphericalHarmonics3, Vector3,
} from 'three';

export const FORMAT: 'rtgi-three/1';

/** One volume as the .json describes it; matrices are column by column. */
export interface RTGIVolume {
  readonly name: string;
  /** Of the probes, or of the nodes that name scattered ones. */
  readonly resolution: readonly [number, number, number];
  /** How many probes a scattered volume has. */
  readonly probes?: number;
  readonly centre: readonly [number, number, number];
  readonly worldFromLocal: readonly number[];
  readonly latticeFromOffset: readonly number[];
  readonly normalBias: number;
  readonly tile: number;
  readonly distanceStep: number;
}

/** What `RTGISpheres` of RTGISpheres.js is to materials; an export without sphere probes has no such file. */
export interface RTGIMirrors {
  readonly count: number;
  splice(shader: { fragmentShader: string; uniforms: Record<string, IUniform> }): void;
}

/** What `RTGIAtlas` of RTGIAtlas.js is to materials; an export without a light atlas has no such file. */
export interface RTGIAtlasLight {
  prepare(mesh: Mesh): boolean;
  splice(shader: { vertexShader: string; fragmentShader: string; uniforms: Record<string, IUniform> }, part: object): void;
}

/** All of a lamp's light is in the probes; what surfaces reflect of it; or nothing. */
export type RTGILampRole = 'all' | 'bounces' | 'none';

/** The .json of an export. */
export interface RTGIProbeDescription {
  readonly format: typeof FORMAT;
  readonly generator: string;
  readonly scene: string;
  readonly includesDirect: boolean;
  readonly lamps?: Readonly<Record<string, RTGILampRole>>;
  readonly objects?: Readonly<Record<string, 'dynamic'>>;
  readonly data: { readonly file: string; readonly bytes: number };
  readonly volumes: readonly RTGIVolume[];
}

/** Loads the .json of an export and the .bin that it names. */
export class RTGIProbeLoader extends Loader<RTGIProbeVolumes> {
  constructor(manager?: LoadingManager);
  load(url: string, onLoad: (probes: RTGIProbeVolumes) => void, onProgress?: (event: ProgressEvent) => void,
    onError?: (error: unknown) => void): void;
  /** @throws Error if the two do not belong together, are of another format, or three is too old. */
  parse(description: RTGIProbeDescription, buffer: ArrayBuffer): RTGIProbeVolumes;
}

/** The probe volumes of one bake. They may be moved, turned and scaled (alike along all axes) with the model they light. */
export class RTGIProbeVolumes extends Object3D {
  readonly isRTGIProbeVolumes: true;
  /** Whether the direct light of any lamp is in the probes. The scene's own lights add that of the others. */
  readonly includesDirect: boolean;
  /** What is baked of each lamp, by its name in Blender. */
  readonly lamps: Readonly<Record<string, RTGILampRole>>;
  /** Objects that the bake does not know and that receive its light, by their names in Blender. */
  readonly objects: Readonly<Record<string, 'dynamic'>>;
  readonly volumes: readonly (RTGIVolume & { readonly count: number })[];
  /** A factor of the probes' light; 1 is the bake's own. */
  intensity: number;
  /** Whether the probes hold the direct light of a lamp of the glTF, so that it must not shine as well. */
  holdsDirect(light: Light): boolean;
  /** Have materials mirror sphere probes from the next `apply` on. */
  addMirrors(mirrors: RTGIMirrors | null): this;
  /** Have the objects of a light atlas read it in place of the probes from the next `apply` on. */
  addAtlas(atlas: RTGIAtlasLight | null): this;
  /** Light a material, or every lit material below an object. @throws Error for a material that cannot be lit. */
  apply(target: Material | Object3D): this;
  /** Take the light from a material, or from everything below an object, again. */
  release(target: Material | Object3D): this;
  /** Irradiance [W/m2] at a point of the world with a unit normal there; of a normal map's, with the surface's own besides. */
  irradiance(position: Vector3, normal: Vector3, target?: Color, surfaceNormal?: Vector3): Color;
  /** Coefficients of the radiance that arrives at a point of the world, as LightProbe wants them. */
  radiance(position: Vector3, target: SphericalHarmonics3): SphericalHarmonics3;
  /** Visit every probe: where it is in the world, whether it holds light, and the index of its volume. */
  forEachProbe(visit: (position: Vector3, live: boolean, volume: number) => void): void;
  /** Free the textures and give the materials back as they were. */
  dispose(): void;
}

/** A LightProbe with the probes' light at one point, for a scene without the hook or an object that moves. */
export class RTGILightProbe extends LightProbe {
  constructor(probes: RTGIProbeVolumes, intensity?: number);
  readonly probes: RTGIProbeVolumes;
  /** Take the light of a point of the world. */
  update(position: Vector3): this;
}
