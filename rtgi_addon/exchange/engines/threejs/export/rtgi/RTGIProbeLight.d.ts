import { DataTexture, Light } from 'three/webgpu';
import { RTGIProbeVolumes } from './RTGIProbeVolumes.js';

/** The probes' light on every material of the scene, for WebGPURenderer. @throws Error before three r187. */
export class RTGIProbeLight extends Light {
  constructor(probes: RTGIProbeVolumes);
  readonly isRTGIProbeLight: true;
  readonly probes: RTGIProbeVolumes;
  readonly distances: DataTexture;
  dispose(): void;
}
