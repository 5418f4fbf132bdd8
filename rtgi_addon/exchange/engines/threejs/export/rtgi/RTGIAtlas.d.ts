import { IUniform, Mesh, Object3D, WebGLRenderer } from 'three';

export const ATLAS_FORMAT: 'rtgi-three-atlas/2';

/** The light atlas of a .json and of the .bin beside it. */
export function loadAtlas(url: string | URL): Promise<RTGIAtlas>;

export interface AtlasPart {
  name: string;
  texcoord: number;
  scale: number;
  offset: [number, number];
}

/** What lights objects at the texels of their UV maps: pass it to `RTGIProbeVolumes.addAtlas` before `apply`. */
export class RTGIAtlas {
  /** @throws Error if the two do not belong together or are of another format. */
  constructor(description: object, buffer: ArrayBuffer, tables?: ArrayBuffer | null);
  /** What the columns of its tables are, if it follows light. */
  readonly transfer: object | null;
  /** What `RTGIRelight.update` calls; null: the light of the bake again. */
  relight(rows: Float32Array | null, renderer?: WebGLRenderer | null): void;
  readonly parts: Map<string, AtlasPart>;
  /** GLSL of `rtgi_atlas_irradiance`, for shaders of your own with `uniforms`. */
  readonly declared: string;
  readonly uniforms: Record<string, IUniform>;
  partOf(object: Object3D): AtlasPart | undefined;
  /** Give a mesh of the atlas materials of its own; whether it is one. */
  prepare(mesh: Mesh): boolean;
  /** Irradiance of a part at its map's coordinates, v down, under a unit normal. */
  irradiance(name: string, st: number[], normal: number[]): [number, number, number];
  splice(shader: { vertexShader: string; fragmentShader: string; uniforms: Record<string, IUniform> }, part: AtlasPart): void;
  dispose(): void;
}
