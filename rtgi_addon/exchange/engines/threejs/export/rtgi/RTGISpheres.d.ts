import { IUniform } from 'three';

export const SPHERES_FORMAT: 'rtgi-three-spheres/1';

/** The sphere probes of a .json and of the .bin beside it. */
export function loadSpheres(url: string | URL): Promise<RTGISpheres>;

/** What mirrors show: pass it to `RTGIProbeVolumes.addMirrors` before `apply`. */
export class RTGISpheres {
  /** @throws Error if the two do not belong together or are of another format. */
  constructor(description: object, buffer: ArrayBuffer);
  readonly names: string[];
  readonly count: number;
  /** GLSL of `rtgi_spheres`, for shaders of your own with `uniforms`. */
  readonly glsl: string;
  readonly uniforms: Record<string, IUniform>;
  /** Radiance that a surface of that roughness mirrors from a unit direction, times the share that is known of it, and that share. */
  mirrored(position: number[], direction: number[], roughness: number): [number, number, number, number];
  splice(shader: { fragmentShader: string; uniforms: Record<string, IUniform> }): void;
  dispose(): void;
}
