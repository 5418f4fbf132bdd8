import { IUniform, Material, Object3D } from 'three';

export const VOXELS_FORMAT: 'rtgi-three-voxels/1';

/** The lit voxels of a .json and of the .bin beside it. */
export function loadVoxels(url: string | URL): Promise<RTGIVoxels>;

/** A scene as lit voxels, through which materials trace cones. */
export class RTGIVoxels {
  /** @throws Error if the two do not belong together or are of another format. */
  constructor(description: object, buffer: ArrayBuffer);
  /** Cones of a pixel. */
  readonly cones: number;
  /** Of each nested grid, finest first, its corners in the world, the side of its cells and its resolution along Blender's axes. */
  readonly cascades: { low: number[]; high: number[]; cell: number; resolution: number[] }[];
  /** Irradiance [W/m2] at a point under a unit normal, on the CPU: what materials find there. */
  irradiance(point: number[], normal: number[]): number[];
  /** Radiance [W/(sr m2)] that a surface of that roughness mirrors from a unit direction. */
  mirrored(point: number[], normal: number[], direction: number[], roughness: number): number[];
  /** GLSL of `rtgi_voxels_irradiance` and `rtgi_voxels_mirrored`, for shaders of your own with `uniforms`. */
  readonly declared: string;
  readonly uniforms: Record<string, IUniform>;
  /** Have materials of WebGLRenderer lit by cones. */
  apply(object: Object3D | Material): this;
  splice(shader: { vertexShader: string; fragmentShader: string; uniforms: Record<string, IUniform> }): void;
  dispose(): void;
}
