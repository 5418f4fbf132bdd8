import { Camera, IUniform, Scene, WebGLRenderer } from 'three';

export const FORMAT: 'rtgi-three-media/1';

/** Three numbers: a point, a direction, or red, green and blue. */
export type RTGITriple = readonly [number, number, number] | readonly number[];

/** The media of a .json and of the .bin beside it. */
export function loadMedia(url: string | URL): Promise<RTGIMedia>;

/** What fills space between surfaces, and the light that it scatters. */
export class RTGIMedia {
  /** @throws Error if the two do not belong together or are of another format. */
  constructor(description: object, buffer: ArrayBuffer);
  /** GLSL of `rtgi_media_at` and `rtgi_media_march`, for shaders of your own with `uniforms`. */
  readonly glsl: string;
  readonly uniforms: Record<string, IUniform>;
  /** Extinction [1/m], and the radiance a metre that media give and scatter towards a camera that looks along a direction. */
  at(point: RTGITriple, direction: RTGITriple): { extinction: number[]; given: number[] };
  /** Transmittance, and the radiance that media add, along a ray. */
  march(origin: RTGITriple, direction: RTGITriple, length: number, steps?: number, jitter?: number):
    { left: number[]; gained: number[] };
  dispose(): void;
}

/** Draws a scene with media before its surfaces. */
export class RTGIMediaView {
  constructor(media: RTGIMedia, options?: { steps?: number; farthest?: number });
  render(renderer: WebGLRenderer, scene: Scene, camera: Camera): void;
  dispose(): void;
}
