import { Color, Vector3, WebGLRenderer } from 'three';
import { RTGIProbeVolumes } from './RTGIProbeVolumes.js';

export const FORMAT: string;

/** A light as r, g, b, or one number for all three. */
export type RTGILight = Color | number | [number, number, number];

export interface RTGISun {
  towards: Vector3;
  irradiance: RTGILight;
}

/** Harmonics of a sky's radiance, and what those leave as irradiances of the table's suns. */
export interface RTGISky {
  harmonics: number[][];
  suns: number[][];
}

/** Other light on probes that were baked with their transfer. */
export class RTGIRelight {
  constructor(description: object, buffer: ArrayBuffer, probes: RTGIProbeVolumes);
  readonly probes: RTGIProbeVolumes;
  /** The lights of the bake. */
  readonly lights: { name: string; kind: 'world' | 'suns' | 'group' }[];
  /** By the names of the lights; 1 as they were baked. */
  factors: Record<string, RTGILight>;
  /** In place of the file's suns, if not null. */
  suns: RTGISun[] | null;
  /** In place of the world, if not null. */
  sky: RTGISky | null;
  /** How many updates it takes until all probes have followed. */
  parts: number;
  /** Whether `probes.irradiance`, `probes.radiance` and light probes follow too. */
  onCPU: boolean;
  setSun(azimuth: number, elevation: number, irradiance: RTGILight): this;
  update(renderer?: WebGLRenderer | null): boolean;
  finish(renderer?: WebGLRenderer | null): this;
  skyFrom(data: ArrayLike<number>, width: number, height: number, turn?: number): RTGISky;
  dispose(): void;
}

export function loadRelight(url: string, probes: RTGIProbeVolumes): Promise<RTGIRelight>;
export function sunTowards(azimuth: number, elevation: number, target?: Vector3): Vector3;
export function sunAt(hour: number, latitude?: number, day?: number, target?: Vector3): Vector3;
